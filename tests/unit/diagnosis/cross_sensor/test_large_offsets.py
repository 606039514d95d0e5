"""Offsets that the run estimates far from the configured ones are warnings."""

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.diagnosis.cross_sensor.offsets import check_large_offsets
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.findings import diagnose
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_OFFSET,
)
from multiradar.tracking.outputs import TrackPlots
from support.inputs.mistaken import RADARS, recording

NAME = "1-10"


def evidence_with(bias: dict[str, dict[str, float]], aircraft: int = 25) -> Evidence:
    """Return the evidence of tracks with plots of all radars."""
    one = recording().configured(NAME, bias=bias)
    evidence = Evidence(one.table())
    frame = one.frame.filter(pl.col("track_number") < aircraft)
    measured, _ = wire.measurement_batch(frame, evidence.sensors)
    evidence.record_plots(TrackPlots(measured.track_number, measured))
    return evidence


# Plots of another aircraft in the only track of two radars look like an offset.
def test_an_offset_of_few_aircraft_is_none() -> None:
    evidence = evidence_with({}, aircraft=2)
    evidence.biases[0, PARAMETER_AZIMUTH_OFFSET] = np.radians(1.74), np.radians(0.15)
    assert check_large_offsets(evidence) == []


@pytest.mark.parametrize(
    ("offset_deg", "sigma_deg", "prior", "known"),
    [
        (2.3, 0.01, {}, True),
        (-2.3, 0.01, {}, True),
        (0.9, 0.01, {}, False),
        (2.3, 0.5, {}, False),
        (2.3, 0.01, {"azimuth_offset_deg": {"prior": 2.0}}, False),
        (2.3, 0.01, {"azimuth_offset_deg": {"prior_sigma": 2.0}}, False),
    ],
)
def test_azimuths_that_are_far_off_are_a_warning(
    offset_deg: float, sigma_deg: float, prior: dict[str, dict[str, float]], *, known: bool
) -> None:
    evidence = evidence_with(prior)
    evidence.biases[0, PARAMETER_AZIMUTH_OFFSET] = (
        float(np.radians(offset_deg)), float(np.radians(sigma_deg)),
    )  # fmt: skip
    said = check_large_offsets(evidence)
    assert bool(said) == known
    if said:
        assert (said[0].sensor_id, said[0].severity) == (NAME, "warning")
        assert f"azimuth offset is {offset_deg:+.2f}°, but +0.00° ± 0.50°" in said[0].sentence


@pytest.mark.parametrize(
    ("offset_m", "prior", "known"),
    [
        (5185.0, {}, True),
        (-1100.0, {}, True),
        (900.0, {}, False),
        (1400.0, {"range_offset_m": {"prior_sigma": 800.0}}, False),
    ],
)
def test_ranges_that_are_far_off_are_a_warning(
    offset_m: float, prior: dict[str, dict[str, float]], *, known: bool
) -> None:
    """Regression: an offset beyond that of any radar was estimated without a word."""
    evidence = evidence_with(prior)
    evidence.biases[0, PARAMETER_RANGE_OFFSET] = offset_m, 1.2
    said = check_large_offsets(evidence)
    assert bool(said) == known
    if said:
        assert (said[0].sensor_id, said[0].severity) == (NAME, "warning")
        assert f"range offset is {offset_m:+.0f} m, but +0 m ± 500 m" in (said[0].sentence)


# Two radars off by one angle: one of them seems displaced, by the angle times their distance.
def test_estimated_offsets_are_no_displaced_site() -> None:
    """Regression: offsets of 0.3°, as two radars of a correct scenario had, 200 km apart."""
    one = recording().only(NAME, "2-10")
    turned = one.frame.with_columns((pl.col("azimuth_deg") + 1.0) % 360.0)
    evidence = Evidence(one.table())
    evidence.record_rows(turned)
    evidence.confirmed = True
    assert [said.code for said in diagnose(evidence)] != []
    for number, (_, _, (_, azimuth_deg)) in enumerate(list(RADARS.values())[:2]):
        evidence.biases[number, PARAMETER_AZIMUTH_OFFSET] = np.radians(azimuth_deg + 0.8), 1e-4
    assert diagnose(evidence) == []


# Without identity, plots of other aircraft in its tracks show any offset.
@pytest.mark.parametrize(("named", "codes"), [(True, ["azimuth_offset"]), (False, [])])
def test_an_offset_that_plots_without_identity_contradict_is_none(
    codes: list[str], *, named: bool
) -> None:
    """Regression: four primary radars, of which two were estimated 3° off in merged tracks."""
    one = recording(named=named)
    evidence = Evidence(one.table())
    evidence.record_rows(one.frame)
    measured, _ = wire.measurement_batch(one.frame, evidence.sensors)
    numbers = recording().frame["track_number"].to_numpy()
    evidence.record_plots(TrackPlots(numbers, measured))
    evidence.confirmed = True
    evidence.biases[0, PARAMETER_AZIMUTH_OFFSET] = np.radians(2.1), np.radians(0.06)
    assert [said.code for said in diagnose(evidence)] == codes
