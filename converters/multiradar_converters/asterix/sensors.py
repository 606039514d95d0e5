"""Sensor identifiers, and `sensors.toml`."""

import math
from collections import Counter

from multiradar_converters.asterix.decoding.editions import source_name
from multiradar_converters.asterix.decoding.targets import SURFACE
from multiradar_converters.asterix.decoding.timing import KINDS
from multiradar_converters.asterix.report import Findings
from multiradar_converters.asterix.reported_biases import prior_lines
from multiradar_converters.scan_period import preferred_period
from multiradar_converters.sensors_template import (
    MIDDLE_OF_REPORTS,
    REFERENCE_POINT,
    FoundSensor,
    sensors_text,
)
from multiradar_schemas.sensors.sensor import SensorsFile


class SensorNames:
    """Sensor identifiers by source and kind of measurement.

    Parameters
    ----------
    sensors : SensorsFile or None
        Configured sensors.
    counts : Counter
        Measurements by source and kind.
    """

    def __init__(self, sensors: SensorsFile | None, counts: "Counter[tuple[int, str]]") -> None:
        self.counts = counts
        self._known: dict[tuple[str, str], str] = {
            (name, one.kind): one.id
            for one in (sensors.sensor if sensors else ())
            for name in one.names_by_numbers()
        }

    def of(self, source: int, kind: str) -> str:
        """Return the configured id, else `SAC-SIC`, with the kind if it is not the first."""
        name = source_name(source)
        if (name, kind) in self._known:
            return self._known[name, kind]
        kinds = [one for one in KINDS if (source, one) in self.counts]
        return name if kind == kinds[0] else f"{name}-{kind}"


def sensors_toml(names: SensorNames, findings: Findings) -> str:
    """Write `sensors.toml`.

    Parameters
    ----------
    names : SensorNames
        The sources.
    findings : Findings
        Findings of the recording.

    Returns
    -------
    str
        TOML; usable once the positions of radars that do not report theirs are filled in. Other
        sensors have the middle of their reports as position, because a recording without radars
        needs a reference position for tracking.
    """
    keys = sorted(names.counts)
    text = sensors_text([_found(names, findings, source, kind) for source, kind in keys])
    measured = {source_name(source) for source, _ in keys}
    others = dict.fromkeys(one.sensor_id for one in findings.biases)
    for sensor in (one for one in others if one not in measured):
        lines = prior_lines(findings.biases, sensor)
        if lines:
            text += "\n".join(["", f"# {sensor}: no measurements in this recording", *lines, ""])
    return text


def _found(names: SensorNames, findings: Findings, source: int, kind: str) -> FoundSensor:
    count, identifier = names.counts[source, kind], names.of(source, kind)
    numbered = source >= 0 and not identifier.endswith(f"-{kind}")
    numbers = (("sac", source >> 8), ("sic", source & 255)) if numbered else ()
    found = f"{count} measurement{'' if count == 1 else 's'}"
    antenna = findings.antennas.get(source)
    if kind != "radar":
        site, origin = _reference_or_middle(findings, source, kind, identifier)
        return FoundSensor(identifier, kind, found, numbers, site, origin)
    figures = findings.plot_figures[identifier]
    period_s, period_source = preferred_period(
        math.nan if antenna is None else antenna.period_s, figures.period_s, figures.period_source
    )
    return FoundSensor(
        identifier,
        kind,
        found,
        numbers,
        None if antenna is None else antenna.site,
        "item 034/120: accurate to about 10 m; height above mean sea level",
        period_s,
        period_source,
        figures.range_max_m,
        prior_lines(findings.biases, source_name(source)),
        surface=(SURFACE, source) in findings.records,
    )


def _reference_or_middle(
    findings: Findings, source: int, kind: str, identifier: str
) -> tuple[tuple[float, float, float] | None, str]:
    antenna = findings.antennas.get(source)
    if kind == "mlat" and antenna is not None and antenna.site is not None:
        return antenna.site, REFERENCE_POINT
    if kind == "mlat" and source in findings.references:
        return (*findings.references[source], 0.0), REFERENCE_POINT
    if identifier not in findings.middles:
        return None, REFERENCE_POINT
    return (*findings.middles[identifier], 0.0), MIDDLE_OF_REPORTS
