"""Questions to a view, as tests put them: forecasts and biases without what surrounds them."""

from typing import Any

from multiradar.runtime.ports import View
from multiradar.runtime.queries.registry import FORECAST


def forecast(
    view: View,
    track_id: int,
    horizon_s: float,
    step_s: float,
    *region: float | str,
) -> list[dict[str, Any]] | None:
    """Return the points of a forecast; at the end the probability of its regions and its method."""
    given: dict[str, Any] = {"horizon_s": horizon_s, "step_s": step_s}
    given |= dict(zip(("probability", "by"), region, strict=False))
    document = view.ask(FORECAST, track_id, **given)
    return None if document is None else document["points"]


def biases(view: View, sensor_id: str) -> list[dict[str, Any]]:
    """Return the latest biases of a sensor; none of one that is not known."""
    return [bias for one in view.sensors() if one["id"] == sensor_id for bias in one["biases"]]
