"""Names of bias parameters in tables and plots."""

#: With their unit.
WORDS = {
    "range_offset_m": "range offset, m",
    "azimuth_offset_deg": "azimuth offset, °",
    "range_gain": "range gain",
    "time_offset_s": "time offset, s",
    "azimuth_sine_deg": "azimuth sine, °",
    "azimuth_cosine_deg": "azimuth cosine, °",
    "frame_east_m": "frame shift east, m",
    "frame_north_m": "frame shift north, m",
    "frame_rotation_deg": "frame rotation, °",
}


def parameter_words(parameter: str) -> tuple[str, str]:
    """Return the name of a parameter, and its unit after a comma, empty without one."""
    name, comma, unit = WORDS.get(parameter, parameter.replace("_", " ")).partition(",")
    return name, comma + unit
