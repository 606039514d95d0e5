"""Units of a dump."""

import pytest

from multiradar_converters.vid import fields
from multiradar_converters.vid.profile import Units


@pytest.mark.parametrize(
    ("role", "name", "factors"),
    [
        (fields.RANGE, "range", {"m": 1.0, "km": 1000.0, "NM": 1852.0, "ft": 0.3048}),
        (fields.HEIGHT, "height", {"m": 1.0, "km": 1000.0, "ft": 0.3048, "FL": 30.48}),
        (
            fields.AZIMUTH,
            "azimuth",
            {"degree": 1.0, "radian": 57.29577951308232, "ACP": 360.0 / 4096.0},
        ),
    ],
)
def test_a_unit_scales_the_numbers_of_its_role_alone(
    role: int, name: str, factors: dict[str, float]
) -> None:
    for unit, factor in factors.items():
        scale = Units.model_validate({name: unit}).scale()
        expected = [1.0] * fields.NUMBERS
        expected[role] = factor
        assert scale == pytest.approx(expected, rel=1e-15)
