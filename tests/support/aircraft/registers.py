"""Mode S registers 4,0, 5,0 and 6,0 as texts of 56 bits, written from ICAO Doc 9871, tables A-2.

Independent of the decoder: fields are slices of a text, signs a bit of their own with the offset of
two's complement subtracted.
"""

# Register, status bit, sign bit (0: none), first and last bit, value of the last bit, unit.
FIELDS = (
    ("4,0", "panel_altitude", 1, 0, 2, 13, 16.0, "ft"),
    ("4,0", "managed_altitude", 14, 0, 15, 26, 16.0, "ft"),
    ("5,0", "roll", 1, 2, 3, 11, 45 / 256, "degree"),
    ("5,0", "track_angle", 12, 13, 14, 23, 90 / 512, "degree"),
    ("5,0", "ground_speed", 24, 0, 25, 34, 1024 / 512, "kt"),
    ("5,0", "track_angle_rate", 35, 36, 37, 45, 8 / 256, "degree/s"),
    ("5,0", "true_airspeed", 46, 0, 47, 56, 2.0, "kt"),
    ("6,0", "magnetic_heading", 1, 2, 3, 12, 90 / 512, "degree"),
    ("6,0", "indicated_airspeed", 13, 0, 14, 23, 1.0, "kt"),
    ("6,0", "mach", 24, 0, 25, 34, 2.048 / 512, "1"),
    ("6,0", "barometric_rate", 35, 36, 37, 45, 8192 / 256, "ft/min"),
    ("6,0", "inertial_rate", 46, 47, 48, 56, 8192 / 256, "ft/min"),
)
UNITS = {"ft": 0.3048, "kt": 1852 / 3600, "ft/min": 0.3048 / 60, "degree": 1.0, "degree/s": 1.0}


def read(register: str, content: int) -> dict[str, float]:
    """Return the fields with status 1, in the units of the specification."""
    bits = f"{content:056b}"
    found = {}
    for number, name, status, sign, first, last, step, _ in FIELDS:
        if number != register or bits[status - 1] == "0":
            continue
        value = int(bits[first - 1 : last], 2)
        if sign and bits[sign - 1] == "1":
            value -= 2 ** (last - first + 1)
        found[name] = value * step
    return found


def write(register: str, **values: float) -> int:
    """Write a register; fields that are not given have the status 0."""
    bits = ["0"] * 56
    for number, name, status, sign, first, last, step, _ in FIELDS:
        if number != register or name not in values:
            continue
        size = last - first + 1
        value = round(values.pop(name) / step)
        bits[status - 1] = "1"
        if sign:
            bits[sign - 1] = "1" if value < 0 else "0"
            value %= 2**size
        bits[first - 1 : last] = f"{value:0{size}b}"
    assert not values, f"expected fields of {register}, was also {values}"
    return int("".join(bits), 2)


def item_250(**registers: int) -> str:
    """Write item 048/250 from registers named `bds40`, `bds50`, `bds60`, as hexadecimal digits."""
    texts = [f"{content:014x}{name[3:]}" for name, content in registers.items()]
    return f"{len(texts):02x}" + "".join(texts)
