"""Conversion of trajectories beside reading alone: `cd tests && python -m benchmark.trajectories`.

A million reports of a thousand aircraft, in nine columns, are written as CSV, JSON lines and a JSON
list packed by gzip. Results are rows per second of process time, the best of several runs: the
whole conversion (checked, sorted by time, written), and polars only reading the same file.
"""

import argparse
import gzip
import io
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import process_time

import numpy as np
import polars as pl

from multiradar_converters.adsb.conversion import convert
from multiradar_converters.adsb.options import Options

AIRCRAFT = 1000
RUNS = 3
BEGIN_MS = 1_533_110_400_000


def reports(rows: int) -> pl.DataFrame:
    """Make reports, one aircraft after the other, each flying straight."""
    generator = np.random.Generator(np.random.PCG64(1))
    each = rows // AIRCRAFT
    aircraft = np.repeat(np.arange(AIRCRAFT), each)
    second = np.tile(np.arange(each), AIRCRAFT)
    course = generator.uniform(0.0, 2.0 * np.pi, AIRCRAFT)[aircraft]
    begin = generator.uniform(-1.0, 1.0, (2, AIRCRAFT))[:, aircraft]
    return pl.DataFrame(
        {
            "timestamp": BEGIN_MS + 1000 * second,
            "icao24": [f"{0x3C0000 + one:06x}" for one in aircraft.tolist()],
            "latitude": np.round(47.0 + begin[0] + 0.002 * second * np.cos(course) % 1.0, 10),
            "longitude": np.round(8.0 + begin[1] + 0.002 * second * np.sin(course) % 1.0, 10),
            "altitude": np.round(generator.uniform(0.0, 40_000.0, len(second)), 0),
            "groundspeed": np.round(generator.uniform(300.0, 500.0, len(second)), 10),
            "track": np.round(np.degrees(course), 10),
            "vertical_rate": 0.0,
            "callsign": [f"ABC{one}" for one in aircraft.tolist()],
        }
    )


def rows_per_s(work: Callable[[], object], rows: int) -> float:
    best = float("inf")
    for _ in range(RUNS):
        begin = process_time()
        work()
        best = min(best, process_time() - begin)
    return rows / best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=1_000_000)
    rows = parser.parse_args().rows // AIRCRAFT * AIRCRAFT
    table = reports(rows)
    readers: dict[str, Callable[[Path], object]] = {
        "reports.csv": pl.read_csv,
        "reports.ndjson": pl.read_ndjson,
        "reports.json.gz": lambda path: pl.read_json(
            io.BytesIO(gzip.decompress(path.read_bytes()))
        ),
    }
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        table.write_csv(folder / "reports.csv")
        table.write_ndjson(folder / "reports.ndjson")
        listed = table.write_json().encode()
        (folder / "reports.json.gz").write_bytes(gzip.compress(listed, 6))
        run = 0

        def converted(path: Path) -> None:
            nonlocal run
            run += 1
            convert([path], folder / f"out-{run}", Options(), lambda _: None)

        for name, read in readers.items():
            path = folder / name
            ours = rows_per_s(lambda path=path: converted(path), rows)  # type: ignore[misc]
            theirs = rows_per_s(lambda path=path, read=read: read(path), rows)  # type: ignore[misc]
            print(f"{name:16} converted {ours:10,.0f} rows/s   polars reads {theirs:10,.0f} rows/s")


if __name__ == "__main__":
    main()
