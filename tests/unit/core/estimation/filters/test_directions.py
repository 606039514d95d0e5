"""Elevations in the compiled filters, against their plain form."""

import numpy as np
import pytest

from multiradar.estimation.filters.arrays import Aircraft, Model, Rows, Work, result_arrays
from multiradar.estimation.filters.bank import FILTERS, Outcome
from multiradar.estimation.filters.height._height_kernels import BY_HEIGHT, GUESS, GUESS_VARIANCE
from multiradar.estimation.measurement._kernels import expected_measurement, sine_by_height
from multiradar.estimation.measurement.kinds import KIND_DIRECTION
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking.settings import TrackingSettings
from support.references.direction_filter import model_of, one_aircraft
from support.scenarios import moving_scene

TABLE = moving_scene.sensors(bias_sigma_deg=0.01)
MEAN = np.array([12e3, 25e3, -120.0, 60.0])
COVARIANCE = np.diag([900.0**2, 700.0**2, 20.0**2, 20.0**2]) + 5e3 * np.eye(4)[::-1]
HEIGHT_M = 9000.0


def processed(name: str, *, reported: bool, aside: float = 0.0) -> tuple[Aircraft, Model, Outcome]:
    """One direction of `df-1` of an aircraft, with a reported or an estimated height."""
    model = model_of(TABLE, TrackingSettings(filter_name=name))
    aircraft = one_aircraft(FILTERS[name], model, len(TABLE), MEAN, COVARIANCE)
    aircraft.vertical[0, GUESS], aircraft.vertical[0, GUESS_VARIANCE] = HEIGHT_M, 500.0**2
    s = TABLE.ids.index(moving_scene.FIXED)
    noises = model.noises.copy()
    noises[s, 0] = TABLE.elevation_sigma_rad[s] ** 2
    model = model._replace(noises=noises)
    expected, azimuth, _, _, _ = expected_measurement(
        KIND_DIRECTION, model.plane, model.sites[s], noises[s], MEAN[0], MEAN[1], HEIGHT_M, 0.0
    )
    rows = Rows(
        np.zeros(1, np.int64), np.zeros(1), np.array([KIND_DIRECTION]), np.array([s]),
        np.array([[expected + aside, azimuth + 0.001]]),
        np.array([HEIGHT_M if reported else np.nan]), np.array([s]), np.array([-1]),
    )  # fmt: skip
    columns = len(model.bias)
    result = result_arrays(1, 1, columns)
    work = Work(np.array([0]), np.array([0, 1]), np.array([0]))
    FILTERS[name].step(work, rows, model, aircraft, result, want_readout=True)
    return aircraft, model, Outcome(int(result.outcome[0]))


def plain(
    table: SensorTable, model: Model, rows: tuple[int, ...], aside: float, height_variance: float
) -> tuple[np.ndarray, np.ndarray]:
    """The same update in NumPy: by the sine, the azimuth, or both."""
    s = table.ids.index(moving_scene.FIXED)
    _, _, _, h, w = expected_measurement(
        KIND_DIRECTION, model.plane, model.sites[s], model.noises[s], MEAN[0], MEAN[1], HEIGHT_M,
        height_variance,
    )  # fmt: skip
    whole = np.zeros((2, 4))
    whole[0, :2], whole[1, :2] = h[:2], h[2:]
    chosen, noise = whole[list(rows)], np.diag([w[0], w[2]])[np.ix_(rows, rows)]
    miss = np.array([aside, 0.001])[list(rows)]
    gain = COVARIANCE @ chosen.T @ np.linalg.inv(chosen @ COVARIANCE @ chosen.T + noise)
    return MEAN + gain @ miss, COVARIANCE - gain @ chosen @ COVARIANCE


def state(aircraft: Aircraft) -> tuple[np.ndarray, np.ndarray]:
    covariance = np.zeros((4, 4))
    covariance[np.triu_indices(4)] = aircraft.covariance[0]
    return aircraft.mean[0], covariance + np.triu(covariance, 1).T


@pytest.mark.parametrize("name", ["two-stage", "imm"])
def test_an_elevation_at_a_known_height_is_a_range(name: str) -> None:
    """Rank two: across the line by the azimuth, along it by the elevation."""
    aircraft, model, outcome = processed(name, reported=True, aside=0.002)
    assert outcome is Outcome.UPDATED
    # A single Mode C height: a whole number of metres is not a step of 100 ft.
    variance = (25.0 * 0.3048) ** 2 / 12.0 + 2.0**2
    mean, covariance = plain(TABLE, model, (0, 1), 0.002, variance)
    found = state(aircraft)
    assert found[0] == pytest.approx(mean, abs=0.05)
    assert found[1] == pytest.approx(covariance, rel=1e-3, abs=1.0)


@pytest.mark.parametrize("name", ["two-stage", "imm"])
def test_an_elevation_determines_only_an_unknown_height(name: str) -> None:
    """The azimuth alone updates the position; the height as accurately as the position is known."""
    aside = 0.004
    aircraft, model, outcome = processed(name, reported=False, aside=aside)
    assert outcome is Outcome.UPDATED
    mean, covariance = plain(TABLE, model, (1,), aside, 0.0)
    found = state(aircraft)
    assert found[0] == pytest.approx(mean, abs=0.05)
    assert found[1] == pytest.approx(covariance, rel=1e-3, abs=1.0)
    assert aircraft.vertical[0, BY_HEIGHT : BY_HEIGHT + 4] == pytest.approx(0.0, abs=1e-9)
    s = TABLE.ids.index(moving_scene.FIXED)
    sine, _, ground, h, w = expected_measurement(
        KIND_DIRECTION, model.plane, model.sites[s], model.noises[s], MEAN[0], MEAN[1], HEIGHT_M,
        0.0,
    )  # fmt: skip
    slope = sine_by_height(sine, ground)
    row = np.array(h[:2])
    lasting = row @ COVARIANCE[:2, :2] @ row
    gain = 500.0**2 * slope / (slope**2 * 500.0**2 + lasting + w[0])
    assert aircraft.vertical[0, GUESS] == pytest.approx(HEIGHT_M + gain * aside, abs=0.1)
    left = 500.0**2 * (1.0 - gain * slope)
    assert aircraft.vertical[0, GUESS_VARIANCE] == pytest.approx(left, rel=1e-3)
    # The error of the position is the same at the next elevation.
    assert aircraft.vertical[0, GUESS_VARIANCE] >= min(500.0**2, lasting / slope**2)


@pytest.mark.parametrize("name", sorted(FILTERS))
def test_directions_are_unsupported_in_other_filters(name: str) -> None:
    if name in ("two-stage", "imm"):
        assert processed(name, reported=True)[2] is Outcome.UPDATED
    else:
        assert processed(name, reported=True)[2] is Outcome.UNSUPPORTED
