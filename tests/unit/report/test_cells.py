"""Numbers of tables are short, and columns of numbers stand to the right."""

import pytest

from multiradar.report.cells import (
    cell_text,
    number_text,
    numeric_columns,
    table_texts,
)
from multiradar.report.content import Table, Value


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (0.0, "0"),
        (0.0895, "0.0895"),
        (0.1, "0.100"),
        (9.999, "10.0"),
        (73.82, "73.8"),
        (99.96, "100"),
        (1234.5, "1234"),
        (-0.25, "-0.250"),
        (2.13e-9, "2.1e-9"),
        (3.2e8, "3.2e8"),
        (float("nan"), "–"),
        (float("inf"), "–"),
    ],
)
def test_a_number_has_three_digits_that_mean_something(number: float, text: str) -> None:
    assert number_text(number) == text


@pytest.mark.parametrize(
    ("value", "text"), [(None, "–"), (True, "yes"), (False, "no"), (20, "20"), ("1.50", "1.50")]
)
def test_what_is_no_float_is_shown_as_it_is(value: Value, text: str) -> None:
    assert cell_text(value) == text


def test_a_column_of_numbers_is_known_by_all_its_cells() -> None:
    rows: tuple[tuple[Value, ...], ...] = (
        ("two-stage", 1.0, None, "0.5 … 1.5", "2-stage", True),
        ("ci", "12.5", None, "±3", "7", False),
    )
    table = Table("t", tuple("abcdef"), rows)
    assert numeric_columns(table) == (False, True, False, True, False, False)


def test_values_that_were_chosen_are_shown_as_short_as_they_are() -> None:
    rows: tuple[tuple[Value, ...], ...] = (
        (2.0, 0.1, 2.0, "2.00"),
        (10.0, 1.0, 2.1234, None),
        (None, 0.025, 100.0, 0.5),
    )
    assert table_texts(Table("t", tuple("abcd"), rows)) == [
        ["2", "0.1", "2.00", "2.00"],
        ["10", "1", "2.12", "–"],
        ["–", "0.025", "100", "0.5"],
    ]
