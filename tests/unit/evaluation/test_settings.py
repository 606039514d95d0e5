"""Default settings of an evaluation: published figures depend on them."""

from dataclasses import asdict

from multiradar.evaluation.settings import EvaluationSettings


def test_the_defaults_are_those_of_all_figures() -> None:
    assert asdict(EvaluationSettings()) == {
        "step_s": 4.0,
        "gate_m": 2000.0,
        "age_max_s": 12.0,
        "reference_gap_s": 15.0,
        "cutoff_m": 1000.0,
        "order": 2.0,
        "dwell_s": 20.0,
        "gap_s": 16.4,
        "settling_s": 0.0,
        "reference_sigma_m": 0.0,
        "density": 30.0,
        "scan_period_s": None,
        "partial": False,
        "tentative": False,
        "whole_reference": False,
    }
