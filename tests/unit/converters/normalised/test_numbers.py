"""Numbers of large JSON messages are those that Python reads, to the last bit."""

import json
import random
from collections.abc import Callable

import numpy as np
import pytest

from multiradar_converters.normalised import _number_kernels as kernels
from multiradar_converters.normalised import json_columns
from support.inputs.messages import array, radar

#: Bits of the fraction of a double, and the hidden one.
BITS = 53
POWERS = kernels.powers_of_five()


def shortest(drawn: random.Random) -> str:
    return repr(drawn.uniform(-180.0, 180.0))


def of_any_size(drawn: random.Random) -> str:
    return repr(drawn.uniform(-10.0, 10.0) * 10.0 ** drawn.randrange(-300, 10))


def of_19_digits(drawn: random.Random) -> str:
    return f"0.000{drawn.randrange(10**18, 10**19)}"


def with_exponent(drawn: random.Random) -> str:
    exponent = drawn.choice(["e", "E", "e+", "E-"]) + f"{drawn.randrange(12):02}"
    return f"-{drawn.getrandbits(drawn.randrange(1, 36))}{exponent}"


def halfway(drawn: random.Random) -> str:
    """A number halfway between two others, in one of its forms."""
    number = 2 * drawn.getrandbits(BITS - 1) + (1 << BITS) + 1
    power = drawn.randrange(4)
    digits = str(number * 10**power)
    return f"{digits}e-{power}" if drawn.random() < 0.5 else f"{number}.{'0' * (power + 1)}"


@pytest.mark.parametrize(
    "form", [shortest, of_any_size, of_19_digits, with_exponent], ids=lambda one: one.__name__
)
def test_a_number_is_read_to_the_last_bit(form: Callable[[random.Random], str]) -> None:
    drawn = random.Random(1)
    # As a height, out of range numbers would be rejected.
    texts = [one for one in (form(drawn) for _ in range(4000)) if -1000.0 <= float(one) <= 40_000.0]
    texts += ["0", "-0", "-0.0", "0e9", "1.0", "-0.00001e5", "4e4", "40000." + "0" * 30]
    rows = [json.dumps(radar(height_m=None)).replace("null", one) for one in texts]
    parsed = json_columns.parse_array(b"[%s]" % ",".join(rows).encode(), 10_000, 10_000)
    assert parsed is not None
    expected = np.array([float(one) for one in texts])
    assert (parsed.frame["height_m"].to_numpy().view(np.int64) == expected.view(np.int64)).all()


def bits_of(number: str) -> tuple[bool, int]:
    """Return whether the loop can read a number, and the bits of what it reads."""
    octets = np.frombuffer(number.encode(), np.uint8)
    end, negative, digits, exponent, _, further = kernels.scan_number(octets, 0, len(octets))
    assert end == len(octets)
    good, bits = kernels.number_bits(negative, np.uint64(digits), exponent, further, POWERS)
    return bool(good), int(bits)


def test_halfway_numbers_are_rounded_to_the_even_one() -> None:
    # No field has numbers as large as these, of which 19 digits are halfway.
    drawn = random.Random(2)
    for number in (halfway(drawn) for _ in range(4000)):
        assert bits_of(number) == (True, int(np.float64(number).view(np.uint64)))


def test_numbers_of_any_size_are_read_to_the_last_bit_or_not_at_all() -> None:
    drawn = random.Random(3)
    for _ in range(4000):
        number = f"-{drawn.getrandbits(63)}e{drawn.randrange(-342, 300)}"
        good, bits = bits_of(number)
        expected = np.float64(number)
        assert good == (np.finfo(np.float64).tiny <= -expected < np.inf)
        if good:
            assert bits == int(expected.view(np.uint64))


@pytest.mark.parametrize(
    "number",
    ["01", "-", "1.", ".5", "+1", "1e", "1e+", "1e5.0", "--1", "0x1", "1_0", "nan", "Infinity",
     "1e400", "1e-400", "1e12345", "1,5", "true", '"5"', "{}", "[]", "nul", "1 2", "1.5f"],
)  # fmt: skip
def test_what_is_no_number_here_is_read_row_by_row(number: str) -> None:
    rows = [json.dumps(radar(height_m=None)).replace("null", one) for one in ["5"] * 250 + [number]]
    body = b"[%s]" % ",".join(rows).encode()
    assert json_columns.parse_array(body, 1000, 10_000) is None


def test_integers_have_at_most_63_bits_and_no_fraction() -> None:
    def read(number: str) -> object:
        row = json.dumps(radar(track_number=None)).replace("null", number)
        body = b"[%s]" % b",".join([row.encode()] * 250)
        parsed = json_columns.parse_array(body, 1000, 10_000)
        return None if parsed is None else parsed.frame["track_number"][249]

    assert read(str(2**63 - 1)) == 2**63 - 1
    assert read("0") == read("-0") == 0
    for number in (str(2**63), str(2**64 + 1), "1.0", "1e1", "-1", "12345678901234567890123"):
        assert read(number) is None


def test_numbers_of_20_digits_and_more_are_read_where_the_others_do_not_matter() -> None:
    rows = [radar() for _ in range(250)]
    body = array(*rows).replace(b"271.25", b"271.25000000000000000001")
    parsed = json_columns.parse_array(body, 1000, 10_000)
    assert parsed is not None
    assert parsed.frame["azimuth_deg"].to_list() == [271.25] * 250
