"""Terms of the score of a plot and a track."""

import numpy as np
import pytest
from scipy.stats import norm

from multiradar.tracking.association._association_kernels import log_of_height
from support.kernels import plain


# Resolution 40 m; level aircraft drift at 1 m/s, the others climb or descend at 12 m/s.
@pytest.mark.parametrize("off_m", [0.0, 50.0, -50.0, 200.0])
@pytest.mark.parametrize(("dt", "level_m", "climbing_m"), [(0.0, 40, 40), (10.0, 50, 160)])
def test_seven_of_ten_aircraft_continue_level(
    off_m: float, dt: float, level_m: float, climbing_m: float
) -> None:
    expected = 0.7 * norm.pdf(off_m, scale=level_m) + 0.3 * norm.pdf(off_m, scale=climbing_m)
    assert plain(log_of_height)(off_m, dt) == pytest.approx(np.log(expected), abs=1e-9)
