"""Distinct values of long arrays."""

import numpy as np
import pytest

from multiradar_converters.distinct import distinct, distinct_places


@pytest.mark.parametrize("values", [[], [7], [3, 3, -1, 2**62, 3, -1]])
def test_they_are_in_order_and_each_value_has_its_place(values: list[int]) -> None:
    of = np.array(values, dtype=np.int64)
    assert distinct(of).tolist() == sorted(set(values))
    found, places = distinct_places(of)
    assert found.tolist() == sorted(set(values))
    assert found[places].tolist() == values
