"""An axis of data times: ticks at whole minutes, hours or days, labelled with their time."""

from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, MultipleLocator

from multiradar.report.times import clock_text, day_text

#: Maximum number of ticks.
_MARKS_MAX = 7
_MINUTE_S, _HALF_DAY_S, _DAY_S = 60.0, 43_200.0, 86_400.0
_STEPS_S = (
    1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0, 7200.0,
    10_800.0, 21_600.0, 43_200.0, _DAY_S,
)  # fmt: skip


def set_times(axis: Axis) -> None:
    """Label an axis with times of day, and with dates where it is of several days.

    Parameters
    ----------
    axis : Axis
        Of data times, with its limits set.
    """
    low, high = axis.get_view_interval()
    step_s = step_of(high - low)
    axis.set_major_locator(MultipleLocator(step_s))
    axis.set_major_formatter(FuncFormatter(lambda value, _: tick_text(value, step_s)))


def tick_text(time_s: float, step_s: float) -> str:
    """Return the label of a tick, with what the interval between two ticks needs.

    Parameters
    ----------
    time_s : float
        Its data time.
    step_s : float
        The interval, s.

    Returns
    -------
    str
        ``08:12:31``; from a minute on ``08:12``, of half days ``08-01 12:00``, of days ``08-01``.
    """
    if step_s >= _DAY_S:
        return day_text(time_s)
    clock = clock_text(time_s)
    if step_s < _MINUTE_S:
        return clock
    minutes = clock[: len("08:12")]
    return f"{day_text(time_s)} {minutes}" if step_s >= _HALF_DAY_S else minutes


def step_of(span_s: float) -> float:
    """Return the tick interval of an axis with a span in seconds."""
    for step_s in _STEPS_S:
        if span_s <= step_s * _MARKS_MAX:
            return step_s
    days = -(-span_s // (_DAY_S * _MARKS_MAX))
    return float(days * _DAY_S)
