"""ASTERIX decoding against other decoders: `cd tests && python -m benchmark.asterix`.

The blocks are random records of categories 001, 021, 048 and 062 with the items that such records
mostly have, three a block; or those of a recording (`--recording FILE`). Results are records per
second of process time on one core, the best of several runs: decoding to columns, the whole
conversion, and the same blocks as datagrams that come in, from the queue to what is handed to the
journal, in batches as large as a quarter of a second brings at 20 000 records/s, and others,
with the ratio to the decoding of a recording; and the cost to send and receive them. Where an
interpreter that has them is named, libasterix and asterix_decoder are measured too. These two
install packages of one name, so each needs an environment of its own::

    python -m benchmark.asterix --libasterix PYTHON --asterix-decoder PYTHON
"""

import argparse
import random
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path
from time import process_time, sleep

import numpy as np
import polars as pl

from multiradar.ingest.asterix_counts import AsterixCounts
from multiradar.ingest.asterix_gateway import AsterixGateway
from multiradar.ingest.asterix_inlet import AsterixInlet, InletBounds
from multiradar.ingest.asterix_queue import DatagramQueue, Received
from multiradar.ingest.asterix_source import UdpSource
from multiradar.ingest.replay.datagrams import UdpSink
from multiradar.runtime.live.receipt import Receipt, RejectedRow
from multiradar_converters.asterix.conversion import convert
from multiradar_converters.asterix.decoding.editions import Editions, sources_of
from multiradar_converters.asterix.decoding.gathering import gather
from multiradar_converters.asterix.decoding.timing import KINDS
from multiradar_converters.asterix.framing.containers import read_blocks
from multiradar_converters.asterix.live.reception import LiveDecoder, LiveOptions
from multiradar_converters.asterix.options import Options
from support.asterix.octets import block, plot_001, plot_048, record, time_of_day

BLOCKS = 40_000
RECORDS_OF_BLOCK = 3
RUNS = 3
#: Datagrams per batch: 1667 arrive in a quarter of a second at 20 000 records/s.
LIVE_BATCHES = (100, 1667, 8000)
DATAGRAMS_PER_S = 20_000 / RECORDS_OF_BLOCK
RECEIVED, WAITS_MAX = 5000, 500
RECEIVED_S = 1_700_006_000.0

LIBASTERIX = """
import sys
from time import process_time, sleep
from asterix import base, generated
data = open(sys.argv[1], "rb").read()
layouts = {1: "Cat_001_1_4", 2: "Cat_002_1_2", 21: "Cat_021_2_7", 48: "Cat_048_1_32",
    62: "Cat_062_1_21", 34: "Cat_034_1_29", 20: "Cat_020_1_11", 19: "Cat_019_1_3", 8: "Cat_008_1_3"}
uaps = {category: getattr(generated, name).cv_uap for category, name in layouts.items()}
start, records, at = process_time(), 0, 0
while at < len(data):
    uap, end = uaps.get(data[at]), at + int.from_bytes(data[at + 1:at + 3], "big")
    bits, at = base.Bits.from_bytes(data[at + 3:end]), end
    if uap is None:
        continue
    parsed = uap.parse("plot", bits) if issubclass(uap, base.UapMultiple) else uap.parse(bits)
    records += 0 if isinstance(parsed, ValueError) else len(parsed)
print(records / (process_time() - start))
"""

ASTERIX_DECODER = """
import sys
from time import process_time, sleep
import asterix
data = open(sys.argv[1], "rb").read()
start = process_time()
print(len(asterix.parse(data, verbose=False)) / (process_time() - start))
"""


def blocks(generator: random.Random, count: int) -> bytes:
    """Write blocks of the four categories, in turn."""
    makers: tuple[tuple[int, Callable[[random.Random], bytes]], ...] = (
        (48, _plot),
        (1, lambda one: plot_001(one.uniform(0.0, 512.0), azimuth_deg=one.uniform(0.0, 359.0))),
        (21, _report),
        (62, _track),
    )
    return b"".join(
        block(category, *(maker(generator) for _ in range(RECORDS_OF_BLOCK)))
        for category, maker in (makers[k % len(makers)] for k in range(count))
    )


def _plot(generator: random.Random) -> bytes:
    return plot_048(
        generator.uniform(0.0, 86_000.0),
        range_nm=generator.uniform(1.0, 200.0),
        azimuth_deg=generator.uniform(0.0, 359.0),
    )


def _report(generator: random.Random) -> bytes:
    return record(
        (1, "0003"),
        (2, "01 00"),
        (6, f"21{generator.randrange(1 << 16):04x} 08{generator.randrange(1 << 16):04x}"),
        (11, f"{generator.randrange(1 << 24):06x}"),
        (12, time_of_day(generator.uniform(0.0, 86_000.0))),
        (16, "15b8"),
        (17, "06"),
        (18, "02"),
        (21, "0578"),
        (29, "10c1b1cb3220"),
    )


def _track(generator: random.Random) -> bytes:
    return record(
        (1, "0004"),
        (3, "e1"),
        (4, time_of_day(generator.uniform(0.0, 86_000.0))),
        (5, f"0081{generator.randrange(1 << 16):04x} 0031{generator.randrange(1 << 16):04x}"),
        (6, "07f46a f943b1"),
        (7, "033e fe1e"),
        (9, "0f91"),
        (11, "c1 20 4b18f3 204271e311e0 00fd"),
        (12, f"{generator.randrange(1 << 16):04x}"),
        (13, "0d 13 01 48"),
        (14, "40 08"),
        (15, "00"),
        (17, "0577"),
        (19, "0577"),
        (20, "0000"),
    )


class Discarding:
    """A service that accepts everything immediately."""

    def __init__(self) -> None:
        self.rows = 0

    def submit(
        self,
        frame: pl.DataFrame,
        *,
        source: str,
        idempotency_key: str | None = None,
        rejected: Sequence[RejectedRow] = (),
    ) -> Future[Receipt]:
        self.rows += len(frame)
        future: Future[Receipt] = Future()
        future.set_result(Receipt(len(frame), (), False, 1))
        return future

    def flush(self, *, source: str, idempotency_key: str | None = None) -> Future[Receipt]:
        return self.submit(pl.DataFrame(), source=source)


def live(path: Path, batch: int) -> tuple[float, int]:
    """Return records decoded per second as datagrams, in batches of this size, and measurements."""
    cut = read_blocks(path)
    sources = np.unique(sources_of(cut)).tolist()
    names = {(source, kind): str(source) for source in sources for kind in KINDS}
    ends = zip(cut.begins.tolist(), cut.ends.tolist(), strict=True)
    sent = [cut.data[begin:end].tobytes() for begin, end in ends]
    sink, queue = Discarding(), DatagramQueue(batch, 1 << 30)
    counts = AsterixCounts(["all"])
    decoder = LiveDecoder(LiveOptions(names, behind_max_s=82_800.0))
    inlet = AsterixInlet(queue, decoder, sink, counts, InletBounds())
    start = process_time()
    for first in range(0, len(sent), batch):
        for place, octets in enumerate(sent[first : first + batch], first):
            queue.put(Received(0, place + 1, RECEIVED_S + place / DATAGRAMS_PER_S, octets))
        inlet.drain()
    passed = process_time() - start
    records = sum(counts.document()["records_by_category"].values())
    return records / passed, sink.rows


def receiving(octets: bytes) -> float:
    """Return the datagrams per second sent to and received on a loopback port."""
    sink, queue = Discarding(), DatagramQueue(RECEIVED, 1 << 30)
    ports: list[UdpSource] = []

    def open_port() -> UdpSource:
        ports.append(UdpSource("127.0.0.1", 0, "127.0.0.1", 1 << 22))
        return ports[-1]

    gateway = AsterixGateway(
        labels=["all"],
        sources=[open_port],
        sink=sink,
        decoder=LiveDecoder(LiveOptions({})),
        queue=queue,
        bounds=InletBounds(batch_interval_s=60.0),
    )
    gateway.start()
    port = int(ports[0].endpoint.rpartition(":")[2])
    out = UdpSink("127.0.0.1", port, "127.0.0.1")
    start = process_time()
    for _ in range(RECEIVED):
        out.send(octets)
    for _ in range(WAITS_MAX):
        if len(queue) == RECEIVED:
            break
        sleep(0.01)
    rate = len(queue) / (process_time() - start)
    gateway.stop()
    out.close()
    return rate


def measure_live(path: Path, decoding: float) -> None:
    """Print the cost of datagrams against the decoding of a recording."""
    octets = blocks(random.Random(2), 1)
    rate = max(receiving(octets) for _ in range(RUNS))
    print(f"sent and received over loopback: {rate:,.0f} datagrams/s of {len(octets)} octets")
    for batch in LIVE_BATCHES:
        runs = [live(path, batch) for _ in range(RUNS)]
        best = max(rate for rate, _ in runs)
        print(
            f"live, {batch} datagrams at once: {best:,.0f} records/s, {best / decoding:.2f} of the "
            f"decoding of a recording ({runs[0][1]} measurements)"
        )


def measure(path: Path, folder: Path) -> float:
    """Print the figures of multiradar; return records decoded per second."""
    best = {"decoding": 0.0, "conversion": 0.0}
    records = 0
    for run in range(RUNS + 1):
        start = process_time()
        records = sum(gather(read_blocks(path), Editions()).records.values())
        decoded = process_time()
        convert([path], folder / f"out-{run}", Options(), lambda read: None)
        done = process_time()
        # The first run compiles.
        if run:
            best["decoding"] = max(best["decoding"], records / (decoded - start))
            best["conversion"] = max(best["conversion"], records / (done - decoded))
    for what, rate in best.items():
        print(f"{what}: {rate:,.0f} records/s ({records} records)")
    return best["decoding"]


def peer(name: str, python: str | None, program: str, path: Path) -> None:
    """Print the figure of another decoder."""
    if python is None:
        return
    rates = [
        float(
            subprocess.run(
                [python, "-I", "-c", program, str(path)], capture_output=True, text=True, check=True
            ).stdout
        )
        for _ in range(2)
    ]
    print(f"{name}: {max(rates):,.0f} records/s")


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description="ASTERIX decoding beside other decoders")
    parser.add_argument("--libasterix", metavar="PYTHON", help="an interpreter that has it")
    parser.add_argument("--asterix-decoder", metavar="PYTHON", help="an interpreter that has it")
    parser.add_argument("--recording", type=Path, help="a recording instead of made blocks")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = folder / "blocks.ast"
        if given.recording is None:
            path.write_bytes(blocks(random.Random(1), BLOCKS))
        else:
            cut = read_blocks(given.recording)
            ends = zip(cut.begins.tolist(), cut.ends.tolist(), strict=True)
            path.write_bytes(b"".join(cut.data[a:b].tobytes() for a, b in ends))
        measure_live(path, measure(path, folder))
        peer("libasterix", given.libasterix, LIBASTERIX, path)
        peer("asterix_decoder", given.asterix_decoder, ASTERIX_DECODER, path)


if __name__ == "__main__":
    main()
