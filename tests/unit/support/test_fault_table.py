"""The table of faults in the documents: each row has tests that exist, and those it simulates."""

import re

from support.paths import ROOT
from support.simulation.faults import ELSEWHERE, FAULTS

_ROW = re.compile(r"\| ([0-9]+) \| [^|]+ \| ([^|]+) \| [^|]+ \|")
ROWS = 42


def test_each_row_of_the_fault_model_has_tests_that_exist() -> None:
    text = (ROOT / "docs/validation/faults.md").read_text(encoding="utf-8")
    found = {int(number): tests for number, tests in _ROW.findall(text)}
    assert list(found) == list(range(1, ROWS + 1))
    for number, tests in found.items():
        files = re.findall(r"`([^`]+)`", tests)
        assert files, number
        assert [one for one in files if not (ROOT / one).is_file()] == [], number


def test_the_simulator_has_all_rows_but_those_tested_elsewhere() -> None:
    simulated = {fault.row for fault in FAULTS}
    assert simulated | set(ELSEWHERE) == set(range(1, ROWS + 1))
    assert not simulated & set(ELSEWHERE)
    assert all((ROOT / one).is_file() for one in ELSEWHERE.values())
