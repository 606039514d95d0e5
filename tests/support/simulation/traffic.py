"""Aircraft on straight lines, as three sensors report them over HTTP and one as ASTERIX."""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import polars as pl

from multiradar.geodesy.polar import slant_range_azimuth
from multiradar_schemas.measurements.columns import complete
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile
from support.asterix.octets import block, plot_048

START_S = 1_700_000_000.0
DAY_S = 86_400.0
#: Each sensor sends what it has seen so often, s.
SECTOR_S = 2.0
SCAN_S = 4.0
AIRCRAFT = 8
#: Sites by sensor; the last radar sends ASTERIX.
SITES = {
    "41-10": (50.0, 14.0, 400.0),
    "41-20": (49.2, 16.5, 300.0),
    "41-30": (50.6, 16.0, 500.0),
}
ADSB = "adsb"
DATAGRAMS = "41-30"
#: Sender of its datagrams.
RECORDER = "192.0.2.30"
#: Sensors whose messages come over HTTP, and the form of their bodies.
MEDIA = {
    "41-10": "application/json",
    "41-20": "application/x-ndjson",
    ADSB: "application/vnd.apache.arrow.stream",
}
PLOTS_PER_SCAN_MAX = 60

Row = dict[str, Any]
#: Called when a fault takes effect.
Occurred = Callable[[], None]


@dataclass(slots=True)
class Message:
    """A message of a sender: what it has, and what has become of it.

    Attributes
    ----------
    sender : str
        The client, by the name of its key.
    key : str
        Idempotency key.
    media : str
        Media type of the body.
    body : bytes
        The body.
    rows : list of dict
        Its rows; empty of a body that is not made of rows.
    due_s : float
        When it is first sent, s after the start.
    expected : str
        `ack`; `error` where the whole message must be rejected; `any` otherwise.
    path : str
        Where it is sent.
    receipts : list of dict
        Receipts that the service gave.
    acknowledged_s : float
        When the service had it first, s after the start.
    arrived, done : bool
        Whether a process has received it, and whether its sender has the final answer.
    effects : list of callable
        Faults that have taken effect when its sender has the final answer.
    """

    sender: str
    key: str
    media: str
    body: bytes
    rows: list[Row]
    due_s: float
    expected: str = "ack"
    path: str = "/v1/measurements"
    receipts: list[dict[str, Any]] = field(default_factory=list)
    acknowledged_s: float = np.inf
    arrived: bool = False
    done: bool = False
    effects: list[Occurred] = field(default_factory=list)


def sensors(sites: dict[str, tuple[float, float, float]]) -> SensorsFile:
    """Return three radars at these sites, and ADS-B."""
    radars = [
        {
            "id": name, "kind": "radar", "latitude_deg": site[0], "longitude_deg": site[1],
            "height_m": site[2], "rotation_period_s": SCAN_S,
            "plots_per_scan_max": PLOTS_PER_SCAN_MAX,
        }
        for name, site in sites.items()
    ]  # fmt: skip
    positions = {"id": ADSB, "kind": "adsb", "plots_per_scan_max": PLOTS_PER_SCAN_MAX}
    every = [Sensor.model_validate(one) for one in [*radars, positions]]
    return SensorsFile(sensor=tuple(every))


def plots(seed: int, duration_s: float) -> dict[str, list[Row]]:
    """Return what each sensor sees of all aircraft, by time."""
    random = np.random.default_rng(seed)
    found = {}
    for sensor in (*SITES, ADSB):
        period_s = 2.0 if sensor == ADSB else SCAN_S
        scans = int(duration_s // period_s)
        number = np.tile(np.arange(AIRCRAFT), scans)
        time_s = np.repeat(np.arange(scans) * period_s, AIRCRAFT)
        time_s = np.round(time_s + (number + 0.5) * period_s / AIRCRAFT, 3)
        latitude = 49.5 + 0.08 * number + 0.0002 * (number - 2) * time_s
        longitude = 15.0 + 0.09 * number + 0.002 * time_s
        height = (250 + 10 * number) * 30.48
        rows: list[Row] = [
            {"time_s": START_S + at, "sensor_id": sensor, "kind": "radar", **identity(int(one))}
            for at, one in zip(time_s.tolist(), number, strict=True)
        ]
        if sensor == ADSB:
            for row, one, other in zip(rows, latitude.tolist(), longitude.tolist(), strict=True):
                row |= {"kind": "adsb", "latitude_deg": one, "longitude_deg": other}
        else:
            site = SITES[sensor]
            range_m, azimuth_rad, _ = slant_range_azimuth(
                (np.radians(site[0]), np.radians(site[1]), site[2]),
                np.radians(latitude), np.radians(longitude), height,
            )  # fmt: skip
            range_m = range_m + random.normal(0.0, 50.0, len(rows))
            azimuth_deg = np.degrees(azimuth_rad + random.normal(0.0, 0.001, len(rows))) % 360.0
            for row, one, other in zip(rows, range_m.tolist(), azimuth_deg.tolist(), strict=True):
                row |= {"range_m": one, "azimuth_deg": other}
        found[sensor] = rows
    return found


def identity(number: int) -> Row:
    """Return codes and height of an aircraft."""
    return {
        "height_m": (250 + 10 * number) * 30.48,
        "mode_3a": f"{number % 4096 + 0o1000:04o}",
        "mode_s_address": f"{0x4B0000 + number:06x}",
    }


def body(media: str, rows: list[Row]) -> bytes:
    """Return rows as the body of a request."""
    if media == "application/json":
        return json.dumps(rows).encode()
    if media == "application/x-ndjson":
        return "".join(json.dumps(row) + "\n" for row in rows).encode()
    frame = complete(pl.DataFrame(rows, infer_schema_length=None))
    return frame.write_ipc_stream(None).getvalue()


def datagram(rows: list[Row]) -> bytes:
    """Return plots of a radar as a block of category 048."""
    area, system = (int(part) for part in DATAGRAMS.split("-"))
    return block(
        48,
        *(
            plot_048(
                row["time_s"] % DAY_S,
                source=f"{area:02x}{system:02x}",
                range_nm=row["range_m"] / 1852.0,
                azimuth_deg=row["azimuth_deg"],
                code=f"{int(row['mode_3a'], 8):04x}",
                level=f"{round(row['height_m'] / 30.48 * 4):04x}",
                address=row["mode_s_address"],
            )
            for row in rows
        ),
    )
