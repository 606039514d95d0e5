"""Documents of nothing but faults: a bounded number of rejects, and all octets accounted for."""

import re
import tracemalloc

import pytest

from multiradar_converters.adsb.reading.batches import Batch
from multiradar_converters.feeds.decoder import KEPT_BYTES_MAX, FeedDecoder
from multiradar_converters.feeds.readsb import FAULTS_MAX
from multiradar_schemas.reject import RejectCode
from support.scenarios.feeds import aircraft, snapshot

COUNT = 20_000


def decoded(text: bytes) -> Batch:
    decoder = FeedDecoder()
    decoder.document(text, 0)
    return decoder.drain()


def skipped(batch: Batch) -> list[int]:
    """Return the octets that each fault states."""
    found = [re.search(r"; (\d+) octets skipped$", one.reason) for one in batch.rejected]
    return [int(one[1]) for one in found if one is not None]


@pytest.mark.parametrize(
    "piece",
    [b'"ac":[', b'"ac":[}', b'{"now":1,"ac":[{"a":', b'"ac":[1,', b'{"ac":[1,2,3]}', b'"ac":[x]'],
)
def test_a_document_of_faults_ends_after_some_of_them(piece: bytes) -> None:
    """Regression: each fault of 6 octets kept 4 KiB: 240 kB took 160 MB."""
    text = piece * COUNT
    tracemalloc.start()
    batch = decoded(text)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(batch.rejected) <= 2 * FAULTS_MAX
    assert sum(len(one.raw) for one in batch.rejected) <= len(text)
    assert peak < 20 * len(text)
    last = batch.rejected[-1]
    assert f"more than {FAULTS_MAX} faults, the rest is not read" in last.reason
    # Of the rest, the beginning is retained.
    size = skipped(batch)[-1]
    assert text[last.place :].startswith(last.raw)
    assert (last.place + size, len(last.raw)) == (len(text), KEPT_BYTES_MAX)


def test_a_list_of_other_values_ends_after_some_of_them() -> None:
    """Regression: each value of an octet was an element and a reject."""
    text = b'{"now": 1, "ac": [' + b"1," * COUNT + b"1]}"
    rest = snapshot(1.0, [aircraft(1.0)])
    batch = decoded(text + rest)
    codes = [one.code for one in batch.rejected]
    assert codes == [RejectCode.WRONG_TYPE] * FAULTS_MAX + [RejectCode.MALFORMED_JSON] * 2
    of_list, of_rest = batch.rejected[-2:]
    assert f"more than {FAULTS_MAX} other values" in of_list.reason
    assert f"more than {FAULTS_MAX} faults, the rest is not read" in of_rest.reason
    assert skipped(batch) == [len(text) - of_list.place, len(rest)]


def test_only_what_is_skipped_is_retained() -> None:
    good = snapshot(20.0, [aircraft(20.0)])
    bad = b'{"now": 1, "aircraft": [{"hex": x}]}\n'
    batch = decoded(bad + good)
    (reject,) = batch.rejected
    assert reject.raw == bad[reject.place :]
    assert skipped(batch) == [len(reject.raw)]


def test_faults_between_many_aircraft_do_not_end_a_recording() -> None:
    found = [aircraft(10.0, hex=f"4ca8{k:02x}") for k in range(20)]
    damaged = snapshot(10.0, found)[:-10]
    batch = decoded(damaged * (5 * FAULTS_MAX) + snapshot(20.0, [aircraft(20.0)]))
    assert len(batch.rejected) == 5 * FAULTS_MAX
    assert batch.places[-1] > len(damaged) * 5 * FAULTS_MAX
