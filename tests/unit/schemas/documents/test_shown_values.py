"""Invalid values in messages are short and printable."""

import pytest

from multiradar_schemas.documents.names import SHOWN_LENGTH_MAX, shown


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "null"),
        (True, "true"),
        (False, "false"),
        ("é", r"'\xe9'"),
        ("a" * 58, f"'{'a' * 58}'"),
        ("a" * 59, f"'{'a' * 59}…"),
    ],
)
def test_a_value_is_shown_up_to_the_limit(value: object, text: str) -> None:
    assert SHOWN_LENGTH_MAX == 60
    assert shown(value) == text


def test_a_number_of_thousands_of_digits_is_not_repeated() -> None:
    assert shown(10**5000) == "a int too large to print"
