"""Diagnosis of unexplained losses, noise and copies."""

import re
from dataclasses import replace
from typing import Literal

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.findings import diagnose
from multiradar.diagnosis.losses import check_unexplained_losses, losses_of
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.noise import check_scatter
from multiradar.diagnosis.plots import Plots
from multiradar.estimation.filters.bank import Outcome
from multiradar.tracking.outputs import TrackPlots
from multiradar_schemas.sensors.sensor import Sensor
from support.inputs.mistaken import RADARS, SIGMAS, Recording, recording

RANGE = pl.col("range_m")


def evidence_of(one: Recording, **outcomes: int) -> Evidence:
    """Return the evidence of a recording with outcomes of the measurements of its first sensor."""
    evidence = Evidence(one.table())
    evidence.record_rows(one.frame)
    evidence.outcomes = np.zeros((len(one.sensors), len(Outcome)), np.int64)
    evidence.outcomes[:, Outcome.UPDATED] = 600
    for name, count in outcomes.items():
        evidence.outcomes[0, Outcome[name]] = count
    evidence.confirmed = True
    return evidence


def evidence_of_noise(
    *ratios: tuple[float, float], turn_rad: float = 0.0
) -> Evidence:  # fmt: skip
    """Return the evidence of radars whose noise is so many times the configured sigmas.

    Tracks weave with `turn_rad` as the amplitude of their azimuth.
    """
    one = recording()
    for name, of_range, of_azimuth in zip(RADARS, *zip(*ratios, strict=True), strict=False):
        one = one.configured(
            name,
            range_sigma_m=SIGMAS[0] / max(of_range, 1.0),
            azimuth_sigma_deg=SIGMAS[1] / max(of_azimuth, 1.0),
        )
    evidence = evidence_of(one)
    measured, _ = wire.measurement_batch(one.frame, evidence.sensors)
    weave = turn_rad * np.sin(1.1 * np.floor(measured.time_s / 4.9))
    measured = replace(measured, azimuth_rad=measured.azimuth_rad + weave)
    evidence.record_plots(TrackPlots(measured.track_number, measured))
    evidence.noise |= dict(zip(RADARS, ratios, strict=False))
    return evidence


def said(evidence: Evidence) -> Diagnosis:
    """Return the single diagnosis."""
    found = diagnose(evidence)
    assert len(found) == 1
    return found[0]


def test_a_third_of_the_measurements_may_be_lost() -> None:
    assert diagnose(evidence_of(recording(), UPDATED=600, REFUSED=300)) == []


@pytest.mark.parametrize(("known", "codes"), [(19, []), (20, ["measurements_lost"])])
def test_losses_are_reported_from_20_measurements_on(known: int, codes: list[str]) -> None:
    evidence = evidence_of(recording(), UPDATED=known - 10, REFUSED=10)
    assert [one.code for one in diagnose(evidence)] == codes


def test_more_than_a_third_is_reported_with_causes_and_what_to_check() -> None:
    found = said(evidence_of(recording(), UPDATED=600, REFUSED=301, RESTARTED=9))
    assert (found.sensor_id, found.code) == ("1-10", "measurements_lost")
    assert "34% of its 910 measurements were lost (301 REFUSED, 9 RESTARTED)" in found.sentence
    assert "no single mistake explains the loss; check its site, range_sigma_m" in found.sentence


def test_the_cone_of_silence_and_tracks_that_start_are_no_loss() -> None:
    assert diagnose(evidence_of(recording(), UPDATED=1, STARTED=300, CONE_OF_SILENCE=300)) == []


def test_late_measurements_are_reported_with_their_times() -> None:
    evidence = evidence_of(recording(), UPDATED=100)
    evidence.reject("1-10", "TIME_LATE", 400)
    sentence = said(evidence).sentence
    assert "(400 TIME_LATE) (its times: 2018-08-01 08:00:0" in sentence
    assert "check its clock, and reorder_horizon_s" in sentence


def test_rejected_values_of_a_sensor_that_is_used_cause_a_warning() -> None:
    evidence = evidence_of(recording(), UPDATED=600)
    evidence.reject("1-10", "NON_FINITE", 25)
    evidence.reject("1-10", "TIME_LATE", 100)
    evidence.sources["1-10"].reasons["NON_FINITE"] = "range_m: expected a finite number, was inf"
    found = said(evidence)
    assert (found.code, found.severity) == ("values_rejected", "warning")
    assert found.sentence == (
        "1-10: 3% of its 725 measurements were rejected because of their values (25 NON_FINITE; "
        "the first: range_m: expected a finite number, was inf); correct or remove these "
        "measurements"
    )


@pytest.mark.parametrize(
    ("reason", "codes"),
    [
        ("mode_3a: expected four octal digits, was 1819", ["values_rejected"]),
        ("range_m: expected a range within the instrumented range of the sensor, was 3e5", []),
    ],
)
def test_values_outside_their_limits_are_reported_but_not_plots_beyond_the_range(
    reason: str, codes: list[str]
) -> None:
    evidence = evidence_of(recording(), UPDATED=600)
    evidence.reject("1-10", "OUT_OF_RANGE", 150)
    evidence.sources["1-10"].reasons["OUT_OF_RANGE"] = reason
    assert [one.code for one in diagnose(evidence)] == codes


def test_a_disabled_sensor_has_no_losses() -> None:
    evidence = evidence_of(recording(), UPDATED=600)
    evidence.reject("1-10", "SENSOR_DISABLED", 900)
    assert diagnose(evidence) == []


@pytest.mark.parametrize(("every", "known"), [(2, True), (20, True), (10_000, False)])
def test_reports_under_the_name_of_a_radar_are_named(every: int, *, known: bool) -> None:
    reports = pl.int_range(pl.len()) % every == 0
    one = recording().changed("1-10", kind=pl.when(reports).then(pl.lit("adsb")).otherwise("kind"))
    evidence = evidence_of(one)
    own = one.frame.filter(sensor_id="1-10", kind="adsb").height
    evidence.reject("1-10", "UNKNOWN_KIND", own)
    found = [(said.sensor_id, said.code) for said in diagnose(evidence)]
    assert found == ([("1-10", "kind")] if known else [])


@pytest.mark.parametrize(
    ("kind", "remedy"),
    [
        ("Radar", "write radar in lower case in the column kind"),
        ("rdr", "write radar, adsb, mlat or bearing in the column kind"),
        ("adsb", "its measurements have ranges: correct their column kind"),
        ("bearing", 'declare it as kind = "direction-finder"'),
    ],
)
def test_a_wrong_kind_of_measurements_is_reported_with_what_to_correct(
    kind: str, remedy: str
) -> None:
    one = recording().changed("1-10", kind=pl.lit(kind))
    evidence = evidence_of(one)
    evidence.reject("1-10", "UNKNOWN_KIND", 900)
    assert remedy in said(evidence).sentence


@pytest.mark.parametrize("only", [("1-10",), ("1-10", "2-10", "3-10")])
def test_sigmas_far_below_the_scatter_are_reported_without_a_measured_noise(
    only: tuple[str, ...],
) -> None:
    one = recording().only(*only)
    for name in only:
        one = one.configured(name, range_sigma_m=1.0, azimuth_sigma_deg=0.002)
    found = one.diagnosed()
    assert [(said.sensor_id, said.code) for said in found] == [(name, "noise") for name in only]
    assert "range_sigma_m and azimuth_sigma_deg are probably too small" in found[0].sentence
    scatter = re.search(r"plots scatter by (\d+) m about the path", found[0].sentence)
    assert scatter is not None
    assert float(scatter[1]) == pytest.approx(SIGMAS[0], rel=0.15)


def test_plots_of_a_surface_movement_radar_are_a_warning() -> None:
    near = recording().changed("1-10", height_m=pl.lit(None, pl.Float64), range_m=RANGE % 3000.0)
    evidence = evidence_of(near.only("1-10"), UNASSOCIATED=900, UPDATED=0)
    losses = losses_of(evidence, "1-10")
    found = check_unexplained_losses(evidence, "1-10", losses)
    assert found is not None
    assert (found.code, found.severity) == ("measurements_lost", "warning")
    assert "most of its ranges are shorter (a surface movement radar?)" in found.sentence


def test_turns_between_plots_are_no_scatter() -> None:
    """Fighters that turn by 30° between two plots."""
    turns, number = np.arange(200), np.repeat(np.arange(4), 200)
    angle = np.radians(30.0) * np.tile(turns, 4)
    east, north = 60e3 + 5e3 * number + 5e3 * np.sin(angle), 5e3 * np.cos(angle)
    missing = np.full(len(number), np.nan)
    plots = Plots(
        (10.0 * np.tile(turns, 4) + number).astype(np.float64), np.hypot(east, north),
        np.degrees(np.arctan2(east, north)), missing, missing, missing,
        number[:, None] * np.ones((1, 3), np.int64),
    )  # fmt: skip
    assert check_scatter(evidence_of(recording()), "1-10", plots, number) is None


@pytest.mark.parametrize(("code", "count"), [("MISSING_FIELD", 6), ("OUT_OF_RANGE", 200)])
def test_some_rejected_values_are_no_mistake(code: str, count: int) -> None:
    evidence = evidence_of(recording(), UPDATED=600)
    evidence.reject("1-10", code, count)
    assert diagnose(evidence) == []


def test_losses_beside_a_known_cause_are_not_reported_again() -> None:
    wrong = recording().changed("2-10", range_m=pl.col("range_m") / 1e3)
    found = diagnose(evidence_of(wrong, UPDATED=100, REFUSED=300))
    assert [(one.sensor_id, one.code) for one in found] == [("2-10", "range_unit")]


@pytest.mark.parametrize(
    ("noise", "words"),
    [
        ((0.06, 1.0), "range_sigma_m is probably too large: it is 40 in the sensors file, but the "
         "measured noise is 0.06 times as large"),
        ((1.1, 38.2), "azimuth_sigma_deg is probably too small: it is 0.06 in the sensors file, "
         "but the measured noise is 38 times as large"),
        ((0.17, 0.15), "range_sigma_m and azimuth_sigma_deg are probably too large: range_sigma_m "
         "is 40 in the sensors file, but the measured noise is 0.17 times as large; "
         "azimuth_sigma_deg is 0.06, but the measured noise is 0.15 times as large; correct them"),
        ((0.17, 38.2), "range_sigma_m is probably too large and azimuth_sigma_deg too small: "),
    ],
)  # fmt: skip
def test_noise_far_from_its_sigma_is_reported(noise: tuple[float, float], words: str) -> None:
    evidence = evidence_of(recording())
    evidence.noise["1-10"] = noise
    assert words in said(evidence).sentence


def test_sigmas_from_scatter_and_from_noise_are_reported_together() -> None:
    wrong = recording().configured("1-10", range_sigma_m=4000.0)
    evidence = evidence_of(wrong)
    evidence.noise["1-10"] = (0.1, 0.15)
    sentence = said(evidence).sentence
    assert "range_sigma_m and azimuth_sigma_deg are probably too large" in sentence
    assert "its plots scatter by " in sentence
    assert "the measured noise is 0.15 times as large" in sentence


@pytest.mark.parametrize(
    ("noise", "severity"),
    [((2.8, 1.0), "warning"), ((1.0, 0.36), "warning"), ((6.1, 1.0), "error"),
     ((1.0, 0.2), "error"), ((6.1, 2.8), "error")],
)  # fmt: skip
def test_noise_some_times_its_sigma_is_a_warning(noise: tuple[float, float], severity: str) -> None:
    evidence = evidence_of_noise(noise) if max(noise) > 1.0 else evidence_of(recording())
    evidence.noise["1-10"] = noise
    assert (said(evidence).code, said(evidence).severity) == ("noise", severity)


# The noise of a radar with a sigma that is too small shows in the innovations of the others, too.
def test_noise_that_follows_from_that_of_another_radar_is_not_reported() -> None:
    evidence = evidence_of_noise((1.0, 4.2), (2.0, 1.0), (1.0, 1.2))
    assert said(evidence).sensor_id == "1-10"


# Innovations contain the manoeuvres of aircraft.
@pytest.mark.parametrize("turn_rad", [0.0, 0.01])
def test_manoeuvres_of_aircraft_are_no_noise(turn_rad: float) -> None:
    evidence = evidence_of_noise((1.0, 1.0), turn_rad=turn_rad)
    evidence.noise["1-10"] = (2.3, 2.8)
    assert diagnose(evidence) == []


def test_small_innovations_are_no_noise_where_plots_scatter_more() -> None:
    evidence = evidence_of_noise((1.0, 1.0))
    evidence.noise["1-10"] = (0.54, 0.5)
    assert diagnose(evidence) == []


def test_a_warning_hides_no_losses() -> None:
    evidence = evidence_of(recording(), UPDATED=600, REFUSED=400)
    evidence.noise["1-10"] = (2.8, 1.0)
    assert said(evidence).code == "measurements_lost"


@pytest.mark.parametrize("ranges", [True, False])
def test_bearings_of_a_radar_that_have_ranges_are_plots(*, ranges: bool) -> None:
    one = recording().changed("1-10", kind=pl.lit("bearing"))
    # Without ranges, they are those of a radar under jamming.
    one = one if ranges else one.changed("1-10", range_m=pl.lit(None, pl.Float64))
    found = [said for said in one.diagnosed() if said.code == "kind"]
    assert [said.sensor_id for said in found] == (["1-10"] if ranges else [])
    assert not ranges or "are of kind bearing, but have ranges, which are not used" in (
        found[0].sentence
    )


@pytest.mark.parametrize(("kind", "other"), [("adsb", "mlat"), ("mlat", "adsb")])
def test_a_kind_of_positions_declared_as_the_other_is_reported(
    kind: Literal["adsb", "mlat"], other: Literal["adsb", "mlat"]
) -> None:
    frame = recording(positions=True).frame.with_columns(kind=pl.lit(kind))
    sensors = tuple(Sensor(id=name, kind=other) for name in ("1-10", "2-10", "3-10"))
    found = [one for one in Recording(frame, sensors).diagnosed() if one.sensor_id == "1-10"]
    assert [one.code for one in found] == ["kind"]
    assert f"of kind {kind}, but the sensors file declares {other}" in found[0].sentence
    right = Recording(frame, tuple(Sensor(id=one.id, kind=kind) for one in sensors))
    assert "kind" not in [code for _, code in right.codes()]


@pytest.mark.parametrize("noise", [(0.6, 1.7), (np.nan, np.nan)])
def test_noise_near_its_sigma_or_unknown_is_not(noise: tuple[float, float]) -> None:
    evidence = evidence_of(recording())
    evidence.noise["1-10"] = noise
    assert diagnose(evidence) == []


def test_exact_copies_are_reported_and_near_copies_are_not() -> None:
    one = recording()
    again = one.frame.filter(sensor_id="1-10")
    double = Recording(pl.concat([one.frame, again]).sort("time_s"), one.sensors)
    assert double.codes() == [("1-10", "measurements_twice")]
    near = again.with_columns(pl.col("range_m") + 1.0)
    copies = Recording(pl.concat([one.frame, near]).sort("time_s"), one.sensors)
    assert copies.diagnosed() == []


def test_no_confirmed_track_is_reported_with_the_times() -> None:
    evidence = evidence_of(recording())
    evidence.confirmed = False
    found = said(evidence)
    assert (found.sensor_id, found.code) == ("", "no_tracks")
    assert "2018-08-01 08:00:00 UTC to 2018-08-01 08:0" in found.sentence


@pytest.mark.parametrize(("rows", "codes"), [(19, []), (20, ["no_tracks"])])
def test_no_track_from_a_few_measurements_is_no_mistake(rows: int, codes: list[str]) -> None:
    whole = recording()
    first = whole.frame.filter(pl.col("sensor_id") == whole.sensors[0].id).head(rows)
    one = Recording(first, whole.sensors[:1])
    evidence = Evidence(one.table())
    evidence.record_rows(one.frame)
    assert [found.code for found in diagnose(evidence)] == codes


def test_a_direction_finder_with_azimuths_of_another_form_is_named() -> None:
    one = recording()
    name, *_ = RADARS
    finder = Sensor.model_validate(
        {
            **one.sensors[0].model_dump(
                exclude_none=True, exclude={"range_sigma_m", "rotation_period_s", "bias"}
            ),
            "kind": "direction-finder", "range_max_m": 400_000.0,
        }
    )  # fmt: skip
    sensors = (finder, *one.sensors[1:])
    signed = pl.col("azimuth_deg") - 180.0
    found = replace(one, sensors=sensors).changed(
        name, kind=pl.lit("bearing"), range_m=pl.lit(None, pl.Float64), azimuth_deg=signed
    )
    (said,) = found.diagnosed()
    assert (said.sensor_id, said.code) == (name, "measurements_lost")
    assert "check the values and the unit of azimuth_deg" in said.sentence
