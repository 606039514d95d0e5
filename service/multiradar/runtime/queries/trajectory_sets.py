"""Reconstructed trajectories of live tracks."""

from typing import Any

from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.trajectories.document import trajectories_of


def answer_trajectories(
    known: Knowledge, track_id: int, *, points: int, step_s: int
) -> dict[str, Any] | None:
    """Return the reconstructed trajectories of a live track.

    Parameters
    ----------
    known : Knowledge
        Present data of the service.
    track_id : int
        The track.
    points : int
        Maximum number of points of each path; earlier points are omitted.
    step_s : int
        Whole seconds between them.

    Returns
    -------
    dict or None
        The fields of `Trajectories` of the schemas; None when there is no such live track.

    Raises
    ------
    TrajectoryError
        If there are none; see `code`.
    """
    track = known.track(track_id)
    if track is None:
        return None
    feed = known.trajectory_feed()
    document = trajectories_of(track_id, feed.read(track_id), feed.plane, points, step_s)
    return {**document, "state": track["state"], "age_s": track["age_s"]}
