"""Whatever tracks say, their records can be read, and say it or are without it."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from multiradar_converters.asterix.writing.encoding import blocks
from multiradar_converters.asterix.writing.track_reports import track_records
from support.asterix.reports import SENDER, read_tracks, reports

ANY = st.floats(-1e300, 1e300) | st.sampled_from([np.nan, np.inf, -np.inf])
POSITIVE = st.floats(0.0, 1e300) | st.just(np.nan)
WHOLE = st.integers(-1, (1 << 24) - 1)
#: Items by number: the column, the unit in SI, the LSB.
LEVEL_M, FOOT_M = 30.48, 0.3048
NUMBERS = {
    "136": ("measured_height_m", LEVEL_M, 0.25),
    "130": ("geometric_m", FOOT_M, 6.25),
    "220": ("climb_mps", FOOT_M / 60.0, 6.25),
}


@settings(max_examples=150)
@given(
    numbers=st.fixed_dictionaries(
        {
            name: ANY
            for name in (
                "x_m", "y_m", "velocity_east_mps", "velocity_north_mps", "measured_height_m",
                "barometric_m", "geometric_m", "climb_mps", "range_m", "plot_height_m",
                "track_age_s", "height_age_s", "code_age_s",
            )
        }
    ),
    spread=st.fixed_dictionaries(
        {
            name: POSITIVE
            for name in (
                "variance_east_m2", "variance_north_m2", "variance_x_m2", "variance_y_m2",
                "covariance_xy_m2", "velocity_sigma_mps", "height_sigma_m",
            )
        }
    ),
    place=st.tuples(st.floats(-90.0, 90.0), st.floats(-180.0, 180.0), st.floats(-1e9, 1e11)),
    identity=st.tuples(st.integers(-1, 0o7777), WHOLE, st.integers(-1, 0xFFFF)),
)  # fmt: skip
def test_every_record_can_be_read(
    numbers: dict[str, float],
    spread: dict[str, float],
    place: tuple[float, float, float],
    identity: tuple[int, int, int],
) -> None:
    code, address, sensor = identity
    reported = reports(
        2, **numbers, **spread, latitude_deg=place[0], longitude_deg=place[1], mode_3a=code,
        mode_s_address=address, sensor=sensor,
    )  # fmt: skip
    object.__setattr__(reported, "time_s", place[2])
    records = track_records(reported, SENDER)
    first, second = read_tracks(records)
    assert (first["040"], second["040"]) == (0, 1)
    assert {**first, "040": 1} == second
    assert abs(first["105"]["LAT"] - place[0]) <= 180 / 2**25
    assert -180.0 <= first["105"]["LON"] < 180.0
    assert 0.0 <= first["070"] < 86_400.0
    for item, (name, unit, last_bit) in NUMBERS.items():
        value = numbers[name] / unit
        if item in first:
            assert abs(first[item] - value) <= 0.5 * last_bit * (1.0 + 1e-9)
        else:
            # None, or more than sixteen bits hold.
            assert np.isnan(value) or abs(value) >= 32_767 * last_bit
    assert sum(map(len, blocks(62, records.written()))) < 400
