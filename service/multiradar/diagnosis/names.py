"""Sources that are missing in the sensors file, and configured sensors without measurements."""

import difflib
import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from multiradar.diagnosis.evidence import Evidence, Source
from multiradar.diagnosis.model import Diagnosis
from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_POSITION, KIND_RADAR

#: Kinds of measurement that a kind of sensor sends.
_KINDS = {KIND_RADAR: {"radar", "bearing"}, KIND_BEARING: {"bearing"}}
#: Code of a sensor without measurements.
SILENT_CODE = "no_measurements"
#: So many measurements without a sensor are reported.
NAMELESS_MIN = 20
#: Names that a sentence lists.
_LISTED_MAX = 8


def check_names(evidence: Evidence) -> list[Diagnosis]:
    """Return the diagnoses of sensor names.

    Parameters
    ----------
    evidence : Evidence
        Counts and plots of the run.
    """
    known = set(evidence.sensors.ids)
    unknown = [name for name in evidence.sources if name not in known and name]
    silent = [name for name in _expected(evidence) if not _read(evidence, name)]
    present = [name for name in known if _read(evidence, name)]
    spelt = _spelt_otherwise(unknown, known)
    unknown = [name for name in unknown if name not in spelt]
    silent = [name for name in silent if name not in spelt.values()]
    if unknown and not present and not spelt:
        return [_wrong_sensors_file(unknown, silent)]
    likely = _likely_sensors(evidence, unknown, silent)
    reused = _reused_ids(evidence, [name for name in unknown if name not in likely], present)
    return [
        *(_spelling(evidence, name, meant) for name, meant in spelt.items()),
        *(_reused_id(evidence, name, of) for name, of in reused.items()),
        *(
            _unknown(evidence, name, _same_kind(evidence, name, silent), likely.get(name))
            for name in sorted(unknown)
            if name not in reused.values()
        ),
        *(_silent(name) for name in silent if name not in likely.values()),
        *_nameless(evidence),
    ]


# Sources whose names differ from those of sensors by spaces, upper or lower case.
def _spelt_otherwise(unknown: Sequence[str], known: Collection[str]) -> dict[str, str]:
    plain = {name.lower(): name for name in known}
    read = {name: _plain(name).lower() for name in unknown}
    found = {name: plain[text] for name, text in read.items() if text in plain}
    return dict(sorted(found.items(), key=lambda one: one[1]))


# A name without the quotation marks that the evidence gives to unusual ones.
def _plain(name: str) -> str:
    return re.sub(r"(\\[tnr]|\\x..|\\u....|[\s'])", "", name)


def _spelling(evidence: Evidence, name: str, meant: str) -> Diagnosis:
    what = "by spaces" if _plain(name) == meant else "by upper and lower case"
    count = counted(evidence.sources[name].read)
    return Diagnosis(
        meant,
        "unknown_source",
        f"{meant}: the sensor_id of {count} measurements is {name}, which differs from that of the "
        f"sensors file {what} only; correct the column sensor_id",
    )


def _nameless(evidence: Evidence) -> list[Diagnosis]:
    count = _read(evidence, "")
    if count < NAMELESS_MIN:
        return []
    return [
        Diagnosis(
            "",
            "sensor_id_missing",
            f"{counted(count)} measurements were rejected because they have no sensor_id; fill the "
            "column with the sensor of each measurement",
            "warning",
        )
    ]


def counted(number: int) -> str:
    """Return a number with spaces between thousands."""
    return f"{number:,}".replace(",", " ")


def listed(names: Sequence[str]) -> str:
    """Return names as text, at most `_LISTED_MAX` of them."""
    more = len(names) - _LISTED_MAX
    return ", ".join(names[:_LISTED_MAX]) + (f" and {more} more" if more > 0 else "")


# Entries for ADS-B and multilateration are common in sensors files even without such data.
def _expected(evidence: Evidence) -> list[str]:
    chosen = evidence.kinds
    kinds = zip(evidence.sensors.ids, evidence.sensors.kinds.tolist(), strict=True)
    return [
        name
        for name, kind in kinds
        if kind != KIND_POSITION and (chosen is None or _KINDS[kind] & set(chosen))
    ]


def _read(evidence: Evidence, name: str) -> int:
    return evidence.sources[name].read if name in evidence.sources else 0


def _silent(name: str) -> Diagnosis:
    return Diagnosis(
        name,
        SILENT_CODE,
        f"{name}: no measurements in the recording; check its id or its source and sensor numbers, "
        "or remove it from the sensors file",
    )


def _wrong_sensors_file(unknown: list[str], silent: list[str]) -> Diagnosis:
    return Diagnosis(
        "",
        "sensors_of_another_recording",
        "none of the sources of the measurements is in the sensors file, which is probably for "
        f"another recording: the measurements are from {listed(sorted(unknown))}, the file "
        f"contains {listed(sorted(silent))}; specify the sensors file of these sensors",
    )


def _kinds_of(evidence: Evidence, name: str) -> set[str]:
    return {str(kind) for one in evidence.sources[name].kept for kind in one["kind"].unique()}


# Sensors of the file whose kind matches the measurements of a source.
def _same_kind(evidence: Evidence, name: str, sensors: Sequence[str]) -> list[str]:
    kinds = _kinds_of(evidence, name)
    return [
        one
        for one in sensors
        if kinds <= _KINDS.get(int(evidence.sensors.kinds[evidence.number(one)]), set())
    ]


# Radars of the file whose id belongs to another kind of source, with the intended radar.
def _reused_ids(
    evidence: Evidence, unknown: Sequence[str], present: Sequence[str]
) -> dict[str, str]:
    radars = [one for one in unknown if _kinds_of(evidence, one) == {"radar"}]
    wrong = [
        one
        for one in present
        if evidence.sensors.kinds[evidence.number(one)] == KIND_RADAR
        and not _kinds_of(evidence, one) & _KINDS[KIND_RADAR]
    ]
    return {wrong[0]: radars[0]} if len(wrong) == len(radars) == 1 else {}


def _reused_id(evidence: Evidence, name: str, meant: str) -> Diagnosis:
    (kind, *_) = sorted(_kinds_of(evidence, name))
    return Diagnosis(
        name,
        "kind",
        f"{name}: the sensors file declares a radar under this id, but its measurements are of "
        f"kind {kind}, and the plots of {meant} ({counted(evidence.sources[meant].read)}) have no "
        f'sensor; declare the radar as {meant}, and {name} with kind = "{kind}"',
    )


def _unknown(evidence: Evidence, name: str, silent: list[str], meant: str | None) -> Diagnosis:
    source = evidence.sources[name]
    what = "plot" if _kinds_of(evidence, name) <= {"radar"} else "measurement"
    what += "" if source.read == 1 else "s"
    has = ""
    if silent:
        has = f"; the recording has no measurements of {listed(silent)} in that file"
    ask = (
        f"; did you mean {name} instead of {meant}?"
        if meant
        else "; add it, or remove its measurements"
    )
    return Diagnosis(
        name,
        "unknown_source",
        f"{name} ({counted(source.read)} {what}) is not in the sensors file (sensors.toml)"
        f"{has}{ask}",
    )


# The silent sensor that an unknown source probably is: same kind, most similar name, each once.
def _likely_sensors(evidence: Evidence, unknown: list[str], silent: list[str]) -> dict[str, str]:
    similar = sorted(
        (-difflib.SequenceMatcher(None, one, other).ratio(), one, other)
        for one in unknown
        for other in _same_kind(evidence, one, silent)
    )
    meant: dict[str, str] = {}
    for ratio, one, other in similar:
        only = len(unknown) == len(silent) == 1
        if (only or ratio <= -0.6) and one not in meant and other not in meant.values():
            meant[one] = other
    return meant


def first_and_last(sources: Mapping[str, Source], names: Sequence[str]) -> tuple[float, float]:
    """Return the earliest and latest time of some sources, s; NaN without any."""
    first = [sources[name].first_s for name in names]
    last = [sources[name].last_s for name in names]
    if not names or np.isnan(first).all():
        return np.nan, np.nan
    return float(np.nanmin(first)), float(np.nanmax(last))
