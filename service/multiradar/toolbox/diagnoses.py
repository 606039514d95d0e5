"""Diagnoses as warnings and findings, and notes on recordings."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from multiradar.errors import DataWarning
from multiradar.toolbox.messages.warning import warn

if TYPE_CHECKING:
    import polars as pl

    from multiradar.diagnosis.model import Diagnosis

SYSTEM_TRACKS_FILE = "system_tracks.parquet"
#: States of another processor's tracks without an estimate from measurements.
NOT_SEEN = ("coasting", "ended", "simulated")
#: The form of ADS-B messages with local times.
_LOCAL_FORM = "BaseStation"


def findings_of(diagnoses: "Iterable[Diagnosis]") -> list[str]:
    """Warn of mistakes that leave the output usable; return the sentences of errors.

    Parameters
    ----------
    diagnoses : iterable of Diagnosis
        All of them.

    Returns
    -------
    list of str
        For a `FindingsError`.
    """
    errors = []
    for one in diagnoses:
        if one.severity == "error":
            errors.append(one.sentence)
        else:
            warn(one.sentence, DataWarning)
    return errors


def notes_of(kind: str, paths: Sequence[Path], report: Mapping[str, Any], out: Path) -> list[str]:
    """Return warnings about a complete conversion.

    Parameters
    ----------
    kind : str
        vid, asterix, adsb or journal.
    paths : sequence of Path
        What was converted.
    report : mapping
        Contents of `report.json`.
    out : Path
        The folder that was made.

    Returns
    -------
    list of str
        Sentences for warnings.
    """
    from multiradar_converters.repeated_files import repeated_sentence

    if kind == "journal":
        return _of_journal(report)
    # A dump is a folder, whose copies are found in its plots.
    found = [sentence for path in paths if (sentence := repeated_sentence(path))]
    found += _unused_options(report)
    found += report["figures"].get("moved_files", ())
    return [*found, *_of_asterix(report, out)] if kind == "asterix" else found


# What `track` cannot repeat.
def _of_journal(report: Mapping[str, Any]) -> list[str]:
    from multiradar.storage.entries import MEASUREMENTS_BYTES_MAX

    figures = report["figures"]
    lost, changes, steps = (
        figures[name] for name in ("not_recovered", "sensor_changes", "clock_changes")
    )
    found = []
    if steps:
        numbers = [one["entry"] for one in steps]
        found.append(
            "the data time was set by an operator while the service was running: "
            f"{_first_of([f'entry {number}' for number in numbers])}; `track` does not repeat "
            "this, so that its tracks differ; `multiradar migrate` does"
        )
    if lost:
        found.append(
            f"{lost} rejected rows with the codes to recover were not recovered: their content is "
            "not a measurement, or was not kept because the rejected rows of their message were "
            f"longer than {MEASUREMENTS_BYTES_MAX >> 20} MiB; rejects.ndjson lists them, and "
            "smaller messages keep all"
        )
    if changes:
        named = _first_of([f"{one['sensor_id']} in entry {one['entry']}" for one in changes])
        found.append(
            f"sensors were changed while the service was running: {named}; `track` uses one "
            "description of each sensor for all measurements"
        )
    return found


def _first_of(names: list[str]) -> str:
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return ", ".join(names[:5]) + more


# A zone is for local times.
def _unused_options(report: Mapping[str, Any]) -> list[str]:
    offset_h, figures = report["settings"].get("utc_offset_h"), report["figures"]
    forms = {one["form"] for one in figures["files"].values()} if offset_h else set()
    if not forms or _LOCAL_FORM in forms:
        return []
    return [
        f"utc_offset {offset_h:g}: ignored; it applies only to {_LOCAL_FORM} messages, whose "
        f"times are local; the format of this recording is {', '.join(sorted(forms))}"
    ]


# Wrong clocks, and system tracks that no plot ever updated, which are not a usable reference.
def _of_asterix(report: Mapping[str, Any], out: Path) -> list[str]:
    import polars as pl

    alarms = report["figures"].get("sensor_alarms", ())
    found = [f"{alarm['sensor_id']}: {alarm['reason']}" for alarm in alarms]
    found += [
        f"{file}: ends before {previous} starts, but was specified after that file; specify the "
        "files in chronological order: measurements are sorted by time, but midnights are "
        "counted in file order"
        for file, previous in report["figures"].get("exchanged_files", ())
    ]
    path = out / SYSTEM_TRACKS_FILE
    unseen = unseen_states(pl.read_parquet(path, columns=["state"])) if path.is_file() else ""
    return [*found, f"{unseen}; `evaluate` cannot use them as a reference"] if unseen else found


def unseen_states(updates: "pl.DataFrame") -> str:
    """Return a message about system tracks that were never updated by a measurement.

    Parameters
    ----------
    updates : DataFrame
        Their updates, with the column `state`.

    Returns
    -------
    str
        Empty if some were.
    """
    counts = updates["state"].value_counts(sort=True).rows()
    if not counts or any(state not in NOT_SEEN for state, _ in counts):
        return ""
    of_states = ", ".join(f"{count:,} {state}" for state, count in counts)
    return (
        f"none of the {len(updates):,} system track updates is based on a measurement "
        f"({of_states}): the recorder or the processor received no plots"
    )
