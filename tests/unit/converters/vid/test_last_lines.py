"""Last lines without a line end: of NUL bytes, as a full disk or a power failure leaves them."""

import time

import pytest

from multiradar_converters.vid.text.lines import is_truncated

BEFORE = b"28800.191\t26\t10\t57014.6"


@pytest.mark.parametrize("octet", [b"\0", b".", b"=", b"1.", b"a=1;"])
def test_a_last_line_of_many_octets_is_read_in_proportion_to_its_length(octet: bytes) -> None:
    """Regression: 200 000 NUL bytes took minutes."""
    start_s = time.process_time()
    is_truncated(b"28800.2\t26\t" + octet * 20_000, BEFORE)
    assert time.process_time() - start_s < 0.5


@pytest.mark.parametrize(
    ("line", "before", "truncated"),
    [
        (b"28800.2\t26\t10\t57014.", BEFORE, True),
        (b"28800.2\t26\t10\t57014.5", BEFORE, False),
        (b"28800.2\t26\t10\t57", BEFORE, True),
        (b"time=1;code=12", b"time=1;code=1234;h=5", True),
        (b"time=1 code=1234 h=5", b"time=1;code=1234;h=5", False),
        (b"time=1 h=5", b"time=1 code=1234", True),
        (b"a=b=1", b"a=b=2", False),
    ],
)
def test_a_field_that_is_cut_is_found(line: bytes, before: bytes, *, truncated: bool) -> None:
    assert is_truncated(line, before) == truncated
