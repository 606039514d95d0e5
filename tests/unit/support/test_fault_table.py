"""The table of faults in the documents: each row has tests that are marked with it."""

import re

from support.paths import ROOT
from support.simulation.faults import ELSEWHERE, FAULTS
from validation.documents.fault_rows import ROWS, TABLE, files, marked

_ROW = re.compile(
    r"^\| ([0-9]+) \| [^|]+ \| ([^|]+) \| [^|]+ \| ([0-9]+) passed(?:, ([0-9]+) skipped)? \|$", re.M
)


def test_each_row_of_the_fault_model_has_tests() -> None:
    assert list(marked()) == list(ROWS)


def test_the_table_of_the_documents_is_that_of_the_marks() -> None:
    found = {
        int(number): (tuple(re.findall(r"`([^`]+)`", tests)), int(passed), int(skipped or 0))
        for number, tests, passed, skipped in _ROW.findall(TABLE.read_text(encoding="utf-8"))
    }
    assert {row: tests for row, (tests, *_) in found.items()} == {
        row: files(tests) for row, tests in marked().items()
    }, "to make it again: python -m validation.documents.make_fault_table"
    assert [row for row, (_, passed, _) in found.items() if passed == 0] == []
    assert [row for row, (_, *counts) in found.items() if sum(counts) < len(marked()[row])] == []


def test_the_first_table_names_tests_that_exist() -> None:
    names = re.findall(r"`(tests/[^`]+\.py)`", TABLE.read_text(encoding="utf-8"))
    assert len(names) > 100
    assert [one for one in names if not (ROOT / one).is_file()] == []


def test_the_simulator_has_all_rows_but_those_tested_elsewhere() -> None:
    simulated = {fault.row for fault in FAULTS}
    assert simulated | set(ELSEWHERE) == set(ROWS)
    assert not simulated & set(ELSEWHERE)
    assert all((ROOT / one).is_file() for one in ELSEWHERE.values())
