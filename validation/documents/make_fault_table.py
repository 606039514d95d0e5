"""Runs the tests of each row of the fault model, and puts their results into the documents.

::

    python -m validation.documents.make_fault_table
    # these rows alone
    python -m validation.documents.make_fault_table --rows 17 38

Tests are marked with the rows that they show: ``@pytest.mark.fault(7)``. The names of the faults
and what happens are those of the table in ``docs/validation/faults.md``; the columns of the tests
and of their results are made here. A test that fails ends the program, and nothing is written.
"""

import argparse
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections import Counter
from pathlib import Path

from validation.documents.fault_rows import ROOT, ROWS, TABLE, files, marked
from validation.documents.marked_parts import put

DOCS = TABLE.parents[1]
_ROW = re.compile(r"^\| ([0-9]+) \| ([^|]+) \| [^|]+ \| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)
_HEAD = "| # | fault | tests | result | last run |\n|---|---|---|---|---|\n"


def main() -> None:
    """Run the tests and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder of the documents")
    parser.add_argument("--rows", type=int, nargs="+", default=[*ROWS], help="all by default")
    options = parser.parse_args()
    page = options.docs / TABLE.relative_to(DOCS)
    texts = {
        int(number): (fault.strip(), result.strip(), run_last.strip())
        for number, fault, result, run_last in _ROW.findall(page.read_text(encoding="utf-8"))
    }
    results = run_tests(sorted({one for row in options.rows for one in marked()[row]}))
    lines = []
    for row, tests in marked().items():
        fault, result, run_last = texts[row]
        names = ", ".join(f"`{one}`" for one in files(tests))
        if row in options.rows:
            total = sum((results[one] for one in tests), Counter())
            skipped = f", {total['skipped']} skipped" if total["skipped"] else ""
            run_last = f"{total['passed']} passed{skipped}"
        lines.append(f"| {row} | {fault} | {names} | {result} | {run_last} |")
    put(page, "fault-model", _HEAD + "\n".join(lines))


def run_tests(tests: list[str]) -> dict[str, Counter[str]]:
    """Run tests; return the number of their examples that passed and that were skipped.

    Raises
    ------
    SystemExit
        A test failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "results.xml"
        line = [sys.executable, "-m", "pytest", "-q", "-n", "2", f"--junitxml={path}", *tests]
        if subprocess.run(line, cwd=ROOT, check=False).returncode:
            raise SystemExit("a test of the fault model failed")
        found: dict[str, Counter[str]] = {one: Counter() for one in tests}
        for case in ET.parse(path).getroot().iter("testcase"):
            name = case.attrib["name"].partition("[")[0]
            file = case.attrib["classname"].replace(".", "/") + ".py"
            found[f"{file}::{name}"][
                "skipped" if case.find("skipped") is not None else "passed"
            ] += 1
    return found


if __name__ == "__main__":
    main()
