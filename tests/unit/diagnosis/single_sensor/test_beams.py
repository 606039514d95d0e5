"""Azimuths in another form, by the direction of the antenna, with and without clutter."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from multiradar.diagnosis.plots import Floats, Plots
from multiradar.diagnosis.single_sensor.beams import check_azimuth_form
from support.scenarios.rotating import rotating_plots

PERIOD_S = 5.0
#: Plots of clutter come at any time.
SCENES = [
    {"seed": 1},
    {"seed": 2, "aircraft": 10},
    {"seed": 3, "clutter_share": 0.15},
    {"seed": 4, "clutter_share": 0.6},
    {"seed": 5, "clutter_share": 0.1, "identified": False},
]
FORMS: dict[str, tuple[Callable[[Floats], Floats], str]] = {
    "anticlockwise": (lambda azimuth: (360.0 - azimuth) % 360.0, "azimuth_anticlockwise"),
    "radians": (np.radians, "azimuth_unit"),
    "gradians": (lambda azimuth: azimuth / 0.9, "azimuth_unit"),
    "half": (lambda azimuth: azimuth / 2.0, "azimuth_factor"),
    "modulo 180": (lambda azimuth: azimuth % 180.0, "azimuth_folded"),
    "on either side": (lambda azimuth: np.minimum(azimuth, 360.0 - azimuth), "azimuth_folded"),
    "minutes": (lambda azimuth: np.floor(azimuth) + 0.6 * (azimuth % 1.0), "azimuth_minutes"),
}


def _code(plots: Plots, period_s: float = PERIOD_S) -> str:
    found = check_azimuth_form("1-10", plots, period_s)
    return "" if found is None else found.code


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("form", FORMS)
def test_each_form_is_named_in_spite_of_clutter(scene: dict[str, float], form: str) -> None:
    plots = rotating_plots(**scene)  # type: ignore[arg-type]  # by name
    function, code = FORMS[form]
    assert _code(replace(plots, azimuth_deg=function(plots.azimuth_deg))) == code


@pytest.mark.parametrize("scene", SCENES)
def test_right_azimuths_are_right(scene: dict[str, float]) -> None:
    plots = rotating_plots(**scene)  # type: ignore[arg-type]  # by name
    assert _code(plots) == _code(plots, np.nan) == ""


@pytest.mark.parametrize("seed", range(4))
def test_times_that_do_not_follow_the_antenna_show_nothing(seed: int) -> None:
    plots = rotating_plots(seed=seed, clutter_share=0.2)
    of_scan = replace(plots, time_s=np.floor(plots.time_s / PERIOD_S) * PERIOD_S)
    assert _code(of_scan) == ""


@pytest.mark.parametrize("clutter_share", [0.0, 0.3])
def test_a_radar_of_half_a_circle_is_right(clutter_share: float) -> None:
    plots = rotating_plots(aircraft=40, clutter_share=clutter_share, seed=8)
    east = plots.select(plots.azimuth_deg <= 180.0)
    assert _code(east) == ""
    assert _code(replace(east, keys=np.full_like(east.keys, -1))) == ""


def test_one_aircraft_shows_no_direction() -> None:
    plots = rotating_plots(aircraft=1, seed=6, duration_s=600.0)
    assert _code(replace(plots, azimuth_deg=(360.0 - plots.azimuth_deg) % 360.0)) == ""


@pytest.mark.parametrize("seed", range(6))
def test_a_few_aircraft_on_one_side_are_right(seed: int) -> None:
    plots = rotating_plots(aircraft=10, seed=seed)
    east = plots.select(plots.azimuth_deg < 120.0)
    random = np.random.default_rng(seed)
    assert _code(east.select(random.random(east.size) < 0.75)) == ""


def _in_parts(parts: int, largest: float = 0.58, *, more: float = 0.0, count: int = 120) -> str:
    """Return what is found of azimuths whose decimal parts are so many, up to the largest one."""
    rows = np.arange(count)
    azimuth_deg = rows % 40 + np.linspace(0.0, largest, parts)[rows % parts]
    azimuth_deg[-1] = 40.0 + (more or azimuth_deg[-1] % 1.0)
    missing = np.full(count, np.nan)
    keys = np.full((count, 3), -1, np.int64)
    return _code(
        Plots(np.arange(float(count)), missing, azimuth_deg, missing, missing, missing, keys)
    )


@pytest.mark.parametrize(
    ("code", "known"),
    [
        (_in_parts(30), True),
        (_in_parts(29), False),
        (_in_parts(30, 0.551), True),
        (_in_parts(30, 0.549), False),
        (_in_parts(30, more=0.6), True),
        (_in_parts(30, more=0.601), False),
        (_in_parts(30, count=100), True),
        (_in_parts(30, count=99), False),
    ],
)
def test_decimal_parts_are_minutes_where_30_of_them_end_at_60(code: str, *, known: bool) -> None:
    assert (code == "azimuth_minutes") is known
