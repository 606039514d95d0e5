"""Names of sensors, and the skeleton of `sensors.toml`."""

from collections import Counter

from multiradar_converters.asterix.editions import source_name
from multiradar_converters.asterix.report import Findings
from multiradar_converters.asterix.timing import KINDS
from multiradar_schemas.sensor import SensorsFile


class SensorNames:
    """Identifiers of sources by what they measure.

    Parameters
    ----------
    sensors : SensorsFile or None
        Sensors that the user described.
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
        """Return the id: as the user says, else `SAC-SIC`, with the kind if it is not the first."""
        name = source_name(source)
        if (name, kind) in self._known:
            return self._known[name, kind]
        kinds = [one for one in KINDS if (source, one) in self.counts]
        return name if kind == kinds[0] else f"{name}-{kind}"


def sensors_toml(names: SensorNames, findings: Findings) -> str:
    """Write the skeleton.

    Parameters
    ----------
    names : SensorNames
        The sources.
    findings : Findings
        What the recording says of them.

    Returns
    -------
    str
        TOML; it can be loaded once the positions of the radars are filled in. Other sensors have
        the middle of their reports, for a recording without radars needs a place to track at.
    """
    parts = [
        "# Sensors found in the recording. Fill in the position of each radar (WGS 84) and take\n"
        "# the comment marks of these lines away; the other values are defaults to be improved.\n"
    ]
    for source, kind in sorted(names.counts):
        count = names.counts[source, kind]
        identifier = names.of(source, kind)
        parts.append(f'\n[[sensor]]\nid = "{identifier}"\nkind = "{kind}"\n')
        if source >= 0 and not identifier.endswith(f"-{kind}"):
            parts.append(f"sac = {source >> 8}\nsic = {source & 255}\n")
        parts.append(f"# {count} measurement{'' if count == 1 else 's'}\n")
        if kind == "radar":
            parts.append(_antenna(findings, source))
        else:
            latitude, longitude = findings.middles[identifier]
            parts.append(
                "# the middle of its reports, for a plane to track in\n"
                f"latitude_deg = {latitude:.2f}\n"
                f"longitude_deg = {longitude:.2f}\n"
                "height_m = 0.0\n"
            )
    return "".join(parts)


def _antenna(findings: Findings, source: int) -> str:
    turned = findings.turned.get(source)
    lines = []
    if turned is not None and turned.turn_s == turned.turn_s:
        lines.append(f"rotation_period_s = {turned.turn_s:.3f}\n")
    if turned is not None and turned.site is not None:
        latitude, longitude, height = turned.site
        lines.append(
            f"# as item 034/120 says, to 10 m or so and above mean sea level\n"
            f"# latitude_deg = {latitude:.6f}\n"
            f"# longitude_deg = {longitude:.6f}\n"
            f"# height_m = {height:.0f}\n"
        )
    else:
        lines.append("# latitude_deg =\n# longitude_deg =\n# height_m =\n")
    return "".join(lines)
