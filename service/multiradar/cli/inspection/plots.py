"""Plots of an inspection: map, coverage in azimuth and range, reports by time."""

import math
from collections.abc import Iterator

import numpy as np

from multiradar.cli.inspection.sites import plots_of_reports
from multiradar.diagnosis.plots import Floats, Integers, located, reported
from multiradar.report.content import Plot, Series
from multiradar.report.times import axis_label, is_dated
from multiradar.toolbox.pages.maps import MapPlane, map_plot, site_rings
from multiradar_converters.inspection.document import sensor_ids
from multiradar_converters.inspection.reports import Reports
from multiradar_converters.inspection.survey import Survey
from multiradar_schemas.inspection import InspectedSensor, Inspection

_KILOMETRE_M = 1000.0
_DAY_S = 86_400
#: Points of the line of reports by time.
_STEPS = 300
#: Radars of which the coverage is drawn.
_RADARS_MAX = 12


def inspection_plots(found: Inspection, survey: Survey) -> list[Plot]:
    """Return the plots of an inspection.

    Parameters
    ----------
    found : Inspection
        The result, with sites.
    survey : Survey
        What the recordings contain.

    Returns
    -------
    list of Plot
        The map first; sensors without positions are missing on it.
    """
    keys = {name: key for key, name in sensor_ids(survey).items()}
    samples = {
        one.sensor_id: survey.sensors[keys[one.sensor_id]].sample.reports() for one in found.sensors
    }
    figures = {one.sensor_id: survey.sensors[keys[one.sensor_id]].seconds for one in found.sensors}
    rates = [
        (name, *seconds.counted()) for name, seconds in figures.items() if seconds.counted()[0].size
    ]
    return [*_map(found, samples), *_rates(rates), *_coverage(found, samples)]


def _map(found: Inspection, samples: dict[str, Reports]) -> Iterator[Plot]:
    places = {one.sensor_id: _positions(one, samples[one.sensor_id]) for one in found.sensors}
    places = {name: place for name, place in places.items() if len(place)}
    if not places:
        return
    plane = MapPlane.around(np.concatenate(list(places.values())))
    series = []
    for name, place in places.items():
        local = plane.kilometres(place)
        series.append(Series(name, local[:, 0], local[:, 1], "points", key=name))
    sites = {one.sensor_id: _site(one) for one in found.sensors if one.site is not None}
    series += site_rings(plane, sites)
    missing = [one.sensor_id for one in found.sensors if one.sensor_id not in places]
    caption = (
        f"Sample of the plots on the tangent plane at {plane.place}; rings mark the radar sites."
        + (f" Not shown, because the site is unknown: {', '.join(missing)}." if missing else "")
    )
    yield map_plot("Map", series, caption)


def _site(one: InspectedSensor) -> tuple[float, float, float]:
    if one.site is None:
        msg = f"{one.sensor_id}: missing site"
        raise ValueError(msg)
    latitude, longitude = one.site.latitude_deg, one.site.longitude_deg
    return math.radians(latitude), math.radians(longitude), one.site.height_m


def _positions(one: InspectedSensor, sample: Reports) -> Floats:
    """Return ECEF positions of the plots that have one, m."""
    if not len(sample):
        return np.empty((0, 3))
    plots = plots_of_reports(sample, of_day=False)
    place = reported(plots)
    if one.site is not None:
        azimuth = np.radians(plots.azimuth_deg)
        polar = located(_site(one), plots.range_m, azimuth, plots.heights())
        missing = np.isnan(place).any(axis=1)
        place[missing] = polar[missing]
    return place[~np.isnan(place).any(axis=1)]


def _rates(rates: list[tuple[str, Integers, Integers]]) -> Iterator[Plot]:
    if not rates:
        return
    if len({is_dated(float(second[-1])) for _, second, _ in rates}) > 1:
        # Times with and without a date have the time of day in common.
        rates = [(name, second % _DAY_S, counts) for name, second, counts in rates]
    first = min(int(second.min()) for _, second, _ in rates)
    last = max(int(second.max()) for _, second, _ in rates) + 1
    step_s = max(1, -(-(last - first) // _STEPS))
    edges = np.arange(first, last + step_s, step_s, dtype=np.float64)
    middles = (edges[:-1] + edges[1:]) / 2.0
    series = [
        Series(name, middles, np.histogram(second, edges, weights=counts)[0] / step_s, key=name)
        for name, second, counts in rates
    ]
    yield Plot(
        title="Reports over time",
        x_label=axis_label([edges[0], edges[-1]]),
        y_label="reports per s",
        series=tuple(series),
        x_scale="time",
        caption=f"Means over {step_s} s; gaps are shown as 0.",
        name="rates",
    )


def _coverage(found: Inspection, samples: dict[str, Reports]) -> Iterator[Plot]:
    radars = [one for one in found.sensors if one.range_max_m is not None]
    for one in sorted(radars, key=lambda radar: -radar.reports)[:_RADARS_MAX]:
        sample = samples[one.sensor_id]
        yield Plot(
            title=one.sensor_id,
            x_label="azimuth, °",
            y_label="slant range, km",
            series=(
                Series(
                    one.sensor_id,
                    sample.azimuth_deg,
                    sample.range_m / _KILOMETRE_M,
                    "points",
                    key=one.sensor_id,
                ),
            ),
            group="Radar coverage",
            name=f"coverage-{one.sensor_id}",
        )
