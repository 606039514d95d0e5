"""Which updates of system tracks are measurements of a bias reference."""

import numpy as np
import polars as pl
import pytest

from multiradar.evaluation.bias_reference import (
    APART_S,
    SIGMA_M,
    own_sigma_m,
    reference_measurements,
)

PERIOD_S, DURATION_S = 4.0, 400.0
METRES_OF_DEGREE = 6_371_000.0 * np.pi / 180.0


def track(
    flight: str = "7",
    address: str | None = "3c0001",
    code: str | None = "1000",
    turn_rate_deg_per_s: float = 0.0,
) -> pl.DataFrame:
    """Return a track of 200 m/s along the equator, that turns after half of the time."""
    time_s = np.arange(0.0, DURATION_S, PERIOD_S)
    course = np.pi / 2.0 + np.radians(turn_rate_deg_per_s) * np.maximum(
        time_s - 0.5 * DURATION_S, 0.0
    )
    step = 200.0 * PERIOD_S / METRES_OF_DEGREE
    return pl.DataFrame(
        {
            "time_s": time_s,
            "latitude_deg": np.cumsum(np.cos(course)) * step,
            "longitude_deg": np.cumsum(np.sin(course)) * step,
        }
    ).with_columns(
        flight=pl.lit(flight),
        mode_s_address=pl.lit(address, pl.String),
        mode_3a=pl.lit(code, pl.String),
        track_number=pl.lit(None, pl.Int64),
    )


def plots(
    address: str | None = "3c0001", code: str | None = "1000", end_s: float = DURATION_S
) -> pl.DataFrame:
    time_s = np.arange(1.0, end_s, 5.0)
    return pl.DataFrame({"time_s": time_s}).with_columns(
        mode_s_address=pl.lit(address, pl.String),
        mode_3a=pl.lit(code, pl.String),
        track_number=pl.lit(None, pl.Int64),
    )


def test_updates_are_used_when_their_errors_are_independent() -> None:
    made, counts = reference_measurements(track(), plots(), SIGMA_M)
    time_s = made["time_s"].to_numpy()
    assert (np.diff(time_s) >= APART_S).all()
    assert time_s.tolist() == [APART_S * k for k in range(1, 19)]
    assert counts.used == len(made)
    # At both ends nothing shows whether the flight is straight.
    assert counts.turning == 2 * APART_S / PERIOD_S
    assert counts.read == counts.used + counts.turning + counts.dependent + counts.not_measured


def test_turns_are_left_out() -> None:
    made, _ = reference_measurements(track(turn_rate_deg_per_s=1.0), plots(), SIGMA_M)
    assert made["time_s"].to_numpy().max() <= 0.5 * DURATION_S
    # A turn that displaces the aircraft by less than the errors of the track stays.
    slow, _ = reference_measurements(track(turn_rate_deg_per_s=0.1), plots(), SIGMA_M)
    assert slow["time_s"].to_numpy().max() == 360.0


@pytest.mark.parametrize(
    ("own", "of_plots", "used"),
    [
        (("3c0001", "1000"), ("3c0001", None), True),
        (("3c0001", "1000"), ("3c0002", "1000"), False),
        # Plots of Mode A/C radars have no address.
        (("3c0001", "1000"), (None, "1000"), True),
        (("3c0001", "1000"), (None, "2000"), False),
        ((None, "1000"), ("3c0001", "1000"), True),
        ((None, None), ("3c0001", "1000"), False),
    ],
)
def test_only_aircraft_that_are_measured_are_used(
    own: tuple[str | None, str | None], of_plots: tuple[str | None, str | None], used: bool
) -> None:
    made, counts = reference_measurements(
        track(address=own[0], code=own[1]), plots(*of_plots), SIGMA_M
    )
    assert bool(len(made)) == used
    assert bool(counts.not_measured) == (not used)


def test_an_address_decides_while_plots_have_addresses() -> None:
    """A Mode S radar, which does not see the aircraft, fails after half of the time."""
    of_code = plots(None, "1000")
    both = pl.concat([of_code, plots("3c0002", "2000", end_s=200.0)])
    made, counts = reference_measurements(track(), both, SIGMA_M)
    time_s = made["time_s"].to_numpy()
    assert 200.0 < time_s.min() < 240.0
    assert counts.not_measured > 0


def test_updates_after_the_last_plot_and_shared_codes_are_left_out() -> None:
    made, counts = reference_measurements(track(), plots(end_s=200.0), SIGMA_M)
    assert made["time_s"].to_numpy().max() <= 215.0
    assert counts.not_measured > 0
    both = pl.concat([track("7", None), track("8", None)])
    assert len(reference_measurements(both, plots(), SIGMA_M)[0]) == 0


def test_the_accuracy_is_that_of_the_tracks_where_they_have_one() -> None:
    assert own_sigma_m(track()) == SIGMA_M
    known = track().with_columns(position_sigma_m=pl.lit(30.0))
    assert own_sigma_m(known) == pytest.approx(30.0 / 2.0**0.5)
    for metres, used in ((1000.0, 1000.0 / 2.0**0.5), (1000.5, SIGMA_M), (None, SIGMA_M)):
        reported = track().with_columns(position_sigma_m=pl.lit(metres, pl.Float64))
        assert own_sigma_m(reported) == pytest.approx(used)
