"""The time by stage, as `track` prints it."""

from collections.abc import Mapping


def print_stages(seconds: Mapping[str, float], beside: Mapping[str, float]) -> None:
    """Print how long each stage of a run took, in one line.

    Parameters
    ----------
    seconds : mapping of str to float
        Time of each stage, s.
    beside : mapping of str to float
        Time of each stage of a thread that worked at the same time, s.
    """
    text = f"{sum(seconds.values()):.1f} s: {_listed(seconds)}"
    print(f"{text}; in parallel: {_listed(beside)}" if beside else text)


def _listed(seconds: Mapping[str, float]) -> str:
    return ", ".join(f"{stage} {time_s:.1f} s" for stage, time_s in seconds.items())
