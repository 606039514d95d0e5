"""The biases at the end of an earlier run, as the start of another."""

from typing import TYPE_CHECKING

from multiradar.errors import InputError
from multiradar.toolbox.run import Run

if TYPE_CHECKING:
    from multiradar.estimation.bias.store import BiasState
    from multiradar.estimation.measurement.sensors import SensorTable

#: Two recordings that follow each other may overlap by this time, since plots arrive late, s.
OVERLAP_MAX_S = 60.0


def biases_at_end(run: Run, sensors: "SensorTable", first_s: float | None) -> "BiasState":
    """Return the biases at the end of a run, with their drift until a later recording.

    Parameters
    ----------
    run : Run
        The run.
    sensors : SensorTable
        The sensors of the later recording: what the run did not estimate has its prior.
    first_s : float, optional
        First time of the later recording, s; without it, there is no drift.

    Returns
    -------
    BiasState
        Estimates and joint covariance, in the order of the table.

    Raises
    ------
    InputError
        The run has no biases of these sensors, or ends after the recording starts.
    """
    from multiradar import wire
    from multiradar.estimation.bias.store import drift

    state, end_s = wire.final_biases(run.biases, run.table("bias_correlations"), sensors)
    if end_s is None:
        raise InputError(_no_biases(run, sensors))
    if first_s is None:
        return state
    if first_s < end_s - OVERLAP_MAX_S:
        raise InputError(
            f"{run.folder}: the run ends at {end_s:.0f} s, after the start of this recording at "
            f"{first_s:.0f} s; choose an earlier run"
        )
    elapsed_s = max(first_s - end_s, 0.0)
    return drift(state, sensors.drift, elapsed_s)[0] if elapsed_s else state


def _no_biases(run: "Run", sensors: "SensorTable") -> str:
    from multiradar.diagnosis.names import listed

    of_run = sorted(run.biases["sensor_id"].unique().to_list())
    has = f"contains biases of {listed(of_run)}" if of_run else "contains no biases"
    return (
        f"{run.folder}: the run {has}, but the sensors of this recording are "
        f"{listed(sensors.ids)}: a run of other sensors, or other ids; choose a run of the same "
        "sensors"
    )
