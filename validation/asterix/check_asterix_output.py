"""Reads back system tracks, sensor status and service status written in ASTERIX.

::

    python -m validation.asterix.check_asterix_output PLOTS sensors.toml \
        [--filter imm] [--libasterix PYTHON]

PLOTS is a folder with `measurements.parquet`. It is tracked, and all output for one user is written
to a file. The file is read back by the project's own reader and, with --libasterix, by libasterix.
The expected value of each field is computed here, with the resolutions of the standard. The table
gives, for each field, the number of records that contain it and its largest error in units of its
resolution; 0.5 is rounding. The check fails when a record has missing or additional fields.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.stereographic import StereographicPlane
from multiradar.runtime.asterix.channel import Channel, ChannelOptions
from multiradar.runtime.asterix.cycles import Cycles
from multiradar.runtime.offline.offline_job import OfflineJob
from multiradar.runtime.offline.offline_run import track_recording
from multiradar.storage.recording import Recording, measurements_path
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.settings import TrackingSettings
from multiradar_converters.asterix.framing.containers import read_blocks
from multiradar_converters.asterix.layout.catalogue import layout_of
from multiradar_converters.asterix.layout.fields import record_fields
from multiradar_converters.asterix.layout.program import program_of, walk
from multiradar_converters.asterix.writing.senders import Sender
from multiradar_converters.asterix.writing.status_reports import SensorReports
from multiradar_converters.asterix.writing.track_reports import TrackReports
from multiradar_schemas.measurements.callsigns import packed_callsigns

Column = NDArray[Any]
#: Expected fields: resolution, and the values of all records, NaN where a field is absent.
Expected = dict[str, tuple[float, Column]]
Leaves = dict[str, float | str]

SENDER = Sender(20, 250, 7)
EDITIONS = {62: "1.21", 63: "1.7", 65: "1.6"}
#: Half a unit, with a margin for floating point.
ROUNDING = 0.5 + 1e-6

TESTS = Path(__file__).parents[2] / "tests"
PEER = """
import json, sys
from asterix import base, generated
sys.path.insert(0, sys.argv[1])
from support.asterix.peer import peer_records
data, at = open(sys.argv[2], "rb").read(), 0
names = {62: "062 1.21", 63: "063 1.7", 65: "065 1.6"}
while at < len(data):
    end = at + int.from_bytes(data[at + 1:at + 3], "big")
    records = peer_records(generated, base, names[data[at]], data[at + 3:end])
    for leaves in records or [[["rejected", 1]]]:
        print(json.dumps([data[at], leaves]))
    at = end
"""


class RecordingChannel(Channel):
    """A channel that retains the reports sent to a user."""

    def __init__(self, options: ChannelOptions) -> None:
        super().__init__(options)
        self.track_reports: list[TrackReports] = []
        self.sensor_reports: list[SensorReports] = []

    def choose(self, reports: TrackReports) -> TrackReports:
        self.track_reports.append(super().choose(reports))
        return self.track_reports[-1]

    def status(self, reports: SensorReports, *, overload: bool = False) -> list[bytes]:
        self.sensor_reports.append(reports)
        return super().status(reports, overload=overload)


def written(
    plots: Path, sensors: SensorTable, settings: TrackingSettings, path: Path
) -> RecordingChannel:
    """Track a recording and write the output for a user; return the user."""
    centre = np.nanmean(sensors.latitude_rad), np.nanmean(sensors.longitude_rad)
    plane = StereographicPlane(*(float(one) for one in centre))
    user = RecordingChannel(ChannelOptions(SENDER, plane=plane))
    cycles = Cycles(sensors, settings, [user])
    blocks: list[bytes] = []
    job = OfflineJob(Recording(measurements_path(plots)), sensors, settings)
    with tempfile.TemporaryDirectory() as folder:
        track_recording(
            job,
            Path(folder),
            on_output=lambda output: blocks.extend(
                block for sent in cycles.push(output) for block in sent.blocks
            ),
        )
    blocks += [block for sent in cycles.finish() for block in sent.blocks]
    path.write_bytes(b"".join(blocks))
    return user


def expected_tracks(reports: TrackReports) -> Expected:
    """Return the expected records of category 062."""
    n = len(reports)
    geometric = ~np.isnan(reports.geometric_m)
    plot = reports.sensor >= 0
    old = [~(reports.age_s[:, k] <= reports.old_s) for k in range(5)]
    moves = np.any(
        [part != 3 for part in (reports.turning, reports.speeding, reports.climbing)], axis=0
    )
    level, foot, mile = 30.48, 0.3048, 1852.0
    only = [plot & (reports.plot_mode_3a >= 0), plot & ~np.isnan(reports.plot_height_m)]
    seen = [~old[0], ~(old[1] & old[2] & old[3] & old[4])]
    whole: Expected = {
        "010/SAC": (1, np.full(n, 20)),
        "010/SIC": (1, np.full(n, 250)),
        "015": (1, np.full(n, 7)),
        "070": (1 / 128, np.full(n, reports.time_s % 86_400.0)),
        "105/LAT": (180 / 2**25, reports.latitude_deg),
        "105/LON": (180 / 2**25, reports.longitude_deg),
        "100/X": (0.5, reports.x_m),
        "100/Y": (0.5, reports.y_m),
        "185/VX": (0.25, reports.velocity_east_mps),
        "185/VY": (0.25, reports.velocity_north_mps),
        "060/MODE3A": (1, _where(reports.mode_3a, reports.mode_3a >= 0)),
        "380/ADR": (1, _where(reports.mode_s_address, reports.mode_s_address >= 0)),
        "380/ID": (1, _where(reports.callsign, reports.callsign >= 0)),
        "040": (1, reports.number),
        "136": (0.25, reports.measured_height_m / level),
        "130": (6.25, reports.geometric_m / foot),
        "135/CTB": (0.25, reports.barometric_m / level),
        "220": (6.25, reports.climb_mps / foot * 60.0),
        "290/TRK": (0.25, np.minimum(reports.track_age_s, 63.75)),
        "295/MFL": (0.25, np.minimum(reports.height_age_s, 63.75)),
        "295/MDA": (0.25, np.minimum(reports.code_age_s, 63.75)),
        "200/TRANS": (1, _where(reports.turning, moves)),
        "200/LONG": (1, _where(reports.speeding, moves)),
        "200/VERT": (1, _where(reports.climbing, moves)),
        "080/MON": (1, reports.monosensor),
        "080/MRH": (1, geometric),
        "080/SRC": (1, 3 * geometric),
        "080/CNF": (1, reports.tentative),
        "080/TSE": (1, reports.last),
        "080/TSB": (1, reports.first),
        "080/AFF": (1, reports.implausible),
        "080/CST": (1, reports.coasting),
        "080/PSR": (1, old[0]),
        "080/SSR": (1, old[1]),
        "080/MDS": (1, old[2]),
        "080/ADS": (1, old[3]),
        "080/MLAT": (1, old[4]),
        "080/SDS": (1, np.select([seen[0] & seen[1], seen[1], seen[0]], [0, 1, 2], 3)),
        "060/CH": (1, _where(reports.code_changed, reports.mode_3a >= 0)),
        "340/SID/SAC": (1, _where(reports.sensor // 256, plot)),
        "340/SID/SIC": (1, _where(reports.sensor % 256, plot)),
        "340/POS/RHO": (1 / 256, _where(reports.range_m / mile, plot)),
        "340/POS/THETA": (360 / 2**16, _where(reports.azimuth_deg, plot)),
        "340/MDC/LMC": (0.25, _where(reports.plot_height_m / level, only[1])),
        "340/MDA/MODE3A": (1, _where(reports.plot_mode_3a, only[0])),
        "340/TYP/TYP": (1, _where(reports.plot_type, plot)),
    }
    for k, name in enumerate(("PSR", "SSR", "MDS", "ES", "MLT")):
        whole[f"290/{name}"] = 0.25, np.minimum(reports.age_s[:, k], 63.75)
    return whole | _expected_accuracies(reports)


def _expected_accuracies(reports: TrackReports) -> Expected:
    geometric = ~np.isnan(reports.geometric_m)
    sigma_x, sigma_y = np.sqrt(reports.variance_x_m2), np.sqrt(reports.variance_y_m2)
    cross = np.sign(reports.covariance_xy_m2) * np.sqrt(np.abs(reports.covariance_xy_m2))
    metre_deg = 1.0 / 111_132.0
    level, foot = 30.48, 0.3048
    around = np.cos(np.radians(reports.latitude_deg))
    return {
        "500/APC/X": (0.5, sigma_x),
        "500/APC/Y": (0.5, sigma_y),
        "500/COV": (0.5, cross),
        "500/APW/LAT": (180 / 2**25, np.sqrt(reports.variance_north_m2) * metre_deg),
        "500/APW/LON": (180 / 2**25, np.sqrt(reports.variance_east_m2) * metre_deg / around),
        "500/AGA": (6.25, _where(np.minimum(reports.height_sigma_m / foot, 1593.75), geometric)),
        "500/ABA": (0.25, _where(np.minimum(reports.height_sigma_m / level, 63.75), ~geometric)),
        "500/ATV/X": (0.25, np.minimum(reports.velocity_sigma_mps, 63.75)),
        "500/ATV/Y": (0.25, np.minimum(reports.velocity_sigma_mps, 63.75)),
    }


def expected_sensors(reports: SensorReports) -> Expected:
    """Return the expected records of category 063."""
    n = len(reports)
    mile = 1852.0
    return {
        "010/SAC": (1, np.full(n, 20)),
        "010/SIC": (1, np.full(n, 250)),
        "015": (1, np.full(n, 7)),
        "030": (1 / 128, np.full(n, reports.time_s % 86_400.0)),
        "050/SAC": (1, reports.sensor // 256),
        "050/SIC": (1, reports.sensor % 256),
        "060/CON": (1, reports.condition),
        "060/NPW": (1, _where(np.ones(n), reports.silent)),
        "070": (1, 1000.0 * reports.time_offset_s),
        "080/SRG": (1e-5, _where(reports.range_gain, reports.secondary)),
        "080/SRB": (1 / 128, _where(reports.range_offset_m / mile, reports.secondary)),
        "081": (360 / 2**16, _where(reports.azimuth_offset_deg, reports.secondary)),
        "090/PRG": (1e-5, _where(reports.range_gain, reports.primary)),
        "090/PRB": (1 / 128, _where(reports.range_offset_m / mile, reports.primary)),
        "091": (360 / 2**16, _where(reports.azimuth_offset_deg, reports.primary)),
    }


def own_records(path: Path) -> Iterator[tuple[int, Leaves]]:
    """Read a file with the project's reader."""
    cut = read_blocks(path)
    for begin, end in zip(cut.begins.tolist(), cut.ends.tolist(), strict=True):
        category = int(cut.data[begin])
        program = program_of(layout_of(category, EDITIONS[category]))
        walked = walk(program, cut.data, np.array([begin + 3]), np.array([end]))
        assert not walked.faults[0, 0], f"octet {begin}: block cannot be read"
        for starts in walked.starts:
            yield category, dict(_flat(record_fields(program, cut.data, starts), ""))


def peer_records(path: Path, python: str) -> Iterator[tuple[int, Leaves]]:
    """Read a file with libasterix."""
    command = [python, "-c", PEER, str(TESTS), str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    for line in done.stdout.splitlines():
        category, leaves = json.loads(line)
        yield category, dict(leaves)


def compared(
    user: RecordingChannel, records: Iterator[tuple[int, Leaves]]
) -> dict[str, tuple[int, float]]:
    """Return for each field the number of records with it, and its largest error in resolutions.

    Raises
    ------
    ValueError
        A record has missing or additional fields, or the number of records differs.
    """
    by_category: dict[int, list[Leaves]] = {62: [], 63: [], 65: []}
    for category, leaves in records:
        by_category[category].append(leaves)
    found: dict[str, tuple[int, float]] = {}
    tracks = [expected_tracks(one) for one in user.track_reports]
    sensors = [expected_sensors(one) for one in user.sensor_reports]
    for category, expected in ((62, tracks), (63, sensors)):
        read = iter(by_category[category])
        for cycle in expected:
            _compare(category, cycle, read, found)
        if (more := next(read, None)) is not None:
            raise ValueError(f"{category:03d}: expected no further record, was {more}")
    return found


def _number(name: str, value_read: float | str) -> float:
    if name == "380/ID":
        return float(packed_callsigns(pl.Series([str(value_read)]))[0])
    return int(value_read, 8) if isinstance(value_read, str) else float(value_read)


def _compare(
    category: int, expected: Expected, read: Iterator[Leaves], found: dict[str, tuple[int, float]]
) -> None:
    count = len(next(iter(expected.values()))[1])
    for k in range(count):
        leaves = next(read, None)
        if leaves is None:
            raise ValueError(f"{category:03d}: expected {count - k} further records, was none")
        wanted = {
            name: (unit, float(column[k]))
            for name, (unit, column) in expected.items()
            if not np.isnan(float(column[k]))
        }
        # Fields that are not in the tables above are bits that are never set.
        others = {name for name in set(leaves) - set(wanted) if leaves[name] != 0}
        if others or not set(wanted) <= set(leaves):
            missing = set(wanted) - set(leaves)
            raise ValueError(f"{category:03d}: too many {others}, too few {missing} in {leaves}")
        for name, (unit, value) in wanted.items():
            value_read = leaves[name]
            number = _number(name, value_read)
            apart = abs(number - value)
            if name in ("105/LON", "340/POS/THETA"):
                apart = abs((number - value + 180.0) % 360.0 - 180.0)
            times, worst = found.get(f"{category:03d}/{name}", (0, 0.0))
            found[f"{category:03d}/{name}"] = times + 1, max(worst, apart / unit)


def _where(values: Column, known: Column) -> Column:
    return np.where(known, values, np.nan)


def _flat(value: object, path: str) -> Iterator[tuple[str, float | str]]:
    if isinstance(value, dict):
        for name, one in value.items():
            yield from _flat(one, f"{path}/{name}" if path else name)
    elif isinstance(value, int | float | str):
        yield path, value


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="ASTERIX output read back")
    parser.add_argument("plots", type=Path)
    parser.add_argument("sensors", type=Path)
    parser.add_argument("--filter", default="two-stage", help="name of the filter")
    parser.add_argument("--libasterix", metavar="PYTHON", help="an interpreter that has it")
    given = parser.parse_args()
    settings = TrackingSettings(filter_name=given.filter)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tracks.ast"
        user = written(given.plots, load_sensor_table(given.sensors), settings, path)
        readers: dict[str, Callable[[], Iterator[tuple[int, Leaves]]]] = {
            "own reader": lambda: own_records(path)
        }
        if given.libasterix:
            readers["libasterix"] = lambda: peer_records(path, given.libasterix)
        tables = {name: compared(user, read()) for name, read in readers.items()}
    print(f"records written: {dict(sorted(user.counts.items()))}")
    print(f"{'field':<20}{'records':>10}" + "".join(f"{name:>14}" for name in tables))
    first = next(iter(tables.values()))
    for name, (times, _) in first.items():
        worst = "".join(f"{table[name][1]:>14.3f}" for table in tables.values())
        print(f"{name:<20}{times:>10}{worst}")
    if any(worst > ROUNDING for table in tables.values() for _, worst in table.values()):
        sys.exit("a field differs from its expected value by more than rounding")


if __name__ == "__main__":
    main()
