"""Sources that are not in the sensors file, and sensors of it that sent nothing."""

import difflib
from collections.abc import Mapping, Sequence

import numpy as np

from multiradar.diagnosis.diagnosis import Diagnosis
from multiradar.diagnosis.evidence import Evidence, Source
from multiradar.estimation.measurement._kernels import KIND_BEARING, KIND_POSITION, KIND_RADAR

#: Kinds of measurement that a kind of sensor sends.
_KINDS = {KIND_RADAR: {"radar", "bearing"}, KIND_BEARING: {"bearing"}}
#: Names that a sentence lists.
_LISTED_MAX = 8


def names_amiss(evidence: Evidence) -> list[Diagnosis]:
    """Return what is wrong with the names of sources.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    """
    known = set(evidence.sensors.ids)
    unknown = [name for name in evidence.sources if name not in known and name]
    silent = [name for name in _expected(evidence) if not _read(evidence, name)]
    heard = [name for name in known if _read(evidence, name)]
    if unknown and not heard:
        return [_another(evidence, unknown, silent)]
    meant = _meant(evidence, unknown, silent)
    taken = _taken(evidence, [name for name in unknown if name not in meant], heard)
    return [
        *(_of_other_kind(evidence, name, of) for name, of in taken.items()),
        *(
            _unknown(evidence, name, _alike(evidence, name, silent), meant.get(name))
            for name in sorted(unknown)
            if name not in taken.values()
        ),
        *(_silent(name) for name in silent if name not in meant.values()),
    ]


def counted(number: int) -> str:
    """Return a number with its thousands apart."""
    return f"{number:,}".replace(",", " ")


def listed(names: Sequence[str]) -> str:
    """Return names as text, not too many."""
    more = len(names) - _LISTED_MAX
    return ", ".join(names[:_LISTED_MAX]) + (f" and {more} more" if more > 0 else "")


# An entry for ADS-B or multilateration stands in many files whether there is any or not.
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
        "no_measurements",
        f"{name}: no measurements in the recording; check its id or its source and sensor numbers, "
        "or remove it from the sensors file",
    )


def _another(evidence: Evidence, unknown: list[str], silent: list[str]) -> Diagnosis:
    return Diagnosis(
        "",
        "sensors_of_another_recording",
        "no source of the recording is in the sensors file, which is probably that of another "
        f"recording: the recording has {listed(sorted(unknown))}, the file has "
        f"{listed(sorted(silent))}; give the sensors file of this recording",
    )


def _kinds_of(evidence: Evidence, name: str) -> set[str]:
    return {str(kind) for one in evidence.sources[name].kept for kind in one["kind"].unique()}


# Sensors of the file that may send what a source sends.
def _alike(evidence: Evidence, name: str, sensors: Sequence[str]) -> list[str]:
    kinds = _kinds_of(evidence, name)
    return [
        one
        for one in sensors
        if kinds <= _KINDS.get(int(evidence.sensors.kinds[evidence.number(one)]), set())
    ]


# Radars of the file that have the id of what is no radar, with the radar that is meant.
def _taken(evidence: Evidence, unknown: Sequence[str], heard: Sequence[str]) -> dict[str, str]:
    radars = [one for one in unknown if _kinds_of(evidence, one) == {"radar"}]
    wrong = [
        one
        for one in heard
        if evidence.sensors.kinds[evidence.number(one)] == KIND_RADAR
        and not _kinds_of(evidence, one) & _KINDS[KIND_RADAR]
    ]
    return {wrong[0]: radars[0]} if len(wrong) == len(radars) == 1 else {}


def _of_other_kind(evidence: Evidence, name: str, meant: str) -> Diagnosis:
    (kind, *_) = sorted(_kinds_of(evidence, name))
    return Diagnosis(
        name,
        "kind",
        f"{name}: the sensors file declares a radar under this id, but its measurements are of the "
        f"kind {kind}, and the plots of {meant} ({counted(evidence.sources[meant].read)}) have no "
        f'sensor; declare the radar as {meant}, and {name} with kind = "{kind}"',
    )


def _unknown(evidence: Evidence, name: str, silent: list[str], meant: str | None) -> Diagnosis:
    source = evidence.sources[name]
    what = "plots" if _kinds_of(evidence, name) <= {"radar"} else "measurements"
    has = ""
    if silent:
        has = f"; it has {listed(silent)}, which sent nothing"
    ask = (
        f"; did you mean {name} in place of {meant} there?"
        if meant
        else "; add it, or remove its measurements"
    )
    return Diagnosis(
        name,
        "unknown_source",
        f"{name} ({counted(source.read)} {what}) is not in the sensors file (sensors.toml)"
        f"{has}{ask}",
    )


# Which silent sensor an unknown source is: the one of its kind with the most alike name, each once.
def _meant(evidence: Evidence, unknown: list[str], silent: list[str]) -> dict[str, str]:
    alike = sorted(
        (-difflib.SequenceMatcher(None, one, other).ratio(), one, other)
        for one in unknown
        for other in _alike(evidence, one, silent)
    )
    meant: dict[str, str] = {}
    for ratio, one, other in alike:
        only = len(unknown) == len(silent) == 1
        if (only or ratio <= -0.6) and one not in meant and other not in meant.values():
            meant[one] = other
    return meant


def first_and_last(sources: Mapping[str, Source], names: Sequence[str]) -> tuple[float, float]:
    """Return the least and the greatest time of some sources, s; NaN without any."""
    first = [sources[name].first_s for name in names]
    last = [sources[name].last_s for name in names]
    if not names or np.isnan(first).all():
        return np.nan, np.nan
    return float(np.nanmin(first)), float(np.nanmax(last))
