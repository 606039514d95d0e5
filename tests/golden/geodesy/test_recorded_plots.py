"""The sample recording places its own plots; we must place them there too.

Each line of `plots.txt` has the raw range and azimuth, and the latitude and longitude that the
recording system made of them with the biases it believed in (`known_bias_…` in `truth.json`). It
was written by other software with its own geodesy: an independent reference for slant range, radar
azimuth, the plane and their inverse.
"""

import json
import math

import numpy as np
import pytest

from multiradar.estimation.measurement.cone_of_silence import outside_cone
from multiradar.geodesy import _kernels as kernels
from multiradar.geodesy.system_plane import SystemPlane
from support.paths import SAMPLE

# The file rounds to 0.1 m, 0.0001° (0.5 m at 280 km) and 1e-7°.
LINE_MAX_M = 0.6
MEDIAN_MAX_M = 0.1


Plot = tuple[tuple[int, int], list[float]]


def good_plots() -> list[Plot]:
    """(source, sensor) and range m, azimuth, latitude, longitude degrees, height m of whole lines.

    The sample breaks some lines on purpose; the converter's tests count them.
    """
    plots = []
    for line in (SAMPLE / "plots.txt").read_text("ascii").splitlines()[1:]:
        fields = line.split("\t")
        try:
            radar, numbers = (int(fields[1]), int(fields[2])), [float(one) for one in fields[4:9]]
        except (ValueError, IndexError):
            continue
        whole = len(numbers) == 5 and len(fields) <= 10 and bool(np.isfinite(numbers).all())
        if whole and abs(numbers[2]) < 90.0:
            plots.append((radar, numbers))
    return plots


def test_plots_lie_where_the_recording_puts_them() -> None:
    truth = json.loads((SAMPLE / "truth.json").read_text("utf-8"))
    radars = {(one["source"], one["sensor"]): one for one in truth["radars"]}
    plane = SystemPlane.for_sensors(
        np.radians([one["lat"] for one in radars.values()]),
        np.radians([one["lon"] for one in radars.values()]),
    ).parameters
    sites = {
        key: kernels.site_parameters(
            plane, math.radians(one["lat"]), math.radians(one["lon"]), one["h"]
        )
        for key, one in radars.items()
    }
    misses = []
    for key, (slant, azimuth, latitude, longitude, height) in good_plots():
        radar = radars[key]
        corrected = slant - radar["known_bias_range"]
        ground = math.sqrt(max(0.0, corrected**2 - (height - radar["h"]) ** 2))
        if not outside_cone(ground, height, radar["h"]):
            continue  # Above the radar a metre of range is many of ground.
        ok, east, north = kernels.locate_polar(
            plane,
            sites[key],
            corrected,
            math.radians(azimuth - radar["known_bias_azimuth_deg"]),
            height,
        )
        assert ok
        expected = kernels.geodetic_to_plane(plane, math.radians(latitude), math.radians(longitude))
        misses.append(math.hypot(east - expected[0], north - expected[1]))
    assert len(misses) > 20_000
    assert max(misses) < LINE_MAX_M
    assert np.median(misses) == pytest.approx(0.0, abs=MEDIAN_MAX_M)
