"""What becomes of datagrams does not depend on how many are decoded at once."""

import datetime as dt
import itertools
import os
import random
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from multiradar_converters.asterix.conversion import convert
from multiradar_converters.asterix.framing.containers import split
from multiradar_converters.asterix.framing.datagrams import Datagrams, split_datagrams
from multiradar_converters.asterix.live.batch import LiveBatch
from multiradar_converters.asterix.live.reception import LiveDecoder, LiveOptions
from multiradar_converters.asterix.options import Options
from support.asterix.octets import block, datagram, mutated, north_mark, pcap, plot_001, plot_048

DAY_S = 86_400.0
BEGIN_S = 19_675 * DAY_S - 20.0
NAMES = {(0x1482, "radar"): "20-130", (0x1401, "radar"): "20-1"}
#: Mutated datagrams that are tried.
MUTATIONS = int(os.environ.get("TEST_ASTERIX_MUTATIONS", "3000"))


def traffic(generator: random.Random, timed: float = 0.7) -> list[tuple[float, bytes]]:
    """Forty seconds about midnight: two radars over two networks, one with truncated times.

    Of its plots a share of `timed` has one.
    """
    sent = []
    for turn in range(10):
        north = BEGIN_S + 4.0 * turn
        sent.append((north, north_mark(north % DAY_S)))
        for _ in range(5):
            time_s = north + generator.uniform(0.0, 4.0)
            azimuth = generator.uniform(0.0, 359.0)
            known = generator.random() < timed
            old = plot_001(time_s % DAY_S % 512 if known else None, azimuth_deg=azimuth)
            new = plot_048(time_s % DAY_S, source="1401", azimuth_deg=azimuth)
            for octets in (block(1, old), block(48, new, new)):
                heard = time_s + generator.uniform(0.05, 0.6)
                sent += [(heard, octets), (heard + 0.01, octets)]
    sent += [(BEGIN_S + 10.0, b"junk"), (BEGIN_S + 20.0, block(48, plot_048(1.0, source="0909")))]
    return sorted(sent, key=lambda one: one[0])


def joined(sent: list[tuple[float, bytes]]) -> Datagrams:
    lengths = np.array([len(one) for _, one in sent], dtype=np.int64)
    ends = np.cumsum(lengths)
    data = np.frombuffer(bytearray().join(one for _, one in sent), dtype=np.uint8)
    return Datagrams(data, ends - lengths, ends, np.array([when for when, _ in sent], np.float64))


def decoded(sent: list[tuple[float, bytes]], cuts: list[int]) -> list[LiveBatch]:
    one = LiveDecoder(LiveOptions(NAMES))
    places = sorted({0, len(sent), *(cut for cut in cuts if cut <= len(sent))})
    return [one.decode(joined(sent[first:last])) for first, last in itertools.pairwise(places)]


@settings(max_examples=25)
@given(seed=st.integers(0, 1000), cuts=st.lists(st.integers(0, 220), max_size=40))
def test_batches_do_not_matter(seed: int, cuts: list[int]) -> None:
    sent = traffic(random.Random(seed))
    (whole,) = decoded(sent, [])
    parts = decoded(sent, cuts)
    assert pl.concat([part.frame for part in parts]).equals(whole.frame)
    assert len(whole.frame) == 100
    for name, counts in whole.records.items():
        assert np.concatenate([part.records[name] for part in parts]).tolist() == counts.tolist()
    rejected = [(one.octets, one.code, one.reason) for part in parts for one in part.rejected]
    assert sorted(rejected) == sorted((one.octets, one.code, one.reason) for one in whole.rejected)


def test_one_by_one_is_the_same_too() -> None:
    sent = traffic(random.Random(5))
    (whole,) = decoded(sent, [])
    assert pl.concat([one.frame for one in decoded(sent, list(range(500)))]).equals(whole.frame)


def test_what_comes_live_is_what_the_recording_gives(tmp_path: Path) -> None:
    """Where times are reported nothing needs to be looked ahead for: the same measurements."""
    sent = traffic(random.Random(7), timed=1.0)
    (live,) = decoded(sent, [])
    recording = tmp_path / "recording.pcap"
    recording.write_bytes(pcap((when, datagram(octets)) for when, octets in sent))
    date = dt.datetime.fromtimestamp(BEGIN_S, dt.UTC).date()
    convert([recording], tmp_path / "out", Options(date=date), lambda _octets: None)
    table = pl.read_parquet(tmp_path / "out/measurements.parquet")
    # Empty optional columns are omitted from the file only.
    columns = [name for name in live.frame.columns if name in table.columns]
    known = table.filter(pl.col("sensor_id") != "9-9").select(columns)
    assert live.frame.select(pl.exclude(columns)).null_count().sum_horizontal().sum() == 100
    order = ["time_s", "sensor_id", "azimuth_deg"]
    assert len(live.frame) == 100
    assert known.sort(order).equals(live.frame.select(columns).sort(order))


@pytest.mark.parametrize("seed", range(3))
def test_every_octet_of_damaged_datagrams_is_accounted_for(seed: int) -> None:
    generator = random.Random(seed)
    good = [octets for _, octets in traffic(generator)]
    decoder = LiveDecoder(LiveOptions(NAMES))
    for first in range(0, MUTATIONS // 3, 500):
        sent = joined([
            (BEGIN_S + 0.001 * (first + k), mutated(generator.choice(good), generator))
            for k in range(500)
        ])  # fmt: skip
        batch = decoder.decode(sent)
        became = sum(batch.octets.values())
        assert np.asarray(became).tolist() == (sent.ends - sent.begins).tolist()
        assert len(batch.frame) == batch.records["measurement"].sum() == len(batch.datagram)
        assert not batch.frame["time_s"].is_nan().any()


def test_a_cut_datagram_does_not_reach_into_the_next() -> None:
    """The length of its block would take octets of the datagram after it along."""
    whole = block(48, plot_048(1.0), plot_048(2.0))
    cut = split_datagrams(joined([(0.0, whole[:30]), (0.0, whole)]))
    assert cut.datagram.tolist() == [1]
    assert (cut.begins.tolist(), cut.gaps.tolist()) == ([30], [[0, 30, 0]])


@pytest.mark.parametrize("seed", range(2))
def test_datagrams_are_cut_as_each_of_them_alone(seed: int) -> None:
    """The compiled loop against a call for each, for more than are noted at once."""
    generator = random.Random(seed)
    good = [octets for _, octets in traffic(generator)]
    sent = joined([
        (0.0, mutated(generator.choice(good), generator) if generator.random() < 0.5 else b"x")
        for _ in range(40_000)
    ])  # fmt: skip
    cut = split_datagrams(sent)
    blocks, gaps = [], []
    for place, (begin, end) in enumerate(
        zip(sent.begins.tolist(), sent.ends.tolist(), strict=True)
    ):
        begins, ends, holes = split(sent.data[begin:end], 0, 0)
        pairs = zip(begins.tolist(), ends.tolist(), strict=True)
        blocks += [(first + begin, last + begin, place) for first, last in pairs]
        gaps += [(at + begin, at + begin + octets, place) for at, octets, _ in holes]
    found = zip(cut.begins.tolist(), cut.ends.tolist(), cut.datagram.tolist(), strict=True)
    assert list(found) == blocks
    assert [tuple(gap) for gap in cut.gaps.tolist()] == gaps
