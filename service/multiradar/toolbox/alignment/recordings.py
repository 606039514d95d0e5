"""Recordings of any form as one table of measurements."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from multiradar.errors import InputError
from multiradar.toolbox.conversion.measurements import dump_diagnoses, open_measurements
from multiradar.toolbox.inputs import DumpChoice
from multiradar_converters.leftovers import temporary_folder
from multiradar_schemas.alignment import AlignedInput
from multiradar_schemas.report import Counts

if TYPE_CHECKING:
    from multiradar.diagnosis.model import Diagnosis
    from multiradar.storage.recording import Recording
    from multiradar_schemas.sensors.sensor import SensorsFile

_COUNTS = ("read", "accepted", "rejected", "duplicate")


@dataclass(frozen=True, slots=True)
class OpenedRecordings:
    """Measurements of all recordings.

    Attributes
    ----------
    recording : Recording
        In order of time.
    inputs : list of AlignedInput
        The recordings.
    diagnoses : list of Diagnosis
        What is wrong with a conversion or the sensors file.
    """

    recording: "Recording"
    inputs: list[AlignedInput]
    diagnoses: "list[Diagnosis]"


@contextmanager
def open_recordings(
    given: Sequence[Path], sensors: "SensorsFile", dump: DumpChoice, horizon_s: float
) -> Iterator[OpenedRecordings]:
    """Open recordings: ASTERIX, ADS-B trajectories, dumps, and what was converted from them.

    Parameters
    ----------
    given : sequence of Path
        Files and folders. Those of ASTERIX are one recording, in their order.
    sensors : SensorsFile
        Names of the sensors.
    dump : DumpChoice
        Options for dumps; the date is that of all recordings.
    horizon_s : float
        Rows out of order by more than this, s, are sorted by time.

    Yields
    ------
    OpenedRecordings
        Temporary files are removed afterwards.

    Raises
    ------
    InputError
        One of them cannot be read, or dates are missing in some of them.
    """
    from multiradar.storage.recording import MEASUREMENTS_FILE, measurements_path

    _check_once(given)
    kinds = {path: _kind(path) for path in given}
    if set(kinds.values()) == {"dump"} and len(given) == 1:
        with open_measurements(given[0], dump, horizon_s) as recording:
            yield OpenedRecordings(recording, [_of_dump(given[0], recording)], _of_files(recording))
        return
    tables: list[Path] = []
    inputs: list[AlignedInput] = []
    diagnoses: list[Diagnosis] = []
    with ExitStack() as held, temporary_folder("multiradar-align-") as temporary:
        for kind in ("asterix", "adsb"):
            files = [path for path, one in kinds.items() if one == kind]
            if files:
                report = _convert(kind, files, temporary / kind, sensors, dump)
                diagnoses += _diagnosed(report, temporary / kind, sensors)
                tables.append(temporary / kind / MEASUREMENTS_FILE)
                inputs.append(_documented(files, report))
        for path, kind in kinds.items():
            if kind == "dump":
                opened = held.enter_context(open_measurements(path, dump, horizon_s))
                tables.append(opened.path)
                diagnoses += _of_files(opened)
                inputs.append(_of_dump(path, opened))
            elif kind == "converted":
                tables.append(measurements_path(path))
                inputs.append(AlignedInput(file=str(path), counts=None))
        whole = tables[0] if len(tables) == 1 else _joined(tables, temporary)
        with open_measurements(whole, DumpChoice(), horizon_s) as recording:
            yield OpenedRecordings(recording, inputs, diagnoses)


def _check_once(given: Sequence[Path]) -> None:
    files = Counter(path.resolve() for path in given)
    for path in given:
        if (count := files[path.resolve()]) > 1:
            msg = f"{path}: given {count} times, expected once"
            raise InputError(msg)


def _kind(path: Path) -> str:
    from multiradar.storage.recording import MEASUREMENTS_FILE
    from multiradar.toolbox.conversion.convert import detected

    if path.suffix == ".parquet" or (path / MEASUREMENTS_FILE).exists():
        return "converted"
    kind = detected(path)
    return "dump" if kind == "vid" else kind


def _convert(
    kind: str, files: list[Path], out: Path, sensors: "SensorsFile", dump: DumpChoice
) -> dict[str, Any]:
    from multiradar.toolbox.conversion.convert import convert_files
    from multiradar_converters.adsb.conversion import convert as convert_adsb
    from multiradar_converters.adsb.options import Options as AdsbOptions
    from multiradar_converters.asterix.conversion import convert as convert_asterix
    from multiradar_converters.asterix.options import Options as AsterixOptions

    date = dump.options().date
    if kind == "adsb":
        adsb = AdsbOptions(date=date)
        return convert_files(kind, files, lambda advance: convert_adsb(files, out, adsb, advance))
    asterix = AsterixOptions(sensors=sensors, date=date)
    return convert_files(kind, files, lambda advance: convert_asterix(files, out, asterix, advance))


def _diagnosed(report: dict[str, Any], out: Path, sensors: "SensorsFile") -> "list[Diagnosis]":
    from multiradar import wire
    from multiradar.diagnosis.conversion import diagnose_conversion
    from multiradar.storage.recording import MEASUREMENTS_FILE

    table = wire.sensor_table(sensors)
    return diagnose_conversion(out / MEASUREMENTS_FILE, report, table)


# The run diagnoses the sensors.
def _of_files(dump: "Recording") -> "list[Diagnosis]":
    return [one for one in dump_diagnoses(dump) if not one.sensor_id]


def _of_dump(path: Path, dump: "Recording") -> AlignedInput:
    rejected = dump.rejected_by_code().total()
    counts = Counts(read=dump.rows + rejected, accepted=dump.rows, rejected=rejected)
    return AlignedInput(file=str(path), counts=counts)


def _documented(files: list[Path], report: dict[str, Any]) -> AlignedInput:
    counts = Counts(**{name: report["counts"][name] for name in _COUNTS})
    return AlignedInput(file=", ".join(map(str, files)), counts=counts)


def _joined(tables: list[Path], folder: Path) -> Path:
    import polars as pl

    from multiradar.report.times import is_dated
    from multiradar.storage.recording import Recording

    recordings = [Recording(table) for table in tables]
    spans = [span for one in recordings if (span := one.span_s()) is not None]
    if len({is_dated(last) for _, last in spans}) > 1:
        msg = "some recordings have dates, others only times of day; add --date YYYY-MM-DD"
        raise InputError(msg)
    path = folder / "joined.parquet"
    parts = [pl.concat([b.drop("index") for b in one.blocks()]) for one in recordings if one.rows]
    if not parts:
        msg = "the recordings contain no measurements"
        raise InputError(msg)
    pl.concat(parts).sort("time_s", maintain_order=True, nulls_last=True).write_parquet(path)
    return path
