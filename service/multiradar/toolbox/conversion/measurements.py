"""Measurements in any supported form, opened as one recording."""

import json
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from multiradar.errors import DataWarning, InputError
from multiradar.toolbox.conversion.convert import convert_dump
from multiradar.toolbox.conversion.dump_points import AIRCRAFT_MAX, track_points
from multiradar.toolbox.inputs import DumpChoice
from multiradar.toolbox.messages.warning import warn
from multiradar_converters.leftovers import temporary_folder
from multiradar_schemas.documents.contents import no_such

if TYPE_CHECKING:
    from multiradar.diagnosis.model import Diagnosis
    from multiradar.storage.recording import Recording, RejectedLines

#: Kinds of measurement of the tables of a dump.
_KINDS_OF_TABLES = {"plots": "radar", "plots_ads": "adsb"}
_REPORT_FILE = "report.json"


@contextmanager
def open_measurements(
    given: Path, dump: DumpChoice, horizon_s: float, name: str | None = None
) -> Iterator["Recording"]:
    """Open measurements: a Parquet file, a converted folder, or a dump, converted on the fly.

    Parameters
    ----------
    given : Path
        The file or folder.
    dump : DumpChoice
        Options for a dump.
    horizon_s : float
        Rows out of order by more than this, s, are sorted by time first.
    name : str, optional
        Its name in errors; the path by default.

    Yields
    ------
    Recording
        With at least one measurement; temporary files are removed afterwards.

    Raises
    ------
    InputError
        It cannot be read, or is empty.
    """
    from multiradar.storage.recording import MEASUREMENTS_FILE, Recording, measurements_path

    if not given.is_dir() or (given / MEASUREMENTS_FILE).exists():
        dump.check_unused(name or given)
        recording = Recording(measurements_path(given), name)
        with _in_order(recording, name or str(given), horizon_s) as ordered:
            yield ordered
        return
    options = dump.options(kinds=("multiradar", "monoradar"), aircraft_max=AIRCRAFT_MAX)
    files = options.profile.files
    if not (given / files.plots).exists():
        others = [one for one in (files.plots_ads, files.tracks) if (given / one).exists()]
        if others:
            msg = f"{name or given}: missing file {files.plots}; found {', '.join(others)}"
            raise InputError(msg)
        raise InputError(no_such(given, f"a folder with {MEASUREMENTS_FILE}, or a dump"))
    with temporary_folder("multiradar-dump-") as temporary:
        converted = temporary / "converted"
        # Track files are only for the diagnosis.
        report = convert_dump(given, converted, options)
        measured = Recording(converted / MEASUREMENTS_FILE)
        measured.rejected_lines = _rejected_lines(converted, report)
        with _in_order(measured, str(given), horizon_s) as ordered:
            yield ordered


def dump_diagnoses(
    recording: "Recording",
    kinds: Collection[str] | None = None,
    of_run: "Collection[Diagnosis]" = (),
) -> "list[Diagnosis]":
    """Return the diagnoses of an open dump as of its conversion; none of another recording.

    Parameters
    ----------
    recording : Recording
        As `open_measurements` yields it.
    kinds : collection of str, optional
        Kinds of measurement that are used; all when absent.
    of_run : collection of Diagnosis
        Those of the run that uses it, which knows the sites: what it says of a sensor counts.
    """
    from multiradar.diagnosis.conversion import RECORDS_CODE, diagnose_conversion
    from multiradar.storage.recording import MEASUREMENTS_FILE

    rejected = recording.rejected_lines
    if rejected is None:
        return []
    folder = rejected.rejects.parent
    report = json.loads((folder / _REPORT_FILE).read_text(encoding="utf-8"))
    if kinds is not None:
        # What is wrong with measurements that are not used does not matter.
        used = [one for one in report["inputs"] if rejected.kinds.get(one["file"]) in kinds]
        report["inputs"] = used
    points = track_points(folder, report)
    found = diagnose_conversion(folder / MEASUREMENTS_FILE, report, None, points)
    if kinds is not None:
        return [one for one in found if one.code == RECORDS_CODE]
    named = {one.sensor_id for one in of_run}
    return [one for one in found if not one.sensor_id or one.sensor_id not in named]


def _rejected_lines(folder: Path, report: dict[str, Any]) -> "RejectedLines":
    from multiradar.storage.recording import RejectedLines

    files = report["figures"]["files"]
    return RejectedLines(
        folder / "rejects.ndjson",
        {name: one["rejected_by_code"] for name, one in files.items()},
        {
            name: _KINDS_OF_TABLES[one["table"]]
            for name, one in files.items()
            if one["table"] in _KINDS_OF_TABLES
        },
    )


@contextmanager
def _in_order(recording: "Recording", name: str, horizon_s: float) -> Iterator["Recording"]:
    from multiradar.storage.time_order import disorder_s, in_time_order

    if recording.rows == 0:
        msg = f"{name}: no measurements"
        raise InputError(msg)
    disordered_s = disorder_s(recording)
    if disordered_s <= horizon_s:
        yield recording
        return
    warn(
        f"{name}: rows are up to {round(disordered_s, 1):.10g} s out of order; they were "
        "sorted by time",
        DataWarning,
    )
    with temporary_folder("multiradar-sort-") as temporary:
        yield in_time_order(recording, temporary)
