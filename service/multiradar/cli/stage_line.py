"""The time by stage, as `track` prints it."""

from collections.abc import Mapping

#: Stages that took less are left out, s.
_SHOWN_FROM_S = 0.05


def print_stages(seconds: Mapping[str, float]) -> None:
    """Print how long each stage of a run took, in one line.

    Parameters
    ----------
    seconds : mapping of str to float
        Time of each stage, s.
    """
    stages = ", ".join(
        f"{stage} {time_s:.1f} s" for stage, time_s in seconds.items() if time_s >= _SHOWN_FROM_S
    )
    total_s = sum(seconds.values())
    print(f"{total_s:.1f} s: {stages}" if stages else f"{total_s:.1f} s")
