"""Plots of a registration: residuals on maps, by azimuth and range, biases by time."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from multiradar.diagnosis.alignment.cross_validation import SideResiduals, side_of
from multiradar.diagnosis.alignment.pairs import Side
from multiradar.diagnosis.plots import Floats, Site
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, PARAMETER_UNITS
from multiradar.geodesy.wgs84 import enu_rotation, geodetic_to_ecef
from multiradar.report.content import Plot, Series
from multiradar.report.times import axis_label
from multiradar.toolbox.alignment.registration import Registration
from multiradar.toolbox.pages.maps import MapPlane, broken_lines, map_plot, site_rings
from multiradar.toolbox.pages.parameters import parameter_words

_KILOMETRE_M = 1000.0
#: Keys of colours: all plots have the same for before and after.
_BEFORE, _AFTER = "as recorded", "corrected, withheld aircraft"
#: Radars with plots of their own, those with the most pairs.
_RADARS_MAX = 12
#: Cells of a map along its longer side; pairs that a cell needs.
_CELLS, _CELL_PAIRS_MIN = 16, 4
#: Round numbers of a decade.
_ROUND = (1.0, 1.5, 2.0, 3.0, 5.0, 7.5, 10.0)
#: Width of a sector of azimuth, degrees, and pairs that it needs.
_SECTOR_DEG, _SECTOR_PAIRS_MIN = 15.0, 5
_TURN_DEG = 360.0
#: Plots nearer than this fraction of the median distance: their azimuth by others is uncertain.
_NEAR = 0.3
#: The line of a residual of this quantile is one cell long.
_LONG = 0.9
_NORMAL_SPREAD = 1.4826


def alignment_plots(found: Registration) -> list[Plot]:
    """Return the plots of a registration.

    Returns
    -------
    list of Plot
        The map of all radars first.
    """
    radars = [
        number
        for number in range(len(found.sensors))
        if found.sensors.kinds[number] == KIND_RADAR and len(side_of(found.problem, number).rows)
    ]
    sides = {number: side_of(found.problem, number) for number in radars}
    chosen = sorted(radars, key=lambda one: (-len(sides[one].rows), one))[:_RADARS_MAX]
    return [
        *_map(found, sides),
        *_radar_maps(found, {number: sides[number] for number in chosen}),
        *_sectors(found, {number: sides[number] for number in chosen}),
        *_trends(found, chosen),
    ]


def _site(found: Registration, number: int) -> Site:
    table = found.sensors
    return (
        float(table.latitude_rad[number]),
        float(table.longitude_rad[number]),
        float(table.height_m[number]),
    )


def _positions(site: Site, side: Side) -> Floats:
    """Return ECEF positions of plots, m; their height above the site is left out."""
    local = np.column_stack([side.east_m, side.north_m, np.zeros(side.size)])
    return np.asarray(geodetic_to_ecef(*site) + local @ enu_rotation(site[0], site[1]))


def _map(found: Registration, sides: dict[int, SideResiduals]) -> Iterator[Plot]:
    if not sides:
        return
    names = found.sensors.ids
    sites = {names[number]: _site(found, number) for number in sides}
    # Each pair once: at its first radar.
    own = {
        number: _positions(_site(found, number), side.side.select(_first(found, side)))
        for number, side in sides.items()
    }
    rows = np.concatenate([side.rows[_first(found, side)] for number, side in sides.items()])
    places = np.concatenate(list(own.values()))
    plane = MapPlane.around(places)
    lengths = [np.hypot(*one[rows].T) for one in (found.validation.before, found.validation.after)]
    local = plane.kilometres(places)
    width = _width(local)
    cells = _cells(local, width)
    high = _round(float(np.quantile(np.concatenate(lengths), _LONG)))
    series = []
    # The bars of a cell stand side by side.
    for label, length, shift in ((_AFTER, lengths[1], 0.12), (_BEFORE, lengths[0], -0.12)):
        middles, values = _by_cell(cells, width, length)
        if not len(values):
            return
        heights = 0.9 * width * np.minimum(values / high, 1.0)
        feet = middles + width * np.array([shift, -0.45])
        bars = [
            np.array([foot, [foot[0], foot[1] + height]])
            for foot, height in zip(feet, heights, strict=True)
        ]
        series.append(Series(label, *broken_lines(bars), "line", key=label))
    series += site_rings(plane, sites, "ink")
    yield map_plot(
        "Map of residuals",
        series,
        f"Median distance of the pairs in each cell of {width:g} km, shown as a bar; a bar as high "
        f"as the cell represents {high:.0f} m or more. On the tangent plane at {plane.place}; "
        "rings mark the radars.",
        name="residual-map",
    )


def _first(found: Registration, side: SideResiduals) -> NDArray[np.intp]:
    table, pairs = found.sensors, found.problem.pairs
    other = np.where(side.sign > 0, pairs.second_sensor[side.rows], pairs.first_sensor[side.rows])
    return np.flatnonzero((side.sign > 0) | (np.asarray(table.kinds)[other] != KIND_RADAR))


def _width(local: Floats) -> float:
    """Return the side of a cell, km."""
    return _round(max(float(np.ptp(local[:, 0])), float(np.ptp(local[:, 1])), 1e-3) / _CELLS)


def _round(value: float) -> float:
    """Return the next round number."""
    decade = 10.0 ** np.floor(np.log10(value))
    return float(next(step * decade for step in _ROUND if step * decade >= value * (1.0 - 1e-9)))


def _cells(local: Floats, width: float) -> Floats:
    return np.floor(local / width)


def _by_cell(cells: Floats, width: float, values: Floats) -> tuple[Floats, Floats]:
    """Return the middle (n, 2) of each cell with enough pairs, km, and the median of values."""
    distinct, place, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    place = place.reshape(-1)
    kept = np.flatnonzero(counts >= _CELL_PAIRS_MIN)
    middles = (distinct[kept] + 0.5) * width
    medians = [np.median(values[place == one], axis=0) for one in kept.tolist()]
    return middles, np.array(medians)


def _radar_maps(found: Registration, sides: dict[int, SideResiduals]) -> Iterator[Plot]:
    if not sides:
        return
    local = {
        number: np.column_stack([one.side.east_m, one.side.north_m]) / _KILOMETRE_M
        for number, one in sides.items()
    }
    # One scale for all radars.
    width = _width(np.concatenate([np.concatenate([one, -one]) for one in local.values()]))
    cells = {number: _cells(one, width) for number, one in local.items()}
    before, after = (
        {
            number: _by_cell(cells[number], width, one[side.rows] * side.sign[:, None])
            for number, side in sides.items()
        }
        for one in (found.validation.before, found.validation.after)
    )
    lengths = np.concatenate([np.hypot(*one[1].reshape(-1, 2).T) for one in before.values()])
    if not len(lengths):
        return
    long_m = _round(max(float(np.quantile(lengths, _LONG)), 1.0))
    for number in sides:
        if not len(before[number][0]):
            continue
        series = []
        for label, (middles, values) in ((_AFTER, after[number]), (_BEFORE, before[number])):
            lines = [
                np.stack([middle, middle + width / long_m * value])
                for middle, value in zip(middles, values, strict=True)
            ]
            series.append(Series(label, *broken_lines(lines), "line", key=label))
        middles = after[number][0]
        series += [
            Series("", middles[:, 0], middles[:, 1], "points", key="ink"),
            Series("", np.zeros(1), np.zeros(1), "rings", key="ink"),
        ]
        yield map_plot(
            found.sensors.ids[number],
            series,
            f"Cells of {width:g} km; lines point from the aircraft to the position measured by "
            f"this radar; a line as long as a cell represents a median residual of {long_m:.0f} m.",
            name=f"residuals-{found.sensors.ids[number]}",
            group="Residuals by position",
        )


def _sectors(found: Registration, sides: dict[int, SideResiduals]) -> Iterator[Plot]:
    for what, place, factor, unit in (
        ("Range residuals by azimuth", 0, 1.0, "range, m"),
        ("Azimuth residuals by azimuth", 1, float(np.degrees(1.0)), "azimuth, °"),
    ):
        for number, side in sides.items():
            far = side.side.ground_m >= _NEAR * np.median(side.side.ground_m)
            azimuth = np.degrees(side.side.azimuth_rad[far]) % _TURN_DEG
            series = []
            for label, residual in (
                (_AFTER, found.validation.after), (_BEFORE, found.validation.before),
            ):  # fmt: skip
                values = side.polar(residual)[place][far] * factor
                middles, medians, sigmas = _by_sector(azimuth, values)
                if len(middles):
                    series += [
                        Series("", middles, medians - sigmas, "band", medians + sigmas, label),
                        Series(label, middles, medians, "line", key=label),
                    ]
            if series:
                zero = Series("", np.array([0.0, _TURN_DEG]), np.zeros(2), "reference")
                yield Plot(
                    title=found.sensors.ids[number],
                    x_label="azimuth of the plot, °",
                    y_label=unit,
                    series=(zero, *series),
                    x_limits=(0.0, _TURN_DEG),
                    caption=(
                        f"Medians per {_SECTOR_DEG:g}° sector with their sigma; plots beyond "
                        f"{_NEAR * np.median(side.side.ground_m) / _KILOMETRE_M:.0f} km."
                    ),
                    group=what,
                    name=f"{unit.split(',')[0]}-{found.sensors.ids[number]}",
                )


def _by_sector(azimuth_deg: Floats, values: Floats) -> tuple[Floats, Floats, Floats]:
    """Return middles of sectors, their medians and the sigma of these; NaN where few."""
    sectors = np.floor(azimuth_deg / _SECTOR_DEG).astype(np.int64)
    count = round(_TURN_DEG / _SECTOR_DEG)
    medians, sigmas = np.full(count, np.nan), np.full(count, np.nan)
    for one in range(count):
        own = values[sectors == one]
        if len(own) >= _SECTOR_PAIRS_MIN:
            medians[one] = np.median(own)
            spread = _NORMAL_SPREAD * np.median(np.abs(own - medians[one]))
            # The median of normal numbers has π/2 times the variance of their mean.
            sigmas[one] = spread * np.sqrt(np.pi / 2.0 / len(own))
    middles = (np.arange(count) + 0.5) * _SECTOR_DEG
    if not np.isfinite(medians).any():
        return np.empty(0), np.empty(0), np.empty(0)
    return np.asarray(middles), medians, sigmas


def _trends(found: Registration, radars: list[int]) -> Iterator[Plot]:
    table, own = found.sensors, found.trend
    for kind, parameter in enumerate(PARAMETER_NAMES):
        factor = 1.0 / PARAMETER_UNITS[kind]
        for column in np.flatnonzero(np.asarray(table.parameter_kind) == kind).tolist():
            number = int(table.parameter_sensor[column])
            if not np.isfinite(own.estimate[:, column]).any() or (
                table.kinds[number] == KIND_RADAR and number not in radars
            ):
                continue
            whole = found.whole.estimate[column]
            middle = (own.estimate[:, column] - whole) * factor
            sigma = own.sigma[:, column] * factor
            ends = np.array([own.time_s[0], own.time_s[-1]])
            # Each radar has its own scale: an uncertain one would hide the others.
            high = 1.2 * float(np.nanmax(np.abs(middle) + sigma))
            name, unit = parameter_words(parameter)
            mean = f"{whole * factor:.4g}".replace("-", "−")
            yield Plot(
                title=table.ids[number],
                x_label=axis_label(own.time_s),
                y_label=f"{name} minus its mean{unit}",
                series=(
                    Series("", ends, np.zeros(2), "reference"),
                    Series("± sigma", own.time_s, middle - sigma, "band", middle + sigma, _AFTER),
                    Series("per interval", own.time_s, middle, "line", key=_AFTER),
                ),
                x_scale="time",
                y_limits=(-high, high),
                caption=f"Mean over the recording: {mean}{unit.lstrip(',')}.",
                group=f"{name.capitalize()} over time",
                name=f"trend-{parameter}-{table.ids[number]}",
            )
