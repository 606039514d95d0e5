"""Notes of the study of section 1.6: readings and limits."""

from collections.abc import Sequence

from multiradar.research.studies.bias_estimation.loss import Loss
from multiradar.research.studies.bias_estimation.runs import (
    CI_SCALE_TIME_S,
    DRIFT_DENSITY,
    RANGE_MIN_M,
)

_ERRORS = (
    "Mean error: the magnitude of the deviation, averaged over the runs and over aircraft or "
    "radars. Theoretical and reported: square roots of the averaged trace, (1.27), of the true "
    "covariance by (1.26) and of the filter's own. An RMS value is slightly larger than a mean "
    "magnitude: 1.13 times for two Gaussian components of equal sigma, 1.25 times for one."
)
_THEORY = (
    "The theory runs each filter along the true tracks of the first run, linearised at the truth, "
    "measures its gain by its response to small innovations, and propagates the covariance of all "
    "aircraft and biases by (1.26), whose noise term is K D W Dᵀ Kᵀ. At the truth both forms of "
    "the measurement differ by a change of coordinates only, so they share one theory: any larger "
    "error of the linearised form is the cost of converting a plot to a position first."
)
_DRIFT = (
    "The report's table gives drift rates although (1.7) sets the drift to zero; both are studied. "
    "The drift is 1 m and 0.02° after one second, and grows with the square root of time. With "
    f"drifting biases the aircraft have a white acceleration of {DRIFT_DENSITY:g} m²/s³, different "
    "in each run and known to the filters. Aircraft on exactly straight lines retain the effect of "
    "all past biases. The two-stage filter re-anchors aircraft when the biases drift, and treats "
    "the effect of past biases as independent errors of each aircraft: with less than about 0.1 "
    "m²/s³ its covariance is too small."
)
_BANDS = (
    "The NEES band treats runs as independent and aircraft of one run as correlated, according to "
    "the covariance of the joint filter. Errors at successive times are correlated as well, so "
    "that a mean outside the band stays outside for a while. A consistent filter stays within the "
    "wider band at all times, 95 times in 100."
)
_INTERSECTION = (
    "The trace minimised by CI adds m² and (m/s)², (1.45): here velocities are multiplied by "
    f"{CI_SCALE_TIME_S:g} s. That suits straight flight, in which velocities converge slowly; 10 s "
    "suit manoeuvring aircraft."
)
_RANGE_LIMIT = (
    f"Plots closer than {RANGE_MIN_M / 1e3:g} km to the radar are left out: there the azimuth is "
    "not linear in the position. No track of the scenario comes so close without acceleration."
)
_TRACKS = (
    "The tracks are drawn once, because the report does not publish its own, and are those of the "
    "built-in scenario report-1-6; the seed changes everything else."
)


def all_notes(filters: Sequence[str], losses: Sequence[Loss]) -> list[str]:
    """Return the notes that apply to the study as run.

    Parameters
    ----------
    filters : sequence of str
        The filters of the study.
    losses : sequence of Loss
        Loss of the two-stage filter by drift; empty where not computed.

    Returns
    -------
    list of str
        One plain paragraph each.
    """
    drift = " ".join([_DRIFT, *_loss_notes(losses)])
    intersection = [_INTERSECTION] if "ci" in filters else []
    return [_ERRORS, _THEORY, drift, _BANDS, *intersection, _RANGE_LIMIT, _TRACKS]


def _loss_notes(losses: Sequence[Loss]) -> list[str]:
    if not losses:
        return []
    times = {loss.density: loss.two_stage_m / loss.joint_m for loss in losses}
    ratios = " and ".join(
        f"{times[density]:.4g} times {where}"
        for density, where in ((0.0, "on exactly straight lines"), (DRIFT_DENSITY, "as here"))
        if density in times
    )
    return [
        f"According to the theory, its position error after {losses[0].time_s:g} s is that of the "
        f"joint filter {ratios}; the last table gives other accelerations."
    ]
