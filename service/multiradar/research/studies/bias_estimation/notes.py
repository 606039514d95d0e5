"""Notes of the study of section 1.6: readings and limits of what it did, and of nothing else."""

from collections.abc import Sequence

from multiradar.research.studies.bias_estimation.loss import Loss
from multiradar.research.studies.bias_estimation.runs import (
    CI_SCALE_TIME_S,
    DRIFT_DENSITY,
    SILENCE_M,
)

_ERRORS = (
    "Mean error: the modulus of the deviation, its mean over the runs and over aircraft or radars. "
    "Theoretical and reported: roots of the mean part of the trace, (1.27), of the true covariance "
    "by (1.26) and of the filter's own. A root mean square is a little more than a mean modulus: "
    "1.13 times for two normal components of one sigma, 1.25 times for a single one."
)
_THEORY = (
    "The theory plays each filter along the true tracks of the first run, linearised at the truth, "
    "reads its gain off its response to small innovations, and carries the covariance of all "
    "aircraft and biases by (1.26), whose noise term is K D W Dᵀ Kᵀ. At the truth both forms of "
    "the measurement differ by a change of coordinates alone, so they share one theory: what the "
    "linearised form does worse than that is the price of turning a plot into a place first."
)
_DRIFT = (
    "The report's table gives drift rates although (1.7) sets the drift to zero; both are studied. "
    "A bias walks 1 m and 0.02° in a second, and the square root of the time in all. Where the "
    f"biases drift, the aircraft are pushed by a white acceleration of {DRIFT_DENSITY:g} m²/s³, "
    "new in each run, which the filters know. Aircraft on exactly straight lines remember all that "
    "the biases ever did. The two-stage filter anchors aircraft anew when the biases walk, and "
    "keeps what their past did as the own error of each aircraft: pushed by less than about "
    "0.1 m²/s³ it promises too much."
)
_BANDS = (
    "The band of the normalised errors takes runs as independent and aircraft of one run as "
    "correlated, as the covariance of the joint filter says they are. Errors at one time and the "
    "next are correlated too, so that a mean which leaves the band stays out for a while. The "
    "wider band is the one that a consistent filter keeps to at all times, 95 times in 100."
)
_INTERSECTION = (
    "The trace that CI minimises adds m² and (m/s)², (1.45): here a velocity counts as the way of "
    f"{CI_SCALE_TIME_S:g} s. That suits straight flight, in which velocities are what is still to "
    "be learnt; 10 s suit aircraft that manoeuvre."
)
_SILENCE = (
    f"Plots nearer than {SILENCE_M / 1e3:g} km to the radar are not made: near it the azimuth is "
    "not linear in the position. No track of the scene comes as near without being pushed."
)
_TRACKS = (
    "The tracks are drawn once, as the report does not print its own, and are those of the "
    "built-in scene report-1-6; the seed changes everything else."
)


def all_notes(filters: Sequence[str], losses: Sequence[Loss]) -> list[str]:
    """Return the notes that belong to what was done.

    Parameters
    ----------
    filters : sequence of str
        The filters that were judged.
    losses : sequence of Loss
        What the two-stage filter loses by drift; empty where it was not asked.

    Returns
    -------
    list of str
        One plain paragraph each.
    """
    drift = " ".join([_DRIFT, *_told(losses)])
    intersection = [_INTERSECTION] if "ci" in filters else []
    return [_ERRORS, _THEORY, drift, _BANDS, *intersection, _SILENCE, _TRACKS]


def _told(losses: Sequence[Loss]) -> list[str]:
    if not losses:
        return []
    times = {loss.density: loss.two_stage_m / loss.joint_m for loss in losses}
    told = " and ".join(
        f"{times[density]:.4g} times {where}"
        for density, where in ((0.0, "on exactly straight lines"), (DRIFT_DENSITY, "as here"))
        if density in times
    )
    return [
        f"By the theory its error of position after {losses[0].time_s:g} s is that of the joint "
        f"filter {told}; the last table says what other accelerations do."
    ]
