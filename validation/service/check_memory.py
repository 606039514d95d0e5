"""Memory of a service over hours: its slope after the plateau, with an interval.

    python -m validation.service.check_memory [--speed 10] [--minutes 45] [--plateau 20]

A service follows simulated traffic of 117 measurements per second of data time, from radars and
ADS-B. The data time runs `--speed` times as fast as the clock, so that hours of operation and ten
times the load are shown at once. Two pages read the picture, a third client the tables and metrics.

After the plateau the resident memory is averaged over twelve equal parts. The slope is that of a
line through the twelve means; its interval is two sigmas, from their distances to the line. The
memory is flat if the interval does not lie above zero. The exit status is 1 if it lies above
`--growth-max`, in MiB per hour of data, or a measurement was lost.
"""

import argparse
import http.client
import itertools
import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.clock import SystemClock
from validation.service.check_world import Fed, Service
from validation.service.traffic import processor_s
from validation.service.world_scene import BLOCK_S, START_S, World, continent

CLOCK = SystemClock()
#: Measurements per second of data time, approximately, of this number of aircraft and radars.
_AIRCRAFT, _RADARS, _ADSB_PERIOD_S = 230, 6, 2.0
_PLACE = (49.0, 10.0)
_PARTS = 12
_SAMPLE_S = 5.0
_MIB = 2.0**20
_HOUR_S = 3600.0
_READ = (
    "/v1/status", "/v1/tracks", "/v1/sensors", "/v1/residuals", "/v1/biases", "/v1/encounters",
    "/metrics",
)  # fmt: skip


def main() -> int:
    """Run and print the figures; the exit status is 1 if memory grows or measurements are lost."""
    options = _options()
    with tempfile.TemporaryDirectory(dir=options.folder) as name:
        figures = _run(options, Path(name))
    figures["evaluation"], permitted = evaluated(figures, options.speed, options.growth_max)
    print(json.dumps(figures)) if options.json else _print(figures)
    return int(figures["rejected"] > 0 or figures["unprocessed"] > 0 or not permitted)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m validation.service.check_memory")
    parser.add_argument("--speed", type=float, default=10.0, help="data time relative to the clock")
    parser.add_argument("--minutes", type=float, default=45.0, help="duration, by the clock")
    parser.add_argument("--plateau", type=float, default=20.0, help="min before the slope is taken")
    parser.add_argument(
        "--growth-max", type=float, default=5.0, help="MiB per hour of data; above it, status 1"
    )
    parser.add_argument("--folder", type=Path, help="for the journal")
    parser.add_argument("--samples", type=Path, help="CSV file for memory over time")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("serve", nargs="*", help="after --: further options of serve")
    return parser.parse_args()


def _run(options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    world = World(_AIRCRAFT, _RADARS, (continent(*_PLACE),), _ADSB_PERIOD_S)
    service = Service(folder / "service", world.sensors_text(0), options.serve)
    pages = None
    try:
        service.listen()
        pages = subprocess.Popen(
            [sys.executable, "-m", "validation.service.subscribers.world_subscribers",
             str(folder / "arrivals.npy"), "2", "picture", service.url],
            stdin=subprocess.PIPE, text=True,
        )  # fmt: skip
        return _watched(options, service, world)
    finally:
        if pages is not None:
            pages.communicate("end\n")
        service.stop()


def _watched(options: argparse.Namespace, service: Service, world: World) -> dict[str, Any]:
    fed, ended = Fed(), threading.Event()
    begin_s, used_s = CLOCK.monotonic_s(), processor_s(service.pid)
    feeder = threading.Thread(target=_feed, args=(options, service, world, fed, begin_s))
    reader = threading.Thread(target=_read, args=(service, ended))
    feeder.start()
    reader.start()
    samples = []
    while feeder.is_alive():
        samples.append((CLOCK.monotonic_s() - begin_s, service.resident() / _MIB))
        feeder.join(_SAMPLE_S)
    fed_s, used_s = CLOCK.monotonic_s() - begin_s, processor_s(service.pid) - used_s
    ended.set()
    reader.join()
    status = service.settled()
    table = np.array(samples)
    if options.samples:
        pl.DataFrame(table, ["clock_s", "memory_mib"], orient="row").write_csv(options.samples)
    return {
        "seconds": fed_s, "data_h": fed_s * options.speed / _HOUR_S, "rate": fed.accepted / fed_s,
        "accepted": fed.accepted, "rejected": fed.rejected, "faults": fed.faults,
        "behind_s": fed.behind_s, "processor": used_s / fed_s, "tracks": status["tracks"],
        "unprocessed": status["journal_sequence"] - status["processed_sequence"],
        **slope_of(table, 60.0 * options.plateau),
    }  # fmt: skip


def _feed(
    options: argparse.Namespace, service: Service, world: World, fed: Fed, begin_s: float
) -> None:
    connection = http.client.HTTPConnection(service.address, timeout=120.0)
    duration_s = 60.0 * options.minutes * options.speed
    part_s = BLOCK_S / max(1.0, round(BLOCK_S / (0.5 * options.speed)))
    for number, (frame,) in enumerate(world.blocks(duration_s)):
        for end_s in (
            number * BLOCK_S + np.arange(part_s, BLOCK_S + part_s / 2.0, part_s)
        ).tolist():
            due_s = begin_s + end_s / options.speed
            time.sleep(max(0.0, due_s - CLOCK.monotonic_s()))
            time_s = pl.col("time_s") - START_S
            part = frame.filter((time_s >= end_s - part_s) & (time_s < end_s))
            if len(part):
                content = BytesIO()
                part.write_ipc_stream(content)
                service.send(connection, content.getvalue(), fed)
            fed.behind_s = max(fed.behind_s, CLOCK.monotonic_s() - due_s)
    connection.close()


def _read(service: Service, ended: threading.Event) -> None:
    for path in itertools.cycle(_READ):
        if ended.wait(1.0):
            return
        service.get(path)


def slope_of(samples: NDArray[np.float64], from_s: float) -> dict[str, float]:
    """Return the slope of the memory after a time, with its interval.

    Parameters
    ----------
    samples : (n, 2) array
        Times since the start, s, and memory, MiB.
    from_s : float
        End of the plateau's growth, s since the start.
    """
    late = samples[samples[:, 0] >= from_s]
    if len(late) < _PARTS:
        return {"memory_mib": float(samples[-1, 1]), "slope": np.nan, "slope_sigma": np.nan}
    parts = np.array([part.mean(axis=0) for part in np.array_split(late, _PARTS)])
    (slope, _), covariance = np.polyfit(parts[:, 0], parts[:, 1], 1, cov=True)
    return {
        "memory_mib": float(parts[0, 1]),
        "memory_mib_most": float(late[:, 1].max()),
        "slope": float(slope) * _HOUR_S,
        "slope_sigma": float(np.sqrt(covariance[0, 0])) * _HOUR_S,
    }


def evaluated(figures: Mapping[str, Any], speed: float, growth_max: float) -> tuple[str, bool]:
    """Return whether the memory is flat, as a sentence, and whether its growth is permitted.

    Parameters
    ----------
    figures : mapping
        Slope and its sigma, MiB per hour by the clock.
    speed : float
        Data time relative to the clock.
    growth_max : float
        Bound for the lower end of the interval of two sigmas, MiB per hour of data.
    """
    slope, interval = figures["slope"], 2.0 * figures["slope_sigma"]
    if not np.isfinite(slope + interval):
        return f"no slope: fewer than {_PARTS} samples after the plateau", False
    least = (slope - interval) / speed
    sentence = (
        f"{'not flat' if least > 0.0 else 'flat'}: {slope / speed:+.1f} ± {interval / speed:.1f} "
        f"MiB per hour of data, {slope:+.1f} ± {interval:.1f} MiB per hour by the clock (two "
        f"sigmas); the lower end, {least:+.1f} per hour of data, may be at most {growth_max:+.1f}"
    )
    return sentence, bool(least <= growth_max)


def _print(figures: dict[str, Any]) -> None:
    for name, form in (
        ("rate", "{:,.0f} measurements/s"), ("seconds", "{:,.0f} s by the clock"),
        ("data_h", "{:.1f} h of data"), ("accepted", "{:,} accepted"),
        ("rejected", "{:,} rejected"), ("unprocessed", "{:,} messages not processed at the end"),
        ("behind_s", "{:.2f} s behind at most"), ("processor", "{:.2f} cores used"),
        ("tracks", "{:,} tracks at the end"), ("memory_mib", "{:,.0f} MiB on the plateau"),
        ("memory_mib_most", "{:,.0f} MiB at most after it"),
        ("slope", "{:+.1f} MiB/h by the clock"), ("slope_sigma", "{:.1f} MiB/h, its sigma"),
    ):  # fmt: skip
        if name in figures:
            print("  " + form.format(figures[name]))
    print("  " + figures["evaluation"])
    for fault in figures["faults"]:
        print("  fault: " + fault)


if __name__ == "__main__":
    raise SystemExit(main())
