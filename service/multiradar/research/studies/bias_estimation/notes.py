"""Notes of the study of section 1.6: readings and limits."""

from collections.abc import Sequence

from multiradar.research.studies.bias_estimation.loss import Loss
from multiradar.research.studies.bias_estimation.runs import (
    CI_SCALE_TIME_S,
    DRIFT_DENSITY,
    RANGE_MIN_M,
)

_ERRORS = (
    "Mean errors: magnitudes of the errors, averaged over the runs and over aircraft or radars. "
    "Theoretical and reported errors: square roots of the averaged trace (1.27) of the true "
    "covariance from (1.26) and of the covariance reported by the filter. An RMS value is slightly "
    "larger than a mean magnitude: by a factor of 1.13 for two Gaussian components of equal sigma, "
    "and by 1.25 for a single component."
)
_THEORY = (
    "For the theoretical values, each filter is run along the true tracks of the first run, "
    "linearised at the truth. The gain of the filter is determined from its response to small "
    "innovations, and the covariance of all aircraft and biases is propagated by (1.26) with the "
    "noise term K D W Dᵀ Kᵀ. At the truth, the two forms of the measurement differ only by a "
    "change of coordinates, so their theoretical values are equal; any larger error of the "
    "linearised form is caused by converting the plots to positions first."
)
_DRIFT = (
    "The report's table gives drift rates although (1.7) sets the drift to zero; both cases are "
    "studied. The drift is 1 m and 0.02° (one sigma) after one second, and grows with the square "
    "root of time. With drifting biases, the aircraft are subject to a white-noise acceleration "
    f"with a spectral density of {DRIFT_DENSITY:g} m²/s³, which the filters know; the noise "
    "differs between runs. Tracks of aircraft in exactly straight flight retain the effect of all "
    "past biases. The two-stage filter re-anchors the tracks when the biases drift, and treats the "
    "effect of past biases as errors that are independent from one aircraft to another: below "
    "about 0.1 m²/s³, its covariance is too small."
)
_BANDS = (
    "The NEES band treats runs as independent, and the aircraft of a run as correlated according "
    "to the covariance of the joint filter. Errors at successive times are also correlated, so a "
    "mean that leaves the band stays outside for some time. A consistent filter stays within the "
    "wider band at all times with a probability of 95 %."
)
_INTERSECTION = (
    "Covariance intersection (CI) minimises a trace that adds m² and (m/s)², (1.45): here "
    f"velocities are multiplied by {CI_SCALE_TIME_S:g} s. This suits straight flight, in which "
    "velocities converge slowly; 10 s would suit manoeuvring aircraft."
)
_RANGE_LIMIT = (
    f"Plots closer than {RANGE_MIN_M / 1e3:g} km to the radar are omitted, because the azimuth is "
    "too nonlinear in the position there. Without acceleration, no track in the scenario comes "
    "this close."
)
_TRACKS = (
    "The report does not publish its tracks. The study always uses the tracks of the built-in "
    "scenario report-1-6, which were randomly generated once; the seed affects everything else."
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
        f"{times[density]:.4g} {where}"
        for density, where in (
            (0.0, "in exactly straight flight"),
            (DRIFT_DENSITY, "with the acceleration used here"),
        )
        if density in times
    )
    return [
        "In theory, the position error of the two-stage filter divided by the position error of "
        f"the joint filter after {losses[0].time_s:g} s is {ratios}; the last table lists the "
        "ratio for other accelerations."
    ]
