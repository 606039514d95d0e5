"""Makes the mistakes of the catalogue, in columns and of usage; prints the messages.

::

    python -m validation.mistakes.check_mistakes  # all, as a Markdown table
    # rows whose name contains this
    python -m validation.mistakes.check_mistakes --only "kilometres"
    python -m validation.mistakes.check_mistakes --json after.json  # and keep the results
    # with a column of other results
    python -m validation.mistakes.check_mistakes --before before.json
    # into the page
    python -m validation.mistakes.check_mistakes --page docs/validation/mistakes.md

Exit status 1 when a mistake ends with another status than expected by the catalogue, or without a
part of the expected message. To test another revision, put its folders into PYTHONPATH.
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

import polars as pl

from validation.mistakes.column_mistakes import COLUMN_MISTAKES
from validation.mistakes.dump_mistakes import DUMP_MISTAKES
from validation.mistakes.file_mistakes import FILE_MISTAKES
from validation.mistakes.mistake import SENSORS, Mistake, Sample
from validation.mistakes.mistakes_catalogue import CATALOGUE
from validation.mistakes.recording_mistakes import RECORDING_MISTAKES
from validation.mistakes.usage_mistakes import USAGE_MISTAKES
from validation.mistakes.value_mistakes import VALUE_MISTAKES

ALL = (
    *CATALOGUE,
    *COLUMN_MISTAKES,
    *RECORDING_MISTAKES,
    *VALUE_MISTAKES,
    *DUMP_MISTAKES,
    *FILE_MISTAKES,
    *USAGE_MISTAKES,
)
ROOT = Path(__file__).parents[2]
DUMP = ROOT / "examples" / "vid-sample"
SENSORS_FILE = ROOT / "examples" / "sensors-vid-sample.toml"
TIMEOUT_S = 600.0
_PROGRESS = "compiling kernels (first use):"
#: Lines of a page around the table.
BEGIN, END = "<!-- mistakes: begin -->", "<!-- mistakes: end -->"


def converted(folder: Path) -> Sample:
    """Return the sample recording, converted into a folder."""
    out = folder / "sample"
    run(folder, ("convert", "vid", str(DUMP), str(out), "--date", "2018-08-01"))
    measurements = pl.read_parquet(out / "measurements.parquet")
    return Sample(DUMP, measurements, SENSORS_FILE.read_text(encoding="utf-8"))


def run(folder: Path, arguments: tuple[str, ...]) -> tuple[int, str]:
    """Run `multiradar` in a folder; return its status and standard error."""
    done = subprocess.run(
        [sys.executable, "-m", "multiradar", *arguments],
        cwd=folder, capture_output=True, text=True, timeout=TIMEOUT_S, check=False,
    )  # fmt: skip
    lines = [line for line in done.stderr.splitlines() if _PROGRESS not in line]
    return done.returncode, "\n".join(lines).strip()


def tried(mistake: Mistake, sample: Sample) -> dict[str, object]:
    """Make a mistake; return its name, status, message, and whether both are as expected."""
    with tempfile.TemporaryDirectory(prefix="multiradar-mistake-") as name:
        mistake.prepare(sample, Path(name))
        status, text = run(Path(name), mistake.command)
    message = " ".join(text.split())
    missing = [words for words in mistake.message if words not in message]
    missing += [
        f"no message about {name}"
        for name in SENSORS
        if name not in mistake.sensors
        and (f"multiradar: {name}: " in message or f"multiradar: {name} (" in message)
    ]
    wrong = status != mistake.status or bool(missing) or bool(message) != bool(mistake.message)
    return {
        "name": mistake.name,
        "status": status,
        "said": text,
        "missing": missing,
        "wrong": wrong,
    }


def table(rows: list[dict[str, object]], before: Mapping[str, list[str]]) -> str:
    """Return the results as a Markdown table; `before` has cells of another revision by name."""
    head = [
        "mistake",
        *(["status before", "message before"] if before else []),
        "status",
        "message",
    ]
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for row in rows:
        cells = [str(row["name"])]
        if before:
            cells += before.get(str(row["name"]), ["", ""])
        lines.append(f"| {' | '.join([*cells, *_cells(row)])} |")
    return "\n".join(lines)


def _cells(row: dict[str, object]) -> list[str]:
    message = "<br>".join(
        line.removeprefix("multiradar: ") for line in str(row["said"]).splitlines() if line
    )
    return [str(row["status"]), message.replace("|", "\\|") or "nothing"]


def cells_before(page: Path) -> dict[str, list[str]]:
    """Return the cells of the other revision in the table of a page, by name."""
    rows = page.read_text(encoding="utf-8").partition(BEGIN)[2].partition(END)[0].splitlines()
    cells = (re.split(r" (?<!\\)\| ", row.removeprefix("| ")) for row in rows[3:])
    return {row[0]: row[1:3] for row in cells if len(row) > 3}


def into_page(page: Path, text: str) -> None:
    """Replace the table of a page."""
    before, _, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    page.write_text(f"{before}{BEGIN}\n{text}\n{END}{after}", encoding="utf-8")


def main() -> None:
    """Make the mistakes and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--only", default="", metavar="TEXT", help="Rows whose name contains this.")
    parser.add_argument("--json", type=Path, metavar="FILE", help="Keep the results here, too.")
    parser.add_argument(
        "--before",
        type=Path,
        metavar="FILE",
        help="Results of another revision; else those in the page are kept.",
    )
    parser.add_argument("--page", type=Path, metavar="FILE", help="Put the table into this page.")
    given = parser.parse_args()
    chosen = [mistake for mistake in ALL if given.only in mistake.name]
    rows = []
    with tempfile.TemporaryDirectory(prefix="multiradar-mistakes-") as name:
        sample = converted(Path(name))
        for mistake in chosen:
            rows.append(tried(mistake, sample))
            note = f"WRONG, missing {rows[-1]['missing']}" if rows[-1]["wrong"] else "as expected"
            print(f"{mistake.name}: {rows[-1]['status']}, {note}", file=sys.stderr, flush=True)
    if given.json:
        given.json.write_text(json.dumps(rows, indent=1, ensure_ascii=False), encoding="utf-8")
    before = cells_before(given.page) if given.page else {}
    if given.before:
        found = json.loads(given.before.read_text(encoding="utf-8"))
        before = {row["name"]: _cells(row) for row in found}
    text = table(rows, before)
    if given.page:
        into_page(given.page, text)
    print(text)
    sys.exit(any(row["wrong"] for row in rows))


if __name__ == "__main__":
    main()
