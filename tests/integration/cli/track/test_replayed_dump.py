"""`replay` of a dump accounts for the lines that its conversion rejects."""

from pathlib import Path

from support.paths import SAMPLE
from support.processes.commands import run_command
from support.processes.served import Served

LINES = 1500


def _dump(folder: Path) -> Path:
    folder.mkdir()
    for name in ("tracks.txt", "plots.txt", "plots_ads.txt"):
        lines = (SAMPLE / name).read_text(encoding="utf-8").splitlines()[:LINES]
        if name == "plots.txt":
            lines[1::2] = [line.replace("\t", " ") for line in lines[1::2]]
        (folder / name).write_text("\n".join([*lines, ""]), encoding="utf-8")
    return folder


def test_rejected_lines_are_counted_and_reported(tmp_path: Path) -> None:
    dump = _dump(tmp_path / "dump")
    served = Served(SAMPLE.parent / "sensors-vid-sample.toml", tmp_path / "state")
    done = run_command(
        "replay", dump, "--to", served.url, "--speed", "max", "--kinds", "radar"
    )  # fmt: skip
    accepted = served.status()["accepted"]
    assert served.stop() == 0
    assert done.returncode == 1
    assert accepted == LINES - 1 - LINES // 2
    assert f"{accepted} accepted, {LINES // 2} rejected, 0 duplicate" in done.stdout
    assert f"rejected: {LINES // 2} WRONG_FIELD_COUNT" in done.stdout
    assert "plots.txt: 50% of its" in " ".join(done.stderr.split())
