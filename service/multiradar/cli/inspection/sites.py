"""Sites of the radars of a recording: from a table, from the recording, or solved from it."""

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from multiradar.diagnosis.cross_sensor.site_solving import SolvedSite, solve_sites
from multiradar.diagnosis.plots import Plots, Site
from multiradar.errors import InputError, MissingColumnError
from multiradar_converters.asterix.decoding.editions import source_name
from multiradar_converters.asterix.decoding.local_plane import ReferencePoint
from multiradar_converters.inspection.reports import Reports
from multiradar_converters.inspection.survey import Survey
from multiradar_schemas.inspection import InspectedSite

_DAY_S = 86_400.0
#: Names of the columns of a table of sites; of the heights all that are there are added.
_NUMBERS = (("sac", "sic"), ("source", "sensor"))
_LATITUDE, _LONGITUDE = ("latitude_deg", "lat_deg", "lat"), ("longitude_deg", "lon_deg", "lon")
_HEIGHTS = (("height_m",), ("ground_alt_m", "ssr_electrical_height_m"))


def read_sites(path: Path) -> dict[str, InspectedSite]:
    """Read a table of sites.

    Parameters
    ----------
    path : Path
        CSV with the columns `sac` and `sic` (or `source` and `sensor`), `latitude_deg` and
        `longitude_deg` (or `lat_deg`, `lon_deg`), and `height_m`, or `ground_alt_m` and
        `ssr_electrical_height_m`, whose sum it is; without a height it is 0.

    Returns
    -------
    dict of InspectedSite
        By `SAC-SIC` or `source-sensor`.

    Raises
    ------
    InputError
        The file cannot be read, a column is missing, or a value is not a number in its range.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            rows = list(reader)
            columns = tuple(reader.fieldnames or ())
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        msg = f"{path}: cannot be read as CSV: {error}"
        raise InputError(msg) from error
    numbers = next((pair for pair in _NUMBERS if set(pair) <= set(columns)), None)
    latitude = next((name for name in _LATITUDE if name in columns), None)
    longitude = next((name for name in _LONGITUDE if name in columns), None)
    if numbers is None or latitude is None or longitude is None:
        wanted = (*_NUMBERS[0], _LATITUDE[0], _LONGITUDE[0])
        raise MissingColumnError(str(path), [n for n in wanted if n not in columns], columns)
    heights = next((names for names in _HEIGHTS if set(names) & set(columns)), ())
    found = {}
    for number, row in enumerate(rows, 2):
        name = "-".join((row[one] or "").strip() for one in numbers)
        found[name] = InspectedSite(
            latitude_deg=_number(path, number, row, latitude, 90.0),
            longitude_deg=_number(path, number, row, longitude, 180.0),
            height_m=sum(_number(path, number, row, one, 9_000.0) for one in heights),
            source=f"{path.name}",
        )
    return found


def reference_sites(references: Mapping[int, ReferencePoint]) -> dict[str, InspectedSite]:
    """Return reference points given by an option as sites by `SAC-SIC`."""
    return {
        source_name(source): InspectedSite(
            latitude_deg=point.latitude_deg,
            longitude_deg=point.longitude_deg,
            height_m=0.0,
            source="--reference",
        )
        for source, point in references.items()
    }


def references_of_sites(sites: Mapping[str, InspectedSite]) -> dict[int, ReferencePoint]:
    """Return the sites of a table as reference points of the local coordinates of their sources."""
    found = {}
    for name, one in sites.items():
        codes = [int(part) for part in name.split("-") if part.isdigit()]
        if len(codes) == len(name.split("-")) == 2 and max(codes) <= 255:
            found[codes[0] << 8 | codes[1]] = ReferencePoint(one.latitude_deg, one.longitude_deg)
    return found


def _number(path: Path, line: int, row: Mapping[str, str | None], name: str, most: float) -> float:
    text = (row.get(name) or "").strip()
    try:
        value = float(text) if text or name in {*_LATITUDE, *_LONGITUDE} else 0.0
    except ValueError:
        value = np.nan
    if not abs(value) <= most:
        msg = f"{path}:{line}: {name}: expected a number from {-most:g} to {most:g}, was {text!r}"
        raise InputError(msg)
    return value


def solved_sites(survey: Survey, known: Mapping[str, InspectedSite]) -> dict[str, InspectedSite]:
    """Return unknown sites, if the recording determines them.

    Parameters
    ----------
    survey : Survey
        What the recording contains.
    known : mapping
        Known sites by name.

    Returns
    -------
    dict of InspectedSite
        By name, each with its sigma.
    """
    samples = {key: one.sample.reports() for key, one in survey.sensors.items()}
    dated = any(len(one) and np.nanmax(one.time_s) >= 366 * _DAY_S for one in samples.values())
    plots = {key: plots_of_reports(one, of_day=dated) for key, one in samples.items() if len(one)}
    sites: dict[str, Site] = {
        name: (
            float(np.radians(one.latitude_deg)),
            float(np.radians(one.longitude_deg)),
            one.height_m,
        )
        for name, one in known.items()
    }
    solved = solve_sites(
        {name: one for (name, kind), one in plots.items() if kind == "radar"},
        {f"{name} ({kind})": one for (name, kind), one in plots.items() if kind != "radar"},
        sites,
    )
    return {name: _documented(one) for name, one in solved.items()}


def plots_of_reports(reports: Reports, *, of_day: bool) -> Plots:
    """Return reports as plots by time.

    Parameters
    ----------
    reports : Reports
        The reports.
    of_day : bool
        Whether to reduce times to those of day.
    """
    time_s = reports.time_s % _DAY_S if of_day else reports.time_s
    order = np.argsort(time_s, kind="stable")
    own = reports.select(order)
    track = np.full(len(own), -1)
    return Plots(
        time_s=time_s[order],
        range_m=own.range_m,
        azimuth_deg=own.azimuth_deg,
        latitude_deg=own.latitude_deg,
        longitude_deg=own.longitude_deg,
        height_m=own.height_m,
        keys=np.stack([track, own.address, own.code], axis=1),
    )


def _documented(one: SolvedSite) -> InspectedSite:
    latitude, longitude, height = one.site
    return InspectedSite(
        latitude_deg=float(np.degrees(latitude)),
        longitude_deg=float(np.degrees(longitude)),
        height_m=height,
        sigma_m=one.sigma_m,
        source=(
            f"estimated from {one.plots} plots of {one.aircraft} aircraft with the reference "
            f"{one.reference}, for an assumed antenna height"
        ),
    )
