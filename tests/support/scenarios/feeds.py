"""Messages of receivers, made by hand: readsb, BaseStation and mlat-server."""

import datetime as dt
import json
from collections.abc import Sequence
from typing import Any

#: 2018-08-01 08:00:00 UTC, Unix time, s.
BEGIN_S = 1_533_110_400.0
KNOT_MPS = 1852.0 / 3600.0

Values = dict[str, Any]


def latitude(second: float) -> float:
    """Return the latitude of an aircraft that flies north at 450 kt, as readsb writes it."""
    return round(47.0 + second * 450.0 * KNOT_MPS / 111_195.0, 6)


def aircraft(second: float = 0.0, age: float = 0.0, **changes: Any) -> Values:
    """Return an aircraft as readsb does; its position was received `age` before."""
    values = {
        "hex": "3c6444",
        "type": "adsb_icao",
        "flight": "DLH8JW  ",
        "alt_baro": 35_000,
        "alt_geom": 35_500,
        "gs": 450.0,
        "track": 0.0,
        "squawk": "1000",
        "lat": latitude(second - age),
        "lon": 8.5,
        "nic": 8,
        "rc": 186,
        "seen_pos": age,
        "mlat": [],
        "tisb": [],
        "messages": 100,
        "seen": 0.1,
        "rssi": -12.3,
    }
    return {name: value for name, value in (values | changes).items() if value is not ...}


def readsb_line(second: float = 0.0, age: float = 0.0, **changes: Any) -> bytes:
    """Return a line of `--net-json-port`."""
    return json.dumps({"now": BEGIN_S + second} | aircraft(second, age, **changes)).encode() + b"\n"


def snapshot(second: float, found: Sequence[Any], **changes: Any) -> bytes:
    """Return `aircraft.json` with the line ends of readsb."""
    head = {"now": BEGIN_S + second, "messages": 5000} | changes
    text = json.dumps(head)[:-1] + ',\n  "aircraft" : ['
    return (text + ",".join("\n" + json.dumps(one) for one in found) + "\n  ]\n}\n").encode()


def base_station(
    second: float, kind: str = "3", *, prefix: str = "MSG", zone_s: float = 0.0, **changes: str
) -> bytes:
    """Return a message of port 30003; values by their number from 1, such as `f11="DLH8JW"`."""
    moment = dt.datetime.fromtimestamp(BEGIN_S + second + zone_s, dt.UTC)
    date, time = moment.strftime("%Y/%m/%d"), moment.strftime("%H:%M:%S.%f")[:-3]
    fields = [prefix, kind, "1", "1", "3C6444", "1", date, time, date, time, *[""] * 12]
    if kind == "3":
        fields[11], fields[14], fields[15], fields[21] = (
            "35000",
            f"{latitude(second):.6f}",
            "8.5",
            "0",
        )
    for name, value in changes.items():
        fields[int(name[1:]) - 1] = value
    return (",".join(fields) + "\r\n").encode()


def multilaterated(second: float, form: int = 13, **changes: str) -> bytes:
    """Return a row of mlat-server with so many fields; values by their number from 1."""
    fields = [
        f"{BEGIN_S + second:.3f}", "3C6444", "DLH8JW", "1000", f"{latitude(second):.4f}", "8.5000",
        "35000", "45", "5", "5", '"a,b,c,d,e"',
    ]  # fmt: skip
    filtered = [f"{latitude(second):.4f}", "8.5000", "34950", "0", "450", "0", "40"]
    fields += {11: [], 12: ["2"], 13: ["2", "0"], 18: filtered, 19: ["2", *filtered]}[form]
    for name, value in changes.items():
        fields[int(name[1:]) - 1] = value
    return (",".join(fields) + "\n").encode()
