"""Lines that are too long, as they come in blocks."""

from multiradar_converters.adsb.reading.splitting import RECORD_BYTES_MAX, Lines
from multiradar_schemas.reject import RejectCode


def test_a_line_that_is_too_long_for_several_blocks_is_one_fault() -> None:
    lines = Lines()
    assert lines.push(b"x" * (RECORD_BYTES_MAX + 1)) == []
    assert lines.push(b"y" * 10) == []
    (piece,) = lines.push(b"z\nnext\n")
    assert [(fault.place, fault.code) for fault in piece.faults] == [(1, RejectCode.TOO_LARGE)]
    assert [(int(piece.places[0]), piece.raw(0))] == [(2, b"next")]


def test_a_line_of_just_the_bound_is_read() -> None:
    lines = Lines()
    assert lines.push(b"x" * RECORD_BYTES_MAX) == []
    (piece,) = lines.push(b"\n")
    assert piece.faults == []
    assert piece.raw(0) == b"x" * RECORD_BYTES_MAX
