"""Names of the values of each format, for messages, and their factors to SI."""

from collections.abc import Mapping
from typing import Literal

from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.layout import Layout
from multiradar_converters.adsb.reading.roles import NAMES_OF_READSB, SCALE_OF_READSB, Chosen

#: In the values of a message, beside the roles: standard deviation of its position on each axis, m.
SIGMA = -1

#: Forms of recorded feeds.
Form = Literal["readsb lines", "snapshots by line", "snapshots", "BaseStation", "mlat-server"]


def _layout(names: Mapping[int, str]) -> Layout:
    # Times are converted to Unix seconds before.
    return Layout(Chosen(dict(names), SCALE_OF_READSB), "unix-s", "unix-s")


#: readsb and dump1090.
READSB = _layout(
    {
        roles.TIME: "now",
        roles.LATITUDE: "lat",
        roles.LONGITUDE: "lon",
        roles.HEIGHT: "alt_baro",
        roles.GEOMETRIC: "alt_geom",
        roles.SPEED: "gs",
        roles.ADDRESS: "hex",
        roles.CODE: "squawk",
        roles.CALLSIGN: "flight",
        roles.GROUND: "ground",
        roles.KIND: "type",
        **NAMES_OF_READSB,
    }
)

#: BaseStation, by the names of its description.
BASESTATION = _layout(
    {
        roles.TIME: "date and time generated",
        roles.LATITUDE: "latitude",
        roles.LONGITUDE: "longitude",
        roles.HEIGHT: "altitude",
        roles.GEOMETRIC: "altitude",
        roles.SPEED: "ground speed",
        roles.ADDRESS: "hex ident",
        roles.CODE: "squawk",
        roles.CALLSIGN: "callsign",
        roles.GROUND: "is on ground",
        roles.TRACK: "track",
        roles.CLIMB: "vertical rate",
        roles.KIND: "message type",
    }
)

#: mlat-server, by the names in its source.
MULTILATERATION = _layout(
    {
        roles.TIME: "t",
        roles.LATITUDE: "lat",
        roles.LONGITUDE: "lon",
        roles.HEIGHT: "alt",
        roles.GEOMETRIC: "alt",
        roles.SPEED: "kspeed",
        roles.ADDRESS: "address",
        roles.CODE: "squawk",
        roles.CALLSIGN: "callsign",
        roles.KIND: "kind",
    }
)


def of_form(form: Form) -> Layout:
    """Return the layout of a recorded feed."""
    return {"BaseStation": BASESTATION, "mlat-server": MULTILATERATION}.get(form, READSB)
