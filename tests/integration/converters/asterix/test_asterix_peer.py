"""Every field of random records against libasterix, where it is installed (howto/asterix.md)."""

import random
from types import ModuleType

import numpy as np
import pytest

from multiradar_converters.asterix.layout import _kernels
from multiradar_converters.asterix.layout.catalogue import layouts
from multiradar_converters.asterix.layout.fields import record_fields
from multiradar_converters.asterix.layout.notation import Layout
from multiradar_converters.asterix.layout.program import program_of, walk
from support.asterix.peer import PEER_EDITIONS, differences, own_leaves, peer_records
from support.asterix.random_records import random_block

BLOCKS = 30

base = pytest.importorskip("asterix.base", reason="libasterix is not installed")


@pytest.fixture(scope="module")
def generated() -> ModuleType:
    module: ModuleType = pytest.importorskip("asterix.generated")
    return module


@pytest.mark.parametrize(
    "layout",
    [layout for layout in layouts() if layout.name in PEER_EDITIONS],
    ids=lambda layout: layout.name,
)
def test_every_field_is_read_as_libasterix_reads_it(layout: Layout, generated: ModuleType) -> None:
    generator = random.Random(layout.name)
    program = program_of(layout)
    for _ in range(BLOCKS):
        block = random_block(layout, generator)
        data = np.frombuffer(block, dtype=np.uint8)
        walked = walk(program, data, np.array([3]), np.array([len(data)]))
        assert walked.faults[0, 0] == _kernels.FITS
        own = [own_leaves(record_fields(program, data, starts)) for starts in walked.starts]
        peer = peer_records(generated, base, layout.name, block[3:])
        assert peer is not None
        found = [differences(layout.name, *pair) for pair in zip(own, peer, strict=True)]
        assert found == [[]] * len(own)
