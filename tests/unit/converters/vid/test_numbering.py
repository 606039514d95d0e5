"""Numbers in order of first appearance, bounded; identities hold the largest of them."""

import numpy as np
import pytest

from multiradar_converters.errors import LayoutError
from multiradar_converters.vid.numbering import Numbering
from multiradar_converters.vid.records import (
    SENSORS_MAX,
    code_of,
    pack_identity,
    plot_of,
    sensor_of,
)


def test_keys_beyond_the_maximum_are_rejected() -> None:
    numbering = Numbering("sensors", 3)
    assert numbering.number(np.array([70, 5, 70, 9])).tolist() == [0, 1, 0, 2]
    assert numbering.keys().tolist() == [70, 5, 9]
    with pytest.raises(LayoutError, match="expected at most 3 sensors, found more"):
        numbering.number(np.array([5, 6]))


def test_an_identity_holds_32768_sensors_and_the_largest_plot_and_code() -> None:
    sensor, plot = np.array([0, 32_767]), np.array([0, 2**31 - 1])
    assert sensor[-1] + 1 == SENSORS_MAX
    for code in (-1, 0o7777):
        identity = pack_identity(sensor, plot, np.full(2, code))
        assert (identity >= 0).all()
        assert sensor_of(identity).tolist() == sensor.tolist()
        assert plot_of(identity).tolist() == plot.tolist()
        assert code_of(identity).tolist() == [code, code]
