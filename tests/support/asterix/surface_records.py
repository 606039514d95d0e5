"""Records of an airport: surface radar and multilateration (010, 019, 020), ADS-B (021)."""

from support.asterix.octets import record, time_of_day

RADAR, MULTILATERATION = "00 07", "00 6b"
#: Types of reports of category 010, first octet of item 020.
MODE_S_MLAT, ADSB, PRIMARY, MAGNETIC_LOOP = "20", "40", "60", "80"


def signed(value: float, lsb: float, bits: int) -> str:
    """Write a number in two's complement."""
    return f"{round(value / lsb) % (1 << bits):0{bits // 4}x}"


def surface_010(
    seconds: float,
    *,
    source: str = RADAR,
    descriptor: str = PRIMARY,
    polar: tuple[float, float] | None = None,
    local: tuple[float, float] | None = None,
    status: str | None = None,
    address: str | None = None,
    deviations: tuple[float, float] | None = None,
) -> bytes:
    """Write a target report: range and azimuth, x and y, m and degree."""
    items = [(1, source), (2, "01"), (3, descriptor), (4, time_of_day(seconds))]
    if polar is not None:
        items.append((6, f"{round(polar[0]):04x} {round(polar[1] * 65536 / 360) % 65536:04x}"))
    if local is not None:
        items.append((7, signed(local[0], 1.0, 16) + signed(local[1], 1.0, 16)))
    if status is not None:
        items.append((11, status))
    if address is not None:
        items.append((13, address))
    if deviations is not None:
        items.append((22, "".join(f"{round(one * 4):02x}" for one in deviations) + "0000"))
    return record(*items)


def update_cycle_010(seconds: float, *, source: str = RADAR) -> bytes:
    """Write a message that is no target report."""
    return record((1, source), (2, "02"), (4, time_of_day(seconds)))


def mlat_020(
    seconds: float,
    *,
    local: tuple[float, float] | None = None,
    position: tuple[float, float] | None = None,
    address: str = "3c660c",
    extrapolated: bool = False,
    deviations: tuple[float, float] | None = None,
) -> bytes:
    """Write a report of multilateration: x and y, m, or latitude and longitude, degree."""
    items = [(1, MULTILATERATION), (2, "41 10"), (3, time_of_day(seconds))]
    if position is not None:
        items.append((4, "".join(signed(one, 180.0 / 2**25, 32) for one in position)))
    if local is not None:
        items.append((5, signed(local[0], 0.5, 24) + signed(local[1], 0.5, 24)))
    if extrapolated:
        items.append((7, "20"))
    items.append((12, address))
    if deviations is not None:
        items.append((19, "40" + "".join(f"{round(one * 4):04x}" for one in deviations) + "0000"))
    return record(*items)


def reference_019(seconds: float, latitude_deg: float, longitude_deg: float) -> bytes:
    """Write a status message of multilateration with its reference point, 40 m high."""
    lsb = 180.0 / 2**30
    place = signed(latitude_deg, lsb, 32) + signed(longitude_deg, lsb, 32)
    items = [(1, MULTILATERATION), (2, "02"), (3, time_of_day(seconds)), (8, place)]
    return record(*items, (9, signed(40.0, 0.25, 16)))


def adsb_021(
    seconds: float,
    quality: str | None,
    version: str | None = None,
    fine: tuple[int, float] | None = None,
) -> bytes:
    """Write an ADS-B report of edition 2: items 090 and 210 in hexadecimal, FSI and 074."""
    place = signed(41.3, 180.0 / 2**30, 32) + signed(2.1, 180.0 / 2**30, 32)
    items = [(1, MULTILATERATION), (2, "00"), (7, place), (11, "3c660c")]
    items.append((12, time_of_day(seconds)))
    if fine is not None:
        items.append((13, f"{fine[0] << 30 | round(fine[1] * 2**30):08x}"))
    if quality is not None:
        items.append((17, quality))
    if version is not None:
        items.append((18, version))
    return record(*items)


def adsb_021_old(seconds: float, merit: str) -> bytes:
    """Write an ADS-B report of edition 0.23 with its figure of merit, item 090."""
    place = signed(41.3, 180.0 / 2**23, 24) + signed(2.1, 180.0 / 2**23, 24)
    items = [(1, MULTILATERATION), (2, "00 20"), (3, time_of_day(seconds)), (4, place)]
    return record(*items, (5, "3c660c"), (7, merit))
