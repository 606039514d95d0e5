"""The time by stage, as `track` prints it."""

from collections.abc import Mapping


def print_stages(seconds: Mapping[str, float]) -> None:
    """Print how long each stage of a run took, in one line.

    Parameters
    ----------
    seconds : mapping of str to float
        Time of each stage, s.
    """
    stages = ", ".join(f"{stage} {time_s:.1f} s" for stage, time_s in seconds.items())
    print(f"{sum(seconds.values()):.1f} s: {stages}")
