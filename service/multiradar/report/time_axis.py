"""An axis of data times: marks at whole minutes or hours, named by the time of day."""

from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, MultipleLocator

from multiradar.report.times import clock_text

#: Marks of an axis, at most.
_MARKS_MAX = 7
_MINUTE_S, _DAY_S = 60.0, 86_400.0
_STEPS_S = (
    1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0, 7200.0,
    10_800.0, 21_600.0, 43_200.0, _DAY_S,
)  # fmt: skip


def set_times(axis: Axis) -> None:
    """Mark an axis by the time of day.

    Parameters
    ----------
    axis : Axis
        Of data times, its limits set.
    """
    low, high = axis.get_view_interval()
    step_s = step_of(high - low)
    letters = len("08:12") if step_s >= _MINUTE_S else len("08:12:31")
    axis.set_major_locator(MultipleLocator(step_s))
    axis.set_major_formatter(FuncFormatter(lambda value, _: clock_text(value)[:letters]))


def step_of(span_s: float) -> float:
    """Return the time between two marks of an axis of so many seconds."""
    for step_s in _STEPS_S:
        if span_s <= step_s * _MARKS_MAX:
            return step_s
    days = -(-span_s // (_DAY_S * _MARKS_MAX))
    return float(days * _DAY_S)
