"""Numbers of tables are short, and columns of numbers are right-aligned."""

import pytest

from multiradar.report.cells import (
    cell_text,
    estimate_texts,
    number_text,
    numeric_columns,
    plain_text,
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
        (0.00009996, "0.000100"),
        (-0.0000123, "-0.0000123"),
        (2.13e-9, "0.00000000213"),
        (5.36e-14, "0"),
        (3.2e8, "320000000"),
        (float("nan"), "–"),
        (float("inf"), "–"),
    ],
)
def test_a_number_has_three_significant_digits(number: float, text: str) -> None:
    assert number_text(number) == text


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (0.0, "0"),
        (1.0, "1"),
        (70.0, "70"),
        (0.5400, "0.54"),
        (471.94, "471.9"),
        (9999.6, "10000"),
        (123456.7, "123457"),
        (-0.00001, "-0.00001"),
        (float("inf"), "–"),
    ],
)
def test_a_plain_number_has_no_trailing_zeros_and_no_exponent(number: float, text: str) -> None:
    assert plain_text(number, 4) == text


@pytest.mark.parametrize(
    ("estimate", "sigma", "texts"),
    [
        (184.1167, 0.71462, ("184.12", "0.71")),
        (-0.190187, 0.00076797, ("-0.19019", "0.00077")),
        (62.7928, 3.36904, ("62.8", "3.4")),
        (1234.5, 523.4, ("1234", "523")),
        (10.004, 0.0999, ("10.00", "0.10")),
        (1.5, 0.0, ("1.5", "0")),
        (1.5, float("inf"), ("1.5", "–")),
    ],
)
def test_an_estimate_ends_with_the_second_digit_of_its_sigma(
    estimate: float, sigma: float, texts: tuple[str, str]
) -> None:
    assert estimate_texts(estimate, sigma) == texts


@pytest.mark.parametrize(
    ("value", "text"), [(None, "–"), (True, "yes"), (False, "no"), (20, "20"), ("1.50", "1.50")]
)
def test_values_other_than_floats_are_unchanged(value: Value, text: str) -> None:
    assert cell_text(value) == text


def test_a_column_is_numeric_if_all_its_cells_are() -> None:
    rows: tuple[tuple[Value, ...], ...] = (
        ("two-stage", 1.0, None, "0.5 … 1.5", "2-stage", True),
        ("ci", "12.5", None, "±3", "7", False),
    )
    table = Table("t", tuple("abcdef"), rows)
    assert numeric_columns(table) == (False, True, False, True, False, False)


def test_configured_values_have_no_trailing_zeros() -> None:
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


def test_small_and_large_configured_values_have_no_exponent() -> None:
    rows: tuple[tuple[Value, ...], ...] = ((0.00002, 99_000.0), (0.003, 1.0))
    assert table_texts(Table("t", ("a", "b"), rows)) == [["0.00002", "99000"], ["0.003", "1"]]
