"""A position that a source reports in two categories counts once."""

from collections.abc import Mapping

import numpy as np

from multiradar_converters.asterix.table import SAME_POSITION_DEG, repeated_positions
from multiradar_schemas.measurements.measurement import KINDS

SHARED: dict[str, float] = {
    "kind": KINDS.index("adsb"), "source": 7, "category": 10, "time_s": 10.0, "code": 0o1234,
    "address": 5, "latitude_deg": 50.0, "longitude_deg": 14.0,
}  # fmt: skip


def repeated(*changes: Mapping[str, float]) -> list[bool]:
    rows = [{**SHARED, **one} for one in changes]
    columns = {name: np.array([row[name] for row in rows]) for name in SHARED}
    found: list[bool] = repeated_positions(columns).tolist()
    return found


def test_the_position_of_the_later_category_is_kept() -> None:
    assert repeated({}, {"category": 20}) == [True, False]
    assert repeated({"category": 20}, {}) == [False, True]
    assert repeated() == []


def test_what_differs_is_another_position() -> None:
    later = {"category": 20}
    for name, value in (
        ("source", 8), ("time_s", 10.5), ("code", 0o1235), ("address", 6),
        ("latitude_deg", 50.0 + 1.5 * SAME_POSITION_DEG),
        ("longitude_deg", 14.0 - 1.5 * SAME_POSITION_DEG),
        ("kind", KINDS.index("bearing")), ("category", 10),
    ):  # fmt: skip
        assert repeated({}, later | {name: value}) == [False, False], name
    near = {"latitude_deg": 50.0 + 0.5 * SAME_POSITION_DEG}
    assert repeated({}, later | near) == [True, False]


def test_plots_of_radars_are_never_repeated_positions() -> None:
    plot = {"kind": KINDS.index("radar")}
    assert repeated(plot, plot | {"category": 20}, {}, {"category": 20}) == [
        False, False, True, False,
    ]  # fmt: skip
