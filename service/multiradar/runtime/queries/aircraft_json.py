"""Live tracks in the form of readsb: `aircraft.json` and `receiver.json`, for tar1090 and others.

Units and names are those of `README-json.md` of readsb: feet, knots, feet per minute, degrees. Keys
without a value are omitted.

================ ================================================================================
a track          is shown as
================ ================================================================================
with an address  its address; a second track with the same one as `~` and its number
without          `~` and its number, six hexadecimal digits, as addresses that are none
tentative        not shown
on the ground    `alt_baro` "ground"
updated by       `adsb_icao` (`adsb_other`) if ADS-B updated it within `SOURCE_S`, else `mlat`, else
                 by radars `tisb_icao` (`tisb_trackfile`): targets tracked on the ground
================ ================================================================================
"""

import json
import threading
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from typing import Any

import numpy as np

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.memory.knowledge import Knowledge, Picture
from multiradar.runtime.memory.live_tracks import BY_ADSB, BY_MLAT
from multiradar_schemas.measurements.units import FOOT_M, KNOT_MPS

#: How long a source that is preferred determines the type, s: three scans of a slow radar.
SOURCE_S = 30.0
#: Interval of requests by clients, ms.
REFRESH_MS = 1000

_NUMBER_MASK = 0xFFFFFF
#: Radius of the 95 % circle in units of the root of the trace of a circular covariance.
_CIRCLE_95 = 1.7308
#: Upper bounds of the 95 % radius of each NACp, m (DO-260B, table 2-14); beyond the last it is 0.
_NAC_P = (
    (3.0, 11), (10.0, 10), (30.0, 9), (92.6, 8), (185.2, 7), (555.6, 6), (926.0, 5),
    (1852.0, 4), (3704.0, 3), (7408.0, 2), (18_520.0, 1),
)  # fmt: skip
#: Values of the tracker, listed in `mlat` and `tisb`.
_ESTIMATED = ("lat", "lon", "nac_p", "gs", "track", "baro_rate")


class AircraftSnapshots:
    """Makes `aircraft.json` once for each state of the tracks, for any thread."""

    def __init__(self, known: Knowledge) -> None:
        self._known = known
        self._made: tuple[int, bytes] = (-1, b"")
        self._lock = threading.Lock()

    def aircraft(self) -> bytes:
        """Return `aircraft.json`."""
        # One client makes it, the others wait: each would take as long.
        with self._lock:
            made_version, text = self._made
            picture = self._known.picture(made_version)
            if picture is None:
                return text
            text = json.dumps(document(picture), separators=(",", ":")).encode()
            self._made = picture.version, text
            return text

    def receiver(self) -> dict[str, Any]:
        """Return `receiver.json`: version, refresh interval, and the middle of the sensors."""
        return receiver(self._known.sensors)


def document(picture: Picture) -> dict[str, Any]:
    """Return `aircraft.json` of a picture.

    Returns
    -------
    dict
        `now`, data time; `messages`, track updates so far; `aircraft`.
    """
    return {
        "now": round(picture.data_time_s, 3),
        "messages": picture.sequence,
        "aircraft": list(_aircraft(picture)),
    }


def receiver(sensors: SensorTable) -> dict[str, Any]:
    """Return `receiver.json`."""
    found: dict[str, Any] = {
        "version": f"multiradar {version('multiradar')}",
        "refresh": REFRESH_MS,
        "history": 0,
    }
    known = np.isfinite(sensors.latitude_rad) & np.isfinite(sensors.longitude_rad)
    if known.any():
        # The mean of complex numbers crosses the antimeridian.
        east = np.angle(np.exp(1j * sensors.longitude_rad[known]).mean())
        found["lat"] = round(float(np.degrees(sensors.latitude_rad[known].mean())), 6)
        found["lon"] = round(float(np.degrees(east)), 6)
    return found


def _aircraft(picture: Picture) -> Iterator[dict[str, Any]]:
    sources, taken = _sources(picture), set[str]()
    rows = picture.tracks.to_dicts()
    # Of two tracks with one address the older one has it.
    for row, source, updates in zip(rows, sources, picture.updates.tolist(), strict=True):
        if row["state"] == "tentative":
            continue
        address = row["mode_s_address"]
        if address in taken:
            address = None
        elif address is not None:
            taken.add(address)
        yield _one(row, address, source, updates)


def _sources(picture: Picture) -> list[int]:
    recent = picture.heard_s >= picture.data_time_s - SOURCE_S
    latest = np.argmax(picture.heard_s, axis=1) if len(recent) else np.empty(0, np.int64)
    preferred = np.where(recent.any(axis=1), np.argmax(recent, axis=1), latest)
    found: list[int] = preferred.tolist()
    return found


def _one(row: Mapping[str, Any], address: str | None, source: int, updates: int) -> dict[str, Any]:
    age_s, height_m, climb_mps = row["age_s"], row["height_m"], row["vertical_rate_mps"]
    kind = _kind(source, with_address=address is not None)
    found: dict[str, Any] = {
        "hex": address or f"~{row['track_id'] & _NUMBER_MASK:06x}",
        "type": kind,
    }
    if row["callsign"] is not None:
        found["flight"] = f"{row['callsign']:<8}"
    if row["on_ground"]:
        found["alt_baro"] = "ground"
    elif height_m is not None:
        found["alt_baro"] = round(height_m / FOOT_M)
    found["gs"] = round(row["speed_mps"] / KNOT_MPS, 1)
    found["track"] = round(row["heading_deg"], 2) % 360.0
    if climb_mps is not None and not row["on_ground"]:
        found["baro_rate"] = round(climb_mps / FOOT_M * 60.0)
    if row["mode_3a"] is not None:
        found["squawk"] = row["mode_3a"]
    found["lat"], found["lon"] = round(row["latitude_deg"], 6), round(row["longitude_deg"], 6)
    found["nac_p"] = _nac_p(row["position_sigma_m"])
    estimated = [name for name in _ESTIMATED if name in found]
    found["seen_pos"] = round(age_s, 3)
    found["mlat"] = estimated if kind == "mlat" else []
    found["tisb"] = estimated if kind.startswith("tisb") else []
    found["messages"] = updates
    found["seen"] = round(age_s, 1)
    return found


def _kind(source: int, *, with_address: bool) -> str:
    if source == BY_ADSB:
        return "adsb_icao" if with_address else "adsb_other"
    if source == BY_MLAT:
        return "mlat"
    return "tisb_icao" if with_address else "tisb_trackfile"


def _nac_p(sigma_m: float) -> int:
    radius_m = _CIRCLE_95 * sigma_m
    return next((category for bound_m, category in _NAC_P if radius_m < bound_m), 0)
