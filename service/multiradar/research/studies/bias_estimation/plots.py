"""Plots of the study of section 1.6: figures 1.1 to 1.17 of the report."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from multiradar.report.content import Plot, Series, Style
from multiradar.research.sequential.plots import FORMS
from multiradar.research.studies.bias_estimation.cases import Case, Findings
from multiradar.research.studies.bias_estimation.runs import CONSISTENCIES, QUANTITIES, Setting

Floats = NDArray[np.float64]

# Title, axis and tail of the picture's name, for each quantity.
_LABELS = {
    "position_m": ("Position", "m"),
    "velocity_mps": ("Velocity", "m/s"),
    "azimuth_bias_deg": ("Azimuth bias", "°"),
    "range_bias_m": ("Range bias", "m"),
}
# Figures of the report, one for each quantity, in their order.
_COMPARED_FROM = 14
_FILTERS_FROM = {"joint": 2, "blom": 6, "ci": 10}
_NEES_TITLES = {"nees_aircraft": "Aircraft", "nees_bias": "Biases"}
_TIME = "time, s"
# Margin of the axis below and above the band of all times, as a fraction of its width.
_MARGIN = 0.2


def all_plots(findings: Findings) -> list[Plot]:
    """Return the plots: the comparison of the filters first, then each filter, the scenario last.

    Returns
    -------
    list of Plot
        Grouped by form of the measurement and kind of drift.
    """
    plots: list[Plot] = []
    groups = [
        [case for case in findings.cases if (case.form, case.drift) == (form, drift)]
        for drift in (False, True)
        for form in FORMS
    ]
    for cases in groups:
        plots += [_comparison(cases, column) for column in range(len(QUANTITIES))]
    for cases in groups:
        whole = [_consistency(cases, findings, column) for column in range(len(CONSISTENCIES))]
        plots += [*whole, *(_near_one(one) for one in whole)]
    for cases in groups:
        for column in range(len(QUANTITIES)):
            plots += [_one_filter(case, column) for case in cases]
    return [*plots, _scene(findings, findings.settings[False])]


def _which(case: Case) -> str:
    return f"{case.form} measurement, {'drifting' if case.drift else 'constant'} biases"


def _name(case: Case, *parts: str) -> str:
    return "-".join([*parts, case.form, "drift" if case.drift else "constant"]).replace("_", "-")


# Figures 1.14 to 1.17.
def _comparison(cases: list[Case], column: int) -> Plot:
    title, unit = _LABELS[QUANTITIES[column]]
    return Plot(
        title=f"Figure 1.{_COMPARED_FROM + column}: {title.lower()}",
        x_label=_TIME,
        y_label=f"mean error, {unit}",
        series=tuple(
            Series(case.name, case.times_s, case.mean[:, column], key=case.name) for case in cases
        ),
        y_scale="log",
        group=f"All filters: {_which(cases[0])}",
        name=_name(cases[0], "comparison", QUANTITIES[column]),
    )


# Figures 1.2 to 1.13.
def _one_filter(case: Case, column: int) -> Plot:
    title, unit = _LABELS[QUANTITIES[column]]
    drawn: tuple[tuple[str, Floats, Style, str], ...] = (
        ("one run", case.one, "thin", case.name),
        ("mean over runs", case.mean, "line", case.name),
        ("theory, (1.26)", case.theoretical, "dashed", "ink"),
        ("reported", case.reported, "dotted", "ink"),
    )
    first = _FILTERS_FROM.get(case.name)
    figure = "" if first is None else f"Figure 1.{first + column}: "
    return Plot(
        title=f"{figure}{case.name}",
        x_label=_TIME,
        y_label=f"{title.lower()}, {unit}",
        series=tuple(
            Series(label, case.times_s, values[:, column], style, key=key)
            for label, values, style, key in drawn
        ),
        y_scale="log",
        group=f"{title} of each filter: {_which(case)}",
        name=_name(case, case.name, QUANTITIES[column]),
    )


def _consistency(cases: list[Case], findings: Findings, column: int) -> Plot:
    bands = findings.bands[cases[0].drift]
    times = cases[0].times_s
    return Plot(
        title=_NEES_TITLES[CONSISTENCIES[column]],
        x_label=_TIME,
        y_label="NEES per dimension",
        series=(
            Series(
                "95 % band, all times", times, bands.all_low[:, column], "band",
                bands.all_high[:, column], key="band of all times",
            ),
            Series(
                "95 % band, each time", times, bands.low[:, column], "band",
                bands.high[:, column], key="band of one time",
            ),
            Series("expected", times, np.ones_like(times), "reference"),
            *(Series(case.name, times, case.nees[:, column], key=case.name) for case in cases),
        ),
        y_scale="log",
        group=f"Consistency: {_which(cases[0])}",
        name=_name(cases[0], CONSISTENCIES[column]),
    )  # fmt: skip


# The same for nearly consistent filters: the band is too narrow to be visible among all.
def _near_one(plot: Plot) -> Plot:
    band = plot.series[0]
    assert band.y2 is not None
    low, high = float(band.y.min()), float(band.y2.max())
    margin = _MARGIN * (high - low)
    return replace(
        plot,
        title=f"{plot.title}, near 1",
        y_scale="linear",
        y_label=f"{plot.y_label}, {plot.title.lower()}",
        y_limits=(low - margin, high + margin),
        name=f"{plot.name}-near-one",
    )


# Figure 1.1.
def _scene(findings: Findings, setting: Setting) -> Plot:
    kilometres = findings.first[setting.drift].states[:, :, :2] / 1e3
    sites = findings.first[setting.drift].sensors.sites[:, :2] / 1e3
    return Plot(
        title="Figure 1.1: tracks and radars",
        x_label="east, km",
        y_label="north, km",
        series=(
            *(
                Series("aircraft", kilometres[:, one, 0], kilometres[:, one, 1], "track")
                for one in range(kilometres.shape[1])
            ),
            Series("radars", sites[:, 0], sites[:, 1], "points"),
        ),
        equal_axes=True,
        caption="The report does not publish its tracks; the tracks shown were randomly generated "
        "once.",
        name="scene",
    )
