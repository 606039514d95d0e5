"""Plots and reports merge by time, however the plots are cut into blocks."""

import numpy as np
import pytest

from multiradar_converters.vid.naming import NamedPlots
from multiradar_converters.vid.records import PLOT_WORDS, REPORT_WORDS, decimal, times
from multiradar_converters.vid.table import table_rows

PLOT_TIMES = np.array([1.0, 2.0, 2.0, 2.0, 3.0])
REPORT_TIMES = np.array([0.5, 2.0, 2.0, 3.0, 9.0])


@pytest.mark.parametrize("cuts", [(), (1,), (2,), (1, 2, 3, 4)])
@pytest.mark.parametrize("report_cuts", [(), (1,), (2,)])
def test_a_plot_comes_before_a_report_of_its_time(
    cuts: tuple[int, ...], report_cuts: tuple[int, ...]
) -> None:
    plots = np.zeros((5, PLOT_WORDS), dtype=np.int64)
    plots.view(np.float64)[:, 0] = PLOT_TIMES
    plots.view(np.float64)[:, 1] = np.arange(5.0)
    reports = np.zeros((5, REPORT_WORDS), dtype=np.int64)
    reports.view(np.float64)[:, 0] = REPORT_TIMES
    reports.view(np.float64)[:, 3] = np.arange(5.0)
    none = np.empty(0, dtype=np.int64)
    named = (NamedPlots(part, np.full(len(part), -1), none, none) for part in np.split(plots, cuts))
    rows = np.concatenate(list(table_rows(named, iter(np.split(reports, report_cuts)))))
    found = [
        (time, "report" if np.isnan(number) else "plot", height if np.isnan(number) else number)
        for time, number, height in zip(
            times(rows).tolist(), decimal(rows, 1).tolist(), decimal(rows, 5).tolist(), strict=True
        )
    ]
    both = [(time, "plot", float(k)) for k, time in enumerate(PLOT_TIMES.tolist())]
    both += [(time, "report", float(k)) for k, time in enumerate(REPORT_TIMES.tolist())]
    assert found == sorted(both)
