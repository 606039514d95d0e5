"""How live tracks flew, by their bundles."""

from typing import Any

from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.trajectories.document import trajectories_of


def answer_trajectories(
    known: Knowledge, track_id: int, *, points: int, step_s: int
) -> dict[str, Any] | None:
    """Return how a live track flew, by its bundle of trajectories.

    Parameters
    ----------
    known : Knowledge
        What the service knows.
    track_id : int
        The track.
    points : int
        Points of each path at most, the last ones.
    step_s : int
        Whole seconds between them.

    Returns
    -------
    dict or None
        The fields of `Trajectories` of the schemas; None when there is no such live track.

    Raises
    ------
    TrajectoryError
        If there are no trajectories of it; `code` says why.
    """
    track = known.track(track_id)
    if track is None:
        return None
    feed = known.trajectory_feed()
    document = trajectories_of(track_id, feed.read(track_id), feed.plane, points, step_s)
    return {**document, "state": track["state"], "age_s": track["age_s"]}
