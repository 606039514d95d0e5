"""The result of an inspection: documented figures, and a suggestion for `sensors.toml`."""

import dataclasses
import datetime as dt
import math
from collections import Counter
from collections.abc import Mapping
from importlib.metadata import version

import numpy as np

from multiradar_converters.aircraft_data.figures import DataFigures
from multiradar_converters.asterix.decoding.editions import source_name
from multiradar_converters.asterix.decoding.sensor_clocks import (
    clock_alarm,
    joined,
    receiver_zone_s,
    sensor_clocks,
)
from multiradar_converters.asterix.decoding.targets import SURFACE
from multiradar_converters.asterix.reported_biases import in_order, reported_biases
from multiradar_converters.inspection.sensor_figures import GAPS_MAX, SECTORS, SensorFigures
from multiradar_converters.inspection.survey import SensorKey, Survey
from multiradar_converters.scan_period import preferred_period
from multiradar_converters.sensors_template import (
    FROM_PLOTS,
    MIDDLE_OF_REPORTS,
    REFERENCE_POINT,
    FoundSensor,
    middle_of_reports,
    sensors_text,
)
from multiradar_schemas.inspection import (
    InspectedBias,
    InspectedCategory,
    InspectedClock,
    InspectedData,
    InspectedFile,
    InspectedGap,
    InspectedRejects,
    InspectedSensor,
    InspectedSite,
    Inspection,
)
from multiradar_schemas.report import Counts

#: Kinds in the order in which a name without its kind is assigned.
_KINDS = ("radar", "mlat", "adsb")
_STATUS, _STATED_REFERENCE = 19, "items 019/600, 610: reference point of the local coordinates"
_STATED_SITE = "item 034/120: accurate to about 10 m; height above mean sea level"
_REVOLUTION_DEG = 360
_DATED_FROM_S = 366 * 86_400.0


def clocks_of(survey: Survey) -> dict[str, InspectedClock]:
    """Return clock offset and latency of the sensors with times of reception, by name."""
    clocks = sensor_clocks(joined(survey.differences))
    zone_s = receiver_zone_s(clocks)
    found = {}
    for source, one in clocks.items():
        code, reason = clock_alarm(one, zone_s) or (None, None)
        found[source_name(source)] = InspectedClock(
            clock_offset_s=one.offset_s,
            latency_min_s=_known(one.latency_min_s),
            latency_median_s=_known(one.latency_median_s),
            latency_p99_s=_known(one.latency_p99_s),
            alarm=code,
            reason=reason,
        )
    return found


def sensor_ids(survey: Survey) -> dict[SensorKey, str]:
    """Return the identifier of each sensor, as the conversions name them."""
    ids = {}
    for name, kind in survey.sensors:
        kinds = [one for one in _KINDS if (name, one) in survey.sensors]
        ids[name, kind] = name if kind == kinds[0] else f"{name}-{kind}"
    return ids


def stated_sites(survey: Survey) -> dict[str, InspectedSite]:
    """Return the positions that radars report themselves, by their name."""
    found = {}
    for name, antenna in survey.antennas.items():
        if antenna.site is not None:
            latitude, longitude, height = antenna.site
            source = _STATED_REFERENCE if (_STATUS, name) in survey.categories else _STATED_SITE
            found[name] = InspectedSite(
                latitude_deg=latitude, longitude_deg=longitude, height_m=height, source=source
            )
    return found


def inspection_of(survey: Survey, sites: Mapping[str, InspectedSite]) -> Inspection:
    """Return the result of an inspection.

    Parameters
    ----------
    survey : Survey
        What the recordings contain.
    sites : mapping
        Positions of radars by name.

    Returns
    -------
    Inspection
        Figures and suggestion.
    """
    ids = sensor_ids(survey)
    clocks = clocks_of(survey)
    keys = sorted(survey.sensors, key=lambda key: (_KINDS.index(key[1]), _numbers(key[0]), key))
    sensors = [
        _sensor(survey, key, ids[key]).model_copy(
            update={
                "site": _site_of(key, survey, sites),
                "clock": clocks.get(key[0]),
            }
        )
        for key in keys
    ]
    times = [(one.first_s, one.last_s) for one in sensors if one.last_s is not None]
    # Beside times with a date, times of day cannot be compared.
    times = [one for one in times if one[1] >= _DATED_FROM_S] or times
    firsts = [first for first, _ in times if first is not None]
    lasts = [last for _, last in times]
    start = survey.start_s
    return Inspection(
        version=version("multiradar"),
        counts=_counts(survey),
        files=[
            InspectedFile(
                file=one.file,
                form=one.form,
                bytes=one.size,
                read=one.read,
                rejected=one.rejected,
                quarantined_bytes=one.octets["quarantined"] if one.octets else None,
            )
            for one in survey.files
        ],
        rejects=[
            InspectedRejects(file=one.file, code=code, reason=reason, count=count)
            for one in survey.files
            for (code, reason), count in one.reasons.most_common()
        ],
        categories=[
            InspectedCategory(
                category=f"{category:03d}", sensor=name, edition=one.edition, records=one.records
            )
            for (category, name), one in sorted(
                survey.categories.items(), key=lambda item: (item[0][0], _numbers(item[0][1]))
            )
        ],
        unknown_editions=survey.unknown_editions,
        moved_files=survey.order.moved,
        first_s=min(firsts, default=None),
        last_s=max(lasts, default=None),
        date=None if start is None else dt.datetime.fromtimestamp(start, dt.UTC).date().isoformat(),
        sampled_fraction=survey.sampled,
        system_tracks=survey.system_tracks,
        reported_biases=[
            InspectedBias(**dataclasses.asdict(one))
            for one in reported_biases(in_order(survey.reported))
        ],
        sensors=sensors,
        sensors_toml=sensors_text(
            [_found(one, key, survey) for key, one in zip(keys, sensors, strict=True)]
        ),
    )


def _site_of(
    key: SensorKey, survey: Survey, sites: Mapping[str, InspectedSite]
) -> InspectedSite | None:
    """Return the site of a radar, or the reference point of local coordinates."""
    used = key[1] == "radar" or (key[1] == "mlat" and survey.sensors[key].local > 0)
    return sites.get(key[0]) if used else None


def _numbers(name: str) -> list[int]:
    return [int(part) for part in name.split("-") if part.isdigit()]


def _counts(survey: Survey) -> Counts:
    total = Counter[str]()
    for one in survey.files:
        total.update(read=one.read, rejected=one.rejected, duplicate=one.duplicates)
    total["accepted"] = total["read"] - total["rejected"] - total["duplicate"]
    return Counts(**{name: total[name] for name in ("read", "accepted", "rejected", "duplicate")})


def _scan_period(survey: Survey, key: SensorKey, figures: SensorFigures) -> tuple[float, str]:
    if key[1] != "radar":
        return math.nan, ""
    antenna = survey.antennas.get(key[0])
    period_s, why = figures.scan_period()
    stated_s = math.nan if antenna is None else antenna.period_s
    return preferred_period(stated_s, period_s, why or FROM_PLOTS)


def _sensor(survey: Survey, key: SensorKey, identifier: str) -> InspectedSensor:
    figures = survey.sensors[key]
    period_s, period_source = _scan_period(survey, key, figures)
    gaps = figures.gaps(period_s)
    longest = sorted(gaps, key=lambda gap: -gap.duration_s)[:GAPS_MAX]
    mean, most = figures.rate_per_s()
    measured = figures.measurements
    empty = np.flatnonzero(~figures.sectors.any(axis=1)) if figures.sectors.any() else ()
    return InspectedSensor(
        sensor_id=identifier,
        kind=key[1],
        reports=figures.reports,
        measurements=measured,
        duplicates=figures.duplicates,
        left_out=dict(sorted(figures.left_out.items())),
        first_s=_known(figures.first_s),
        last_s=_known(figures.last_s),
        mean_per_s=_known(mean),
        max_per_s=_known(most),
        gaps=len(gaps),
        longest_gaps=[
            InspectedGap(first_s=gap.first_s, duration_s=gap.duration_s)
            for gap in sorted(longest, key=lambda gap: gap.first_s)
        ],
        scan_period_s=_known(period_s),
        scan_period_source=period_source,
        range_min_m=_known(figures.range_min_m),
        range_max_m=_known(figures.range_max_m),
        empty_sectors_deg=[int(k) * (_REVOLUTION_DEG // SECTORS) for k in empty],
        height_min_m=_known(figures.height_min_m),
        height_median_m=_known(figures.height_range_m(0.5)),
        height_max_m=_known(figures.height_max_m),
        aircraft=len(figures.addresses) or len(figures.codes),
        located_fraction=_fraction(
            figures.reports - figures.left_out["no_position"] - figures.unreferenced,
            figures.reports,
        ),
        local_fraction=_fraction(figures.local, figures.reports),
        mode_s_fraction=_fraction(figures.with_address, measured),
        mode_3a_fraction=_fraction(figures.with_code, measured),
        height_fraction=_fraction(figures.with_height, measured),
        on_ground_fraction=_fraction(figures.on_ground, measured),
        registers=dict(sorted(figures.registers.items())),
        aircraft_data=_aircraft_data(figures.data),
    )


def _aircraft_data(figures: DataFigures) -> InspectedData | None:
    document = figures.document()
    if not document:
        return None
    return InspectedData.model_validate(
        {name: value for name, value in document.items() if name != "reports"}
    )


def _known(value: float) -> float | None:
    return None if math.isnan(value) else float(value)


def _fraction(part: int, whole: int) -> float | None:
    return part / whole if whole else None


def _found(one: InspectedSensor, key: SensorKey, survey: Survey) -> FoundSensor:
    numbers = key[0].split("-")
    names = (
        ("sac", "sic")
        if any(name == key[0] for _, name in survey.categories)
        else ("source", "sensor")
    )
    site, source = None, ""
    if one.site is not None:
        site = (one.site.latitude_deg, one.site.longitude_deg, one.site.height_m)
        source = one.site.source
        source += "" if one.site.sigma_m is None else f", sigma {one.site.sigma_m:.0f} m"
    elif survey.sensors[key].unreferenced:
        source = REFERENCE_POINT
    elif one.kind != "radar":
        site, source = _middle(survey.sensors[key]), MIDDLE_OF_REPORTS
    count = one.reports
    return FoundSensor(
        identifier=one.sensor_id,
        kind=one.kind,
        found=f"{count} report{'' if count == 1 else 's'}",
        numbers=[(name, int(n)) for name, n in zip(names, numbers, strict=True)]
        if len(numbers) == 2 and one.sensor_id == key[0]
        else (),
        site=site,
        site_source=source,
        rotation_period_s=math.nan if one.scan_period_s is None else one.scan_period_s,
        period_source=one.scan_period_source,
        range_max_m=one.range_max_m or 0.0,
        surface=(SURFACE, key[0]) in survey.categories,
    )


def _middle(figures: SensorFigures) -> tuple[float, float, float] | None:
    sample = figures.sample.reports()
    known = np.isfinite(sample.latitude_deg) & np.isfinite(sample.longitude_deg)
    if not known.any():
        return None
    return (*middle_of_reports(sample.latitude_deg[known], sample.longitude_deg[known]), 0.0)
