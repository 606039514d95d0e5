"""Which estimate of a bias corrects a plot."""

import numpy as np
import pytest

from multiradar.evaluation.measures.bias_errors import BiasHistory
from multiradar.evaluation.smoothing.reference import biases_at
from multiradar_schemas.sensors.sensor import Sensor, parse_sensors

TIMES_S = np.arange(0.0, 100.0, 10.0)


def radar(bias: str) -> Sensor:
    text = (
        '[[sensor]]\nid = "radar"\nkind = "radar"\n'
        "latitude_deg = 45.5\nlongitude_deg = 5.5\nheight_m = 200.0\n"
    )
    return parse_sensors(f"{text}{bias}\n").sensor[0]


def history(estimate: list[float], sigma: list[float]) -> BiasHistory:
    nothing = np.full(len(TIMES_S), np.nan)
    return BiasHistory(
        "radar", "range_offset_m", TIMES_S, np.array(estimate), np.array(sigma), nothing
    )


CONVERGING = history(list(range(10)), [100.0, *np.linspace(50.0, 5.0, 9)])
#: The bias jumps, which is detected at 50 s.
JUMPING = history(
    [80.0, 60.0, 61.0, 60.0, 60.0, 0.0, -90.0, -91.0, -90.0, -89.0],
    [300.0, 90.0, 40.0, 20.0, 10.0, 300.0, 90.0, 40.0, 20.0, 10.0],
)


@pytest.mark.parametrize(
    ("bias", "known", "expected"),
    [
        ("", CONVERGING, [9.0, 9.0, 9.0, 9.0]),
        ("", JUMPING, [60.0, 60.0, -89.0, -89.0]),
        ("bias.range_offset_m = { drift = 0.1 }", CONVERGING, [0.0, 4.9, 5.0, 9.0]),
        ("bias.range_offset_m = { prior = 30.0, estimate = false }", JUMPING, [30.0] * 4),
    ],
)
def test_a_constant_bias_is_that_of_its_last_estimate_before_the_next_jump(
    bias: str, known: BiasHistory, expected: list[float]
) -> None:
    found = biases_at(radar(bias), np.array([-5.0, 49.0, 50.0, 500.0]), [known])
    assert found["range_offset_m"].tolist() == pytest.approx(expected)


def test_without_an_estimate_it_is_the_prior() -> None:
    found = biases_at(radar("bias.range_offset_m = { prior = 20.0 }"), TIMES_S, [])
    assert set(found["range_offset_m"].tolist()) == {20.0}
