"""`multiradar convert asterix` with sources of unknown editions, and with impossible values."""

import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, EXIT_FAILED, run
from support.asterix.octets import block, final_format, plot_048, record, time_of_day
from support.asterix.old_edition import old_system_tracks

OLD = old_system_tracks(100)
PLOTS = [block(48, plot_048(28_800.0 + 0.05 * k)) for k in range(100)]
WHY = (
    "category 062 of 20-250: 100 of 100 blocks match no known edition (1.21, 1.20, 1.19, 1.18, "
    "1.17, 1.16, 1.12, 1.17-cs8), so all blocks are quarantined; to decode them anyway, select an "
    "edition"
)


def converted(folder: Path, content: bytes, *options: str, status: int) -> Path:
    """Convert a file; return the folder that was written."""
    (folder / "recording").write_bytes(content)
    out = folder / "out"
    command = ["convert", "asterix", str(folder / "recording"), "--out", str(out), *options]
    assert run(command) == status
    return out


def report(out: Path) -> dict[str, Any]:
    """Return `report.json`."""
    document: dict[str, Any] = json.loads((out / "report.json").read_bytes())
    return document


def reasons(out: Path) -> list[str]:
    """Return the reasons of all rejects."""
    lines = (out / "rejects.ndjson").read_text(encoding="utf-8").splitlines()
    return [json.loads(line)["reason"] for line in lines]


def test_a_source_of_an_unknown_edition_is_quarantined_with_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A sixth of its blocks fit by chance, with latitudes to 1 765°."""
    whole = b"".join(old + plot for old, plot in zip(OLD, PLOTS, strict=True))
    out = converted(tmp_path, whole, status=EXIT_FAILED)
    said = capsys.readouterr().err.splitlines()
    assert [line for line in said if "compiling kernels" not in line] == [f"multiradar: {WHY}"]
    assert pl.read_parquet(out / "measurements.parquet").height == 100
    assert not (out / "system_tracks.parquet").exists()
    assert reasons(out) == [WHY] * 100
    document = report(out)
    assert document["counts"] == {
        "read": 200, "accepted": 100, "rejected": 100, "duplicate": 0, "blank": 0
    }  # fmt: skip
    assert document["figures"]["unknown_editions"] == [{"blocks": 100, "reason": WHY}]
    assert document["figures"]["editions"] == {"048": {"20-130": "1.32"}}
    octets = document["figures"]["bytes"]["recording"]
    assert octets["quarantined"] == sum(map(len, OLD))
    assert octets["decoded"] + octets["quarantined"] == len(whole)


@pytest.mark.parametrize("enveloped", [False, True])
def test_a_recording_of_an_unknown_edition_alone_ends_with_the_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], *, enveloped: bool
) -> None:
    """Without framing, too: the blocks of a source confirm the lengths of each other."""
    blocks = [(28_800.0 + k, one) for k, one in enumerate(OLD)]
    whole = final_format(blocks) if enveloped else b"".join(OLD)
    out = converted(tmp_path, whole, status=EXIT_FAILED)
    assert WHY in capsys.readouterr().err
    assert not out.exists()


def test_a_selected_edition_is_used_whether_it_fits_or_not(tmp_path: Path) -> None:
    out = converted(tmp_path, b"".join(OLD), "--edition", "062=1.21", status=EXIT_FAILED)
    said = report(out)
    assert said["figures"]["unknown_editions"] == []
    assert said["figures"]["records"]["062"] == 16
    assert "impossible position" in " ".join(reasons(out))


def test_some_damaged_blocks_do_not_condemn_their_source(tmp_path: Path) -> None:
    bad = block(48, record((1, "1482"), (2, "000001"), (7, "80")))
    out = converted(tmp_path, b"".join(PLOTS[:51]) + bad * 50, status=EXIT_FAILED)
    assert pl.read_parquet(out / "measurements.parquet").height == 51
    assert report(out)["figures"]["unknown_editions"] == []


def system_track(*changed: tuple[int, str]) -> bytes:
    """Write a system track, some items replaced by others."""
    items = {
        1: "14fa",
        4: time_of_day(28_800.0),
        5: "00800000 00100000",
        7: "0190 0000",
        12: "0007",
        13: "00",
        17: "0578",
    }
    return record(*sorted((items | dict(changed)).items()))


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ((5, "01000001 00000000"), "an impossible position"),
        ((5, "00000000 fdffffff"), "an impossible position"),
        ((4, "a8c000"), "a time of day of 24 h or more"),
        ((17, "7fff"), "an impossible height: below -1500 m or above 45720 m"),
        ((17, "8000"), "an impossible height: below -1500 m or above 45720 m"),
        ((7, "7fff 0000"), "an impossible speed: above 2000 m/s"),
    ],
)
def test_a_system_track_with_an_impossible_value_is_rejected(
    tmp_path: Path, changed: tuple[int, str], reason: str
) -> None:
    whole = block(62, system_track(), system_track(changed, (12, "0008")))
    out = converted(tmp_path, whole, status=EXIT_DONE)
    assert pl.read_parquet(out / "system_tracks.parquet")["track_number"].to_list() == [7]
    assert reasons(out) == [reason]
    counts = report(out)["counts"]
    assert (counts["read"], counts["accepted"], counts["rejected"]) == (2, 1, 1)


def test_the_bounds_themselves_are_possible(tmp_path: Path) -> None:
    whole = block(62, system_track((5, "01000000 fe000000"), (4, "a8bfff")))
    out = converted(tmp_path, whole, status=EXIT_DONE)
    (row,) = pl.read_parquet(out / "system_tracks.parquet").to_dicts()
    assert (row["latitude_deg"], row["longitude_deg"]) == (90.0, -180.0)
    assert reasons(out) == []


def test_an_impossible_height_is_omitted_from_a_measurement(tmp_path: Path) -> None:
    """Its position is as good: the geometric height is an item that senders fill in at will."""
    items = [(1, "14c9"), (2, "41 00"), (3, time_of_day(1.0)), (4, "00200000 00100000")]
    out = converted(tmp_path, block(20, record(*items, (15, "7fff"))), status=EXIT_DONE)
    assert pl.read_parquet(out / "measurements.parquet")["height_m"].to_list() == [None]
    assert reasons(out) == []
