"""The scan period of any antenna is found from its plots."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from multiradar_converters.scan_period import PERIOD_MAX_S, scan_period_s
from support.scenarios.sweeps import sweep


@given(
    st.floats(2.0, PERIOD_MAX_S - 5.0),
    st.floats(300.0, 900.0),
    st.integers(0, 1000),
)
def test_the_period_of_a_rotating_antenna_is_found(
    period_s: float, duration_s: float, seed: int
) -> None:
    found = scan_period_s(*sweep(period_s, duration_s, seed, targets=20))
    # A tenth of a revolution over the whole recording.
    assert found == pytest.approx(period_s, rel=0.1 * period_s / duration_s + 1e-4)
