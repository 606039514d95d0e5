"""`multiradar convert asterix` with damaged or foreign files."""

import gzip
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, EXIT_FAILED, run
from multiradar_schemas.reject import Reject
from multiradar_schemas.report import Report
from support.asterix.octets import block, final_format, gps, plot_048


def converted(folder: Path, content: bytes, *, status: int) -> Path:
    """Convert a file; return the folder that was written."""
    (folder / "recording").write_bytes(content)
    out = folder / "out"
    assert run(["convert", "asterix", str(folder / "recording"), "--out", str(out)]) == status
    return out


def last_reject(out: Path) -> Reject:
    """Return the last reject of a conversion."""
    lines = (out / "rejects.ndjson").read_text(encoding="utf-8").splitlines()
    return Reject.model_validate_json(lines[-1])


def cut_short(out: Path) -> dict[str, Any]:
    """Return the report on truncated files."""
    report = Report.model_validate_json((out / "report.json").read_bytes())
    figures: dict[str, Any] = report.figures
    return dict(figures["cut_short"])


@pytest.mark.parametrize("recorder", [False, True])
def test_a_file_that_ends_inside_a_block_is_reported_and_read_up_to_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], *, recorder: bool
) -> None:
    first, second = block(48, plot_048(1.0)), block(48, plot_048(2.0))
    whole = gps([(1.0, first), (2.0, second)]) if recorder else first + second
    missing = 5 + (10 if recorder else 0)
    out = converted(tmp_path, whole[:-missing], status=EXIT_FAILED)
    at = len(whole) - len(second) - (10 if recorder else 0)
    octets = f"{len(second) - 5} of {len(second)} octets"
    inside = f"the file ends inside the block at octet {at}, after {octets}"
    assert capsys.readouterr().err == (
        f"multiradar: recording: {inside}; probably truncated during copying; the readable part "
        f"is in {out}\n"
    )
    assert pl.read_parquet(out / "measurements.parquet")["time_s"].to_list() == [1.0]
    last = last_reject(out)
    assert (last.code, last.reason) == ("TRUNCATED", inside)
    assert last.raw == second[:-5].hex()


def test_final_format_that_ends_inside_an_envelope_is_reported_and_read_up_to_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = final_format([(float(k), block(48, plot_048(float(k)))) for k in range(3)])
    out = converted(tmp_path, whole[:-6], status=EXIT_FAILED)
    assert "the file ends inside the envelope at octet " in capsys.readouterr().err
    assert pl.read_parquet(out / "measurements.parquet")["time_s"].to_list() == [0.0, 1.0]
    assert last_reject(out).code == "TRUNCATED"


def test_a_recording_of_which_most_octets_are_quarantined_fails(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Octets between blocks are one reject, so that counting records does not show it."""
    good = block(48, plot_048(1.0)) * 40
    out = converted(tmp_path, good + bytes(len(good) + 80) + good[: len(good) // 40], status=1)
    assert capsys.readouterr().err == (
        "multiradar: recording: 52% of its 1 862 octets could not be decoded; rejects.ndjson gives "
        "the reason for each: check the file format and the editions of its categories\n"
    )
    assert pl.read_parquet(out / "measurements.parquet").height == 1


@pytest.mark.parametrize("rest", [bytes(40), b"\x31", b"\x30\x80", b"\x21\x01\x00\x80"])
def test_octets_after_the_last_block_are_not_a_file_that_was_cut(
    tmp_path: Path, rest: bytes
) -> None:
    out = converted(tmp_path, block(48, plot_048(1.0)) * 40 + rest, status=EXIT_DONE)
    assert last_reject(out).code == "MALFORMED_BLOCK"
    assert cut_short(out) == {}


def test_a_missing_file_is_reported_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert run(["convert", "asterix", str(tmp_path / "no"), "--out", str(out)]) == EXIT_FAILED
    assert "no: no such file" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        # The same octets in every process that collects this.
        (
            gzip.compress(block(48, plot_048(1.0)), mtime=0),
            "expected ASTERIX blocks, found a gzip file; decompress it first",
        ),
        (b"7z\xbc\xaf\x27\x1c" + bytes(99), "found a 7-Zip archive; decompress it first"),
        (b"\x28\xb5\x2f\xfd" + bytes(99), "found a Zstandard file; decompress it first"),
        (b"These are no blocks. " * 99, "expected ASTERIX blocks, found text"),
        (b"", "no ASTERIX blocks found"),
        (b"\xcd" * 2200, "no ASTERIX blocks found"),
    ],
    ids=["packed", "7-Zip", "Zstandard", "text", "empty", "header"],
)
def test_a_foreign_file_is_reported_and_leaves_nothing(
    tmp_path: Path, content: bytes, sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "recording"
    path.write_bytes(content)
    out = tmp_path / "out"
    assert run(["convert", "asterix", str(path), "--out", str(out)]) == EXIT_FAILED
    assert sentence in capsys.readouterr().err
    assert not out.exists()
