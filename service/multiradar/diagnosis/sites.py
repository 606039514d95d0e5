"""Sites of a sensors file that cannot all be right, or that the tracks of a run contradict."""

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import seen_from
from multiradar.diagnosis.cross_sensor.hypotheses import other_sites
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import Site
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.wgs84 import geodetic_to_ecef

#: Sensors that are farther than this from all others cannot work together, m.
APART_MAX_M = 3_000_000.0
#: Radars nearer to each other than this have heights within this of each other, m.
ONE_PLACE_M, HEIGHTS_APART_MAX_M = 200.0, 300.0


def check_sites(sensors: SensorTable) -> str | None:
    """Return a message about a site far from all others, or of two heights; None without one.

    Parameters
    ----------
    sensors : SensorTable
        The sensors; those without a site do not count.
    """
    sited = np.flatnonzero(np.isfinite(sensors.latitude_rad)).tolist()
    where = {one: _site(sensors, one) for one in sited}
    for number in sited:
        others = [where[one] for one in sited if one != number]
        if not others or _nearest_m(where[number], others) <= APART_MAX_M:
            continue
        name = sensors.ids[number]
        latitude, longitude = np.degrees(where[number][:2])
        far = f"{name}: its site ({latitude:.4f}, {longitude:.4f}) is " + (
            f"{_nearest_m(where[number], others) / 1e3:.0f} km from the site of any other sensor"
        )
        right = [
            one
            for one in other_sites(where[number], {})
            if _nearest_m(one.site, others) <= APART_MAX_M / 2.0
        ]
        why = f": {right[0].mistake}" if right else ""
        return f"{far}{why}; correct latitude_deg and longitude_deg in the sensors file"
    return _two_heights(sensors)


def check_displaced(evidence: Evidence, name: str) -> Diagnosis | None:
    """Diagnose a site by the innovations of the tracks, where no other sensor is compared with it.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    name : str
        The radar.
    """
    apart_m = evidence.displaced.get(name, 0.0)
    # The tracks of a radar alone are displaced like its plots.
    others = [one for one in evidence.sensors.ids if one != name and one in evidence.sources]
    if not apart_m > 0.0 or not others:
        return None
    return Diagnosis(
        name,
        "site",
        f"{name}: its site is probably wrong, by at least {apart_m / 1e3:.2f} km: its plots differ "
        "from the tracks as those of a displaced site do (alarm site); check latitude_deg, "
        "longitude_deg and height_m in the sensors file, and the scale of its azimuths",
        "warning",
    )


# Radars of one place have one mast or hill: a digit too many, or another unit, shows.
def _two_heights(sensors: SensorTable) -> str | None:
    radars = np.flatnonzero(np.asarray(sensors.kinds) == KIND_RADAR).tolist()
    for first in radars:
        for second in radars:
            low, high = (float(sensors.height_m[one]) for one in (first, second))
            if high - low <= HEIGHTS_APART_MAX_M:
                continue
            level = [(*_site(sensors, one)[:2], 0.0) for one in (first, second)]
            if _nearest_m(level[0], level[1:]) <= ONE_PLACE_M:
                return (
                    f"{sensors.ids[second]} and {sensors.ids[first]} are at the same position, "
                    f"but their height_m differs: {high:g} and {low:g}; correct the wrong value"
                )
    return None


def _site(sensors: SensorTable, number: int) -> Site:
    return (
        float(sensors.latitude_rad[number]),
        float(sensors.longitude_rad[number]),
        float(np.nan_to_num(sensors.height_m[number])),
    )


def _nearest_m(site: Site, others: list[Site]) -> float:
    positions = geodetic_to_ecef(*(np.array(column) for column in zip(*others, strict=True)))
    return float(seen_from(site, positions)[0].min())
