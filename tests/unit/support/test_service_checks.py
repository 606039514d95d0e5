"""The measurements of the service are evaluated, and fail beyond a stated bound."""

import numpy as np
import pytest

from validation.service.check_memory import evaluated, slope_of
from validation.service.check_shares import slowest


def figures_of(rates_mib_h: float, noise_mib: float, hours: float = 1.0) -> dict[str, float]:
    """Return the slope of memory that grows by so much per hour by the clock."""
    time_s = np.arange(0.0, 3600.0 * hours, 5.0)
    noise = np.random.default_rng(1).normal(0.0, noise_mib, len(time_s))
    return slope_of(np.column_stack([time_s, 500.0 + rates_mib_h * time_s / 3600.0 + noise]), 0.0)


@pytest.mark.parametrize(
    ("rate_mib_h", "begins", "permitted"),
    [
        (0.0, "flat: ", True),
        (-40.0, "flat: -4.0 ± ", True),
        # Ten hours of data in one hour by the clock.
        (40.0, "not flat: +4.0 ± ", True),
        (60.0, "not flat: +6.0 ± ", False),
    ],
)
def test_memory_is_flat_if_its_interval_contains_no_growth(
    rate_mib_h: float, begins: str, permitted: bool
) -> None:
    sentence, is_permitted = evaluated(figures_of(rate_mib_h, 1.0), 10.0, 5.0)
    assert sentence.startswith(begins), sentence
    assert is_permitted == permitted
    assert "MiB per hour of data" in sentence
    assert f"{rate_mib_h:+.0f}" in sentence.partition("of data")[2] or rate_mib_h == 0.0
    assert "at most +5.0" in sentence


def test_growth_that_is_not_significant_is_permitted() -> None:
    sentence, is_permitted = evaluated(figures_of(60.0, 300.0), 10.0, 5.0)
    assert sentence.startswith("flat: ")
    assert is_permitted


def test_memory_without_a_slope_is_not_permitted() -> None:
    sentence, is_permitted = evaluated(figures_of(0.0, 1.0, hours=0.01), 10.0, 5.0)
    assert sentence.startswith("no slope: ")
    assert not is_permitted


def test_a_client_that_waits_too_long_is_named_with_the_bound() -> None:
    medians_ms = [("nothing", 12.0), ("64 slow bodies", 130.4), ("nothing", 99.9)]
    assert slowest(medians_ms, 150.0) is None
    assert slowest(medians_ms, 100.0) == (
        "64 slow bodies: median 130 ms, above 100 ms (bound for a machine without other work)"
    )
