"""Rows of the study of section 1.6, for programs."""

from multiradar.report.content import Value
from multiradar.research.studies.bias_estimation.bands import Bands
from multiradar.research.studies.bias_estimation.cases import Case, Findings
from multiradar.research.studies.bias_estimation.runs import CONSISTENCIES, QUANTITIES


def all_rows(findings: Findings) -> list[dict[str, Value]]:
    """Return a row for each filter, form, drift, time and quantity.

    Returns
    -------
    list of dict
        With the keys of ``docs/validation/studies.md``.
    """
    rows: list[dict[str, Value]] = []
    for case in findings.cases:
        bands = findings.bands[case.drift]
        density = findings.settings[case.drift].options.acceleration_density
        for t, time_s in enumerate(case.times_s.tolist()):
            start: dict[str, Value] = {
                "filter": case.name,
                "measurement": case.form,
                "drift": case.drift,
                "acceleration_density": density,
                "time_s": time_s,
            }
            rows.extend(start | row for row in _errors(case, t))
            rows.extend(start | row for row in _consistency(case, bands, t))
    return rows


def _errors(case: Case, t: int) -> list[dict[str, Value]]:
    return [
        {
            "quantity": name,
            "mean_error": float(case.mean[t, column]),
            "theoretical": float(case.theoretical[t, column]),
            "reported": float(case.reported[t, column]),
            "one_run": float(case.one[t, column]),
            "band_low": None,
            "band_high": None,
            "all_times_low": None,
            "all_times_high": None,
        }
        for column, name in enumerate(QUANTITIES)
    ]


def _consistency(case: Case, bands: Bands, t: int) -> list[dict[str, Value]]:
    return [
        {
            "quantity": name,
            "mean_error": float(case.nees[t, column]),
            "theoretical": float(case.expected_nees[t, column]),
            "reported": 1.0,
            "one_run": None,
            "band_low": float(bands.low[t, column]),
            "band_high": float(bands.high[t, column]),
            "all_times_low": float(bands.all_low[t, column]),
            "all_times_high": float(bands.all_high[t, column]),
        }
        for column, name in enumerate(CONSISTENCIES)
    ]
