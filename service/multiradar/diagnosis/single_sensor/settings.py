"""Settings of a sensor that the run itself contradicts, and its losses."""

from multiradar.diagnosis import losses as loss_checks
from multiradar.diagnosis import noise
from multiradar.diagnosis.cross_sensor.comparison import AGREES_MIN, Comparison
from multiradar.diagnosis.cross_sensor.plausibility import (
    SPEED_MAX_MPS,
    SPEED_MIN_MPS,
    aircraft_of,
    check_nearer_than_height,
    check_range_unit,
    check_scan_period,
    median_speed,
)
from multiradar.diagnosis.evidence import Evidence, Source
from multiradar.diagnosis.model import Diagnosis, first_of
from multiradar.diagnosis.single_sensor.detections import check_detections
from multiradar.diagnosis.single_sensor.track_scatter import track_scatter
from multiradar.diagnosis.sites import check_displaced

#: Fraction of rejected rows from which on scans without a plot may be theirs.
_REJECTED_MAX = 0.1


def check_settings(
    evidence: Evidence, comparison: Comparison, name: str, *, causes: bool
) -> list[Diagnosis]:
    """Return the settings of a sensor that the run contradicts, else its losses.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    comparison : Comparison
        Its plots.
    name : str
        The sensor.
    causes : bool
        Whether an error of some sensor is known, which may cause losses of others.
    """
    losses = loss_checks.losses_of(evidence, name)
    number = evidence.number(name)
    radar = number in comparison.numbers and comparison.is_radar(number)
    repeated = loss_checks.check_repeated(evidence, name)
    found = first_of(
        loss_checks.check_range_max(
            evidence, name, losses, in_metres=radar and _are_in_metres(comparison, number)
        ),
        _range_unit(evidence, comparison, name) if radar else None,
        check_nearer_than_height(name, comparison.plots(number), comparison.site(number))
        if radar and not causes
        else None,
        repeated,
        None if causes else check_displaced(evidence, name),
        noise.check_noise(evidence, name, track_scatter(evidence, number), causes=causes),
        noise.check_scatter(
            evidence, name, comparison.plots(number), aircraft_of(comparison.plots(number))
        )
        if radar and not causes
        else None,
        # The times between copies are no scans.
        _scans(comparison, name, number, evidence.sources[name])
        if radar and repeated is None
        else None,
    )
    values = loss_checks.check_values(evidence, name, losses)
    if values is not None and not found:
        return [values]
    # Tracks biased by a wrong sensor lose plots of the right ones, too.
    if causes or any(one.severity == "error" for one in found):
        return found
    return first_of(loss_checks.check_unexplained_losses(evidence, name, losses), *found)


def _scans(comparison: Comparison, name: str, number: int, source: Source) -> Diagnosis | None:
    plots, period_s = comparison.plots(number), comparison.period_s(number)
    found = check_scan_period(name, plots, period_s)
    # Rejected rows are not missing: the reasons are those of their values.
    if found or source.rejected.total() > _REJECTED_MAX * source.read:
        return found
    return check_detections(name, plots, comparison.site(number), period_s)


# Whether ranges are in metres: other sensors agree, or aircraft are as fast as aircraft.
def _are_in_metres(comparison: Comparison, number: int) -> bool:
    if _agrees(comparison, number):
        return True
    plots = comparison.plots(number)
    speed = median_speed(plots, plots.range_m, comparison.site(number), aircraft_of(plots))
    return SPEED_MIN_MPS <= speed <= SPEED_MAX_MPS


def _agrees(comparison: Comparison, number: int) -> bool:
    pairs = comparison.pairs(number, comparison.numbers)
    return comparison.agreement(number, pairs).share >= AGREES_MIN


def _range_unit(evidence: Evidence, comparison: Comparison, name: str) -> Diagnosis | None:
    number = evidence.number(name)
    if _agrees(comparison, number):
        return None
    plots = comparison.plots(number)
    end_m = float(evidence.sensors.range_max_m[number])
    return check_range_unit(name, plots, comparison.site(number), aircraft_of(plots), end_m)
