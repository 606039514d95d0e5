"""The dump converter on gigabytes: `python -m benchmark.converter --gigabytes 2`.

The dump is the sample, repeated and shifted by half an hour each time; with `--new-aircraft` every
repetition has aircraft of its own, which makes thousands of them. The conversion runs as a process
of its own, all outputs included; speed is input over wall time, memory the largest resident size.
A small conversion before it warms the compiled code, as any earlier run does.
"""

import argparse
import csv
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

from support.paths import SAMPLE

FILES = {"tracks.txt": 3, "plots.txt": None, "plots_ads.txt": 1}
SHIFT_S = 1800
AIRCRAFT_SHIFT = 400

Measured = tuple[str, float, str]


def make_dump(folder: Path, size: float, *, new_aircraft: bool) -> int:
    """Write a dump of about this many bytes; return its size."""
    folder.mkdir()
    repetitions = max(1, round(size / sum((SAMPLE / name).stat().st_size for name in FILES)))
    for name, aircraft_column in FILES.items():
        header, *lines = (SAMPLE / name).read_bytes().rstrip(b"\r\n").split(b"\r\n")
        with (folder / name).open("wb") as file:
            file.write(header + b"\r\n")
            for repetition in range(repetitions):
                column = aircraft_column if new_aircraft else None
                shifted = (_shifted(line, repetition, column) for line in lines)
                file.write(b"\r\n".join(shifted) + b"\r\n")
    return sum((folder / name).stat().st_size for name in FILES)


def _shifted(line: bytes, repetition: int, aircraft_column: int | None) -> bytes:
    fields = line.split(b"\t")
    try:
        fields[0] = b"%.3f" % (float(fields[0]) + SHIFT_S * repetition)
        if aircraft_column is not None:
            fields[aircraft_column] = b"%d" % (
                int(fields[aircraft_column]) + AIRCRAFT_SHIFT * repetition
            )
    except (ValueError, IndexError):
        # The broken lines of the sample are repeated unchanged.
        return line
    return b"\t".join(fields)


def measure(folder: Path, size: float, *, new_aircraft: bool) -> list[Measured]:
    """Create a dump, convert it in a separate process, return the figures."""
    dump = folder / "dump"
    read = make_dump(dump, size, new_aircraft=new_aircraft)
    convert(SAMPLE, folder / "warm")
    begin = perf_counter()
    cpu_s, peak_bytes = convert(dump, folder / "out")
    wall_s = perf_counter() - begin
    written = sum(path.stat().st_size for path in (folder / "out").rglob("*") if path.is_file())
    aircraft = sum(path.is_dir() for path in (folder / "out").iterdir())
    label = f"convert vid, {read / 1e9:.2f} GB, {aircraft} aircraft"
    return [
        (f"{label}: speed", read / wall_s / 1e6, "MB/s"),
        (f"{label}: peak memory", peak_bytes / 2**20, "MiB"),
        (f"{label}: wall time", wall_s, "s"),
        (f"{label}: processor time", cpu_s, "s"),
        (f"{label}: written", written / 1e9, "GB"),
    ]


def convert(dump: Path, out: Path) -> tuple[float, int]:
    """Convert a dump by the command; return its processor time (s) and peak memory (bytes)."""
    command = [sys.executable, "-m", "multiradar", "convert", "vid", str(dump), str(out)]
    process = subprocess.Popen([*command, "--date", "2018-08-01"], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise SystemExit(process.returncode)
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss * _maxrss_unit()


def _maxrss_unit() -> int:
    """Return the bytes in a unit of the peak memory that the system reports."""
    return 1 if sys.platform == "darwin" else 1024


def main() -> None:
    """Measure, print rows of name, value, unit."""
    parser = argparse.ArgumentParser(prog="python -m benchmark.converter")
    parser.add_argument("--gigabytes", type=float, default=2.0)
    parser.add_argument("--new-aircraft", action="store_true")
    parser.add_argument("--folder", type=Path, help="where to work; needs four times the size")
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="converter-", dir=options.folder))
    try:
        rows = measure(folder, options.gigabytes * 1e9, new_aircraft=options.new_aircraft)
    finally:
        shutil.rmtree(folder)
    writer = csv.writer(sys.stdout)
    writer.writerow(("name", "value", "unit"))
    writer.writerows((name, f"{value:.1f}", unit) for name, value, unit in rows)


if __name__ == "__main__":
    main()
