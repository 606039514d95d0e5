"""Written records are read back unchanged, for any values of their fields."""

import numpy as np
import pytest

from multiradar_converters.asterix.layout._kernels import COMPOUND, EXTENDED, FIXED, PART
from multiradar_converters.asterix.layout.catalogue import layout_of
from multiradar_converters.asterix.layout.columns import Columns
from multiradar_converters.asterix.layout.notation import Field
from multiradar_converters.asterix.layout.program import program_of, walk
from multiradar_converters.asterix.writing import _writing_kernels
from multiradar_converters.asterix.writing.encoding import Records, Written, blocks, raw_of
from support.kernels import plain

LAYOUTS = [(62, "1.21"), (63, "1.7"), (65, "1.6"), (48, "1.32"), (34, "1.29")]
COUNT = 40


def filled(category: int, edition: str, random: np.random.Generator) -> tuple[Records, dict]:  # type: ignore[type-arg]
    """Records with random bits in every writable field, and their values."""
    layout = layout_of(category, edition)
    program = program_of(layout)
    records = Records(layout, COUNT)
    kinds = {path: program.nodes[number, 0] for path, number in program.places.items()}
    writable = (EXTENDED, FIXED, PART)
    said = {}
    for node in sorted({node for node, _ in program.fields}):
        whole, _, sub = node.partition("/")
        if kinds[node] not in writable or (sub and kinds[whole] != COMPOUND):
            continue
        where = random.random(COUNT) < 0.5
        fields = {}
        for (of, name), described in program.fields.items():
            if of == node and described.bits <= 62:
                fields[name] = random.integers(0, 1 << described.bits, COUNT)
        records.put(node, fields, where)
        said[node] = where, fields
    # A record without any item is none.
    records.put("010", {"SAC": 1, "SIC": 2})
    return records, said


@pytest.mark.parametrize(("category", "edition"), LAYOUTS)
def test_every_field_is_read_as_it_was_written(category: int, edition: str) -> None:
    records, said = filled(category, edition, np.random.default_rng(category))
    written = records.written()
    program = program_of(layout_of(category, edition))
    walked = walk(program, written.data, np.array([0]), np.array([len(written.data)]))
    assert not walked.faults[0, 0]
    assert walked.records[:, 2].tolist() == written.ends.tolist()
    columns = Columns(walked, written.data)
    compared = 0
    for node, (where, fields) in said.items():
        present = columns.present(node)
        if node != "010":
            # A part is there, too, where one after it is.
            assert (present >= where).all()
            assert "+" in node or f"{node}+1" in said or (present == where).all()
        for name, values in fields.items():
            described = program.fields[node, name]
            raw = columns.integers(node, name, absent=0)[where]
            mask = (1 << described.bits) - 1
            if node != "010":
                assert (raw & mask).tolist() == values[where].tolist(), (node, name)
                compared += int(where.sum())
    assert compared > 10 * COUNT or category == 65


def test_the_compiled_loop_does_what_the_plain_one_does() -> None:
    # The loop alone: what it calls is compiled in both cases.
    records, _ = filled(62, "1.21", np.random.default_rng(3))
    compiled = records.written()
    original = _writing_kernels.write_records
    try:
        _writing_kernels.write_records = plain(original)
        slow = records.written()
    finally:
        _writing_kernels.write_records = original
    assert slow.data.tobytes() == compiled.data.tobytes()
    assert slow.ends.tolist() == compiled.ends.tolist()


def test_a_number_is_written_as_the_nearest_there_is() -> None:
    signed = Field("", 0, 16, "signed", 1, 4)
    raw, fits = raw_of(signed, np.array([0.12, 0.13, -8192.0, 8191.75, 8191.9, -8192.2, 1e300]))
    assert raw.tolist() == [0, 1, -32768, 32767, 32767, -32768, 32767]
    assert fits.tolist() == [True, True, True, True, False, False, False]
    unsigned = Field("", 0, 8, "unsigned", 1, 4)
    raw, fits = raw_of(unsigned, np.array([-0.1, -0.2, 63.8, 64.0]))
    assert (raw.tolist(), fits.tolist()) == ([0, 0, 255, 255], [True, False, True, False])


def test_what_an_item_cannot_hold_is_left_out_and_counted_or_is_the_largest() -> None:
    records = Records(layout_of(62, "1.21"), 3)
    records.put("040", np.arange(3))
    records.measure("185", {"VX": [1.0, 9000.0, np.nan], "VY": 0.0})
    records.measure("290/TRK", [1.0, 100.0, np.nan], clamped=True)
    written = records.written()
    walked = walk(
        program_of(records.layout), written.data, np.array([0]), np.array([len(written.data)])
    )
    columns = Columns(walked, written.data)
    assert columns.present("185").tolist() == [True, False, False]
    assert columns.numbers("290/TRK")[:2].tolist() == [1.0, 63.75]
    assert columns.present("290").tolist() == [True, True, False]
    # What there is none of is not left out for its size.
    assert records.left_out == {"185": 1}


def test_blocks_have_whole_records_and_at_most_the_maximum_size() -> None:
    ends = np.cumsum([100, 200, 97, 500, 10, 10])
    data = np.arange(ends[-1], dtype=np.int64).astype(np.uint8)
    cut = blocks(62, Written(data, ends), octets_max=400)
    assert [len(block) for block in cut] == [400, 503, 23]
    assert b"".join(block[3:] for block in cut) == data.tobytes()
    assert all(block[0] == 62 and block[1] << 8 | block[2] == len(block) for block in cut)
    assert blocks(62, Written(data[:0], ends[:0])) == []


def test_an_unknown_item_is_reported() -> None:
    with pytest.raises(KeyError):
        Records(layout_of(62, "1.21"), 1).put("041", 1)
    with pytest.raises(KeyError):
        Records(layout_of(62, "1.21"), 1).put("040", {"NUMBER": 1})
