"""The plots of the polynomial-forecast study."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.polynomial.polynomial_filter import (
    estimate,
    forecast,
    observe_increments,
    observe_interval,
    start,
)
from multiradar.report.content import Plot, Series, Style, Value
from multiradar.research.studies.polynomial_forecast.runs import (
    DEGREE,
    FORECAST_FROM_S,
    INTENSITIES,
    PRIOR,
    draw_moments,
    powers_of_time,
    regression_variance,
)

Floats = NDArray[np.float64]

#: α of the drawn trajectory: for its figure 2 the paper gives α₂ = −2 m/s² only.
DRAWN = np.array([10.0, 15.0, -2.0])
#: Duration of the drawn trajectory, and the interval between filter values, s.
DRAWN_S, DRAWN_STEP_S = 20.0, 0.5
#: Styles of Monte Carlo and published values.
MARKS: tuple[Style, Style] = ("points", "rings")
#: Number of single runs in the error plots.
SINGLE_RUNS = 25


def plots(rows: list[dict[str, Value]], seed: int) -> list[Plot]:
    """Draw variances, forecasts and one trajectory.

    Parameters
    ----------
    rows : list of dict
        Rows of the study.
    seed : int
        Seed of the drawn trajectories, separate from those of the tables.

    Returns
    -------
    list of Plot
        Variance of forecasts, of the filter, errors of forecasts, the trajectory and its errors.
    """
    rng = np.random.Generator(np.random.PCG64([seed, 1]))
    return [_forecasts(rows), _filtering(rows), *_forecast_errors(rng), *_trajectory(rng)]


def _filtering(rows: list[dict[str, Value]]) -> Plot:
    times = np.linspace(0.1, 20.0, 200)
    series = []
    for intensity in INTENSITIES:
        exact = np.array([regression_variance(intensity, time, time) for time in times])
        chosen = [row for row in rows if row["quantity"] == "filter_variance"]
        series.append(Series(f"C₂ = {intensity:g} m²·s, exact", times, exact, key=_key(intensity)))
        series += _points(chosen, intensity)
    return Plot(
        title="Filter error variance",
        x_label="observation time, s",
        y_label="variance, m²",
        series=tuple(series),
        y_scale="log",
        caption="Lines: exact; points: Monte Carlo; rings: published.",
        name="filter-variance",
    )


def _forecasts(rows: list[dict[str, Value]]) -> Plot:
    series = []
    for intensity in INTENSITIES:
        for begin in FORECAST_FROM_S:
            times = np.linspace(begin, begin + 10.0, 101)
            exact = np.array([regression_variance(intensity, begin, time) for time in times])
            label = f"C₂ = {intensity:g} m²·s, exact"
            series.append(Series(label, times, exact, key=_key(intensity)))
        chosen = [row for row in rows if row["quantity"] == "forecast_variance"]
        series += _points(chosen, intensity)
    return Plot(
        title="Forecast error variance",
        x_label="t, s",
        y_label="variance, m²",
        series=tuple(series),
        y_scale="log",
        caption="Forecasts from t* = 10 s and t* = 20 s. Ten more seconds of observation reduce "
        "the variance of the ten-second forecast to one tenth.",
        name="forecast-variance",
    )


def _points(rows: list[dict[str, Value]], intensity: float) -> list[Series]:
    selected = [row for row in rows if row["noise_intensity"] == intensity]
    published = [row for row in selected if row["printed"] is not None]
    return [
        Series(
            f"C₂ = {intensity:g} m²·s, {label}",
            np.array([row["time_s"] for row in chosen], np.float64),
            np.array([row[name] for row in chosen], np.float64),
            style,
            key=_key(intensity),
        )
        for label, name, chosen, style in (
            ("Monte Carlo", "monte_carlo", selected, MARKS[0]),
            ("published", "printed", published, MARKS[1]),
        )
    ]


def _forecast_errors(rng: np.random.Generator) -> list[Plot]:
    truth = np.sqrt(np.diagonal(PRIOR))[:, None] * rng.normal(size=(DEGREE + 1, SINGLE_RUNS))
    found = []
    for begin in FORECAST_FROM_S:
        state = start(DEGREE, np.zeros(truth.shape), PRIOR)
        moments = draw_moments(truth, 0.0, begin, INTENSITIES[0], rng)
        state = observe_interval(state, 0.0, begin, moments, INTENSITIES[0])
        ahead = forecast(state, np.linspace(0.0, 10.0, 51))
        errors = ahead.value - powers_of_time(ahead.time_s, DEGREE) @ truth
        sigmas, horizons = np.sqrt(ahead.variance), ahead.time_s - begin
        found.append(
            Plot(
                title=f"Forecast errors from t* = {begin:g} s, C₂ = {INTENSITIES[0]:g} m²·s",
                x_label="time after the last observation, s",
                y_label="forecast − truth, m",
                series=(
                    Series("2 sigma", horizons, -2.0 * sigmas, "band", 2.0 * sigmas, key="sigma"),
                    *(Series("single runs", horizons, one, "thin", key="runs") for one in errors.T),
                ),
                group="Forecast errors",
                caption="At any time, about one line in twenty is outside the two-sigma band.",
                name=f"forecast-fan-{begin:g}",
            )
        )
    return found


def _trajectory(rng: np.random.Generator) -> list[Plot]:
    edges = np.linspace(0.0, DRAWN_S, round(DRAWN_S / DRAWN_STEP_S) + 1)
    truth = powers_of_time(edges, DEGREE) @ DRAWN
    tracks, errors = [Series("X", edges, truth, "reference")], [
        Series("", edges, np.zeros(len(edges)), "reference")
    ]  # fmt: skip
    for intensity in INTENSITIES:
        values, sigmas = _filtered(edges, intensity, rng)
        label, key = f"filter, C₂ = {intensity:g} m²·s", _key(intensity)
        apart = values - truth[1:]
        tracks.append(Series(label, edges[1:], values, key=key))
        errors.append(Series("2 sigma", edges[1:], -2.0 * sigmas, "band", 2.0 * sigmas, key=key))
        errors.append(Series(label, edges[1:], apart, key=key))
    acceleration = f"α₂ = {DRAWN[2]:g} m/s²".replace("-", "−")
    return [
        Plot(
            title=f"Figure 2: trajectory with {acceleration}, true and filtered",
            x_label="t, s",
            y_label="X, m",
            series=tuple(tracks),
            caption="At this scale the true and filtered values coincide.",
            name="trajectory",
        ),
        Plot(
            title="Filter error on this trajectory",
            x_label="t, s",
            y_label="filtered − truth, m",
            series=tuple(errors),
            y_limits=(-6.0, 6.0),
            caption="Because the acceleration is ten prior sigmas away from its prior mean, the "
            "error is outside the band at first: the filter follows a straight line until the "
            "observations outweigh the prior.",
            name="trajectory-error",
        ),
    ]


# Values and sigmas of the filter at each edge except the first.
def _filtered(edges: Floats, intensity: float, rng: np.random.Generator) -> tuple[Floats, Floats]:
    integral = powers_of_time(edges, DEGREE + 1)[:, 1:] @ DRAWN
    noise = rng.normal(size=len(edges) - 1) * np.sqrt(intensity * np.diff(edges))
    increments = np.diff(integral) + noise
    state = start(DEGREE, np.zeros(DEGREE + 1), PRIOR)
    values, variances = [], []
    for pair, increment in zip(pairwise(edges), increments, strict=True):
        state = observe_increments(state, pair, [increment], intensity)
        found = estimate(state, pair[1])
        values.append(float(found.value))
        variances.append(float(found.variance))
    return np.array(values), np.sqrt(variances)


def _key(intensity: float) -> str:
    return f"C₂ = {intensity:g}"
