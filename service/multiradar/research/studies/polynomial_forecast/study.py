"""The three tables of Koptev, Rozov and Romanovsky: exact, Monte Carlo and published values.

A trajectory X_t = α_0 + α_1 t + α_2 t²/2 with normal α is observed through dη = X dt + √C₂ dw. The
variance of the error of the filter falls while it is observed; that of the forecast grows after the
last observation.
"""

from collections.abc import Sequence

import numpy as np

from multiradar.report.cells import number_text
from multiradar.report.content import Table, Value
from multiradar.research.studies.catalogue import POLYNOMIAL_FORECAST
from multiradar.research.studies.polynomial_forecast.plots import plots
from multiradar.research.studies.polynomial_forecast.runs import (
    FILTER_TIMES_S,
    FORECAST_FROM_S,
    HORIZONS_S,
    INTENSITIES,
    STEP_S,
    Figure,
    band,
    simulate,
)
from multiradar.research.studies.result import Progress, StudyOptions, StudyResult, step_counter

#: Published variances, m²: C₂ and time of the last observation to values at t = 2 … 10 s (None:
#: the filter) or 2 … 10 s after it. No forecast from 20 s for C₂ = 1 is published.
PUBLISHED: dict[tuple[float, float | None], tuple[float, ...]] = {
    (0.1, None): (0.180, 0.120, 0.123, 0.109, 0.094),
    (1.0, None): (1.77, 0.605, 0.892, 0.908, 0.871),
    (0.1, 10.0): (0.382, 1.08, 2.48, 4.92, 8.79),
    (1.0, 10.0): (3.42, 9.62, 21.9, 43.1, 76.9),
    (0.1, 20.0): (0.098, 0.189, 0.332, 0.544, 0.845),
}
SUMMARY = (
    "A trajectory that is quadratic in time, with normally distributed coefficients (variances 100 "
    "m², 25 (m/s)² and 0.04 (m/s²)²), is observed in white noise of intensity C₂. How accurate is "
    "the filtered position during the observation, and how quickly does a forecast deteriorate "
    "after the last observation?"
)
# Upper bound of the search for the number of runs of the paper.
_RUNS_SEARCHED = 100_000


def run(options: StudyOptions, progress: Progress) -> StudyResult:
    """Compute the tables, and simulate them.

    Parameters
    ----------
    options : StudyOptions
        `runs` trajectories for each C₂, and the seed.
    progress : callable
        Called with the number of completed observation intervals.

    Returns
    -------
    StudyResult
        Rows as in docs/validation/studies.md.

    References
    ----------
    Koptev, Rozov, Romanovsky, the section on the simulation: its three tables and its figure 2.
    """
    runs = POLYNOMIAL_FORECAST.complete(options).runs
    assert runs is not None
    rng = np.random.Generator(np.random.PCG64(options.seed))
    figures: list[Figure] = []
    step = step_counter(progress, round(FORECAST_FROM_S[-1] / STEP_S) * len(INTENSITIES))
    for intensity in INTENSITIES:
        figures += simulate(intensity, rng, runs, step)
    edges = band(runs)
    rows = [_row(figure, edges) for figure in figures]
    return StudyResult(
        study=POLYNOMIAL_FORECAST.name,
        title=POLYNOMIAL_FORECAST.title,
        seed=options.seed,
        rows=rows,
        tables=[
            _table("Filter error variance, m²", rows, None),
            *(
                _table(f"Forecast error variance from t* = {begin:g} s, m²", rows, begin)
                for begin in FORECAST_FROM_S
            ),
        ],
        plots=plots(rows, options.seed),
        notes=_notes(figures, rows, runs),
        summary=SUMMARY,
        options={"runs": runs},
    )


def published_value(figure: Figure) -> float | None:
    """Return the published value of a cell, None where there is none.

    References
    ----------
    Koptev, Rozov, Romanovsky, the section on the simulation: its tables.
    """
    ahead = figure.time_s - figure.observed_until_s
    until, times, time = (
        (figure.observed_until_s, HORIZONS_S, ahead)
        if ahead
        else (None, FILTER_TIMES_S, figure.time_s)
    )
    values = PUBLISHED.get((figure.intensity, until))
    return values[times.index(time)] if values else None


def largest_consistent_runs(ratios: Sequence[float]) -> int:
    """Return the largest number of runs whose 99.9 % band contains all ratios to the exact values.

    References
    ----------
    The project's own: the band is that of χ².
    """
    low, high = 2, _RUNS_SEARCHED
    while low < high:
        middle = (low + high + 1) // 2
        edges = band(middle)
        if edges[0] <= min(ratios) and max(ratios) <= edges[1]:
            low = middle
        else:
            high = middle - 1
    return low


def _row(figure: Figure, edges: tuple[float, float]) -> dict[str, Value]:
    ahead = figure.time_s > figure.observed_until_s
    return {
        "noise_intensity": figure.intensity,
        "observed_until_s": figure.observed_until_s,
        "time_s": figure.time_s,
        "quantity": "forecast_variance" if ahead else "filter_variance",
        "exact": figure.exact,
        "monte_carlo": figure.mean_square,
        "band_low": figure.exact * edges[0],
        "band_high": figure.exact * edges[1],
        "printed": published_value(figure),
    }


def _table(title: str, rows: list[dict[str, Value]], begin: float | None) -> Table:
    quantity = "filter_variance" if begin is None else "forecast_variance"
    chosen = [
        row
        for row in rows
        if row["quantity"] == quantity and begin in (None, row["observed_until_s"])
    ]
    cells = [
        (
            row["noise_intensity"],
            row["time_s"],
            row["exact"],
            row["monte_carlo"],
            " … ".join(number_text(float(row[name] or 0.0)) for name in ("band_low", "band_high")),
            _inside(row),
            row["printed"],
        )
        for row in chosen
    ]
    return Table(
        title=title,
        header=("C₂, m²·s", "t, s", "exact", "Monte Carlo", "99.9 % band", "in band", "published"),
        rows=tuple(cells),
        caption="Exact: Bayesian linear regression. The band applies to the Monte Carlo value.",
    )


def _inside(row: dict[str, Value]) -> bool:
    low, value, high = (
        float(row[name] or 0.0) for name in ("band_low", "monte_carlo", "band_high")
    )
    return low <= value <= high


def _notes(figures: list[Figure], rows: list[dict[str, Value]], runs: int) -> list[str]:
    apart = max(abs(figure.filtered / figure.exact - 1.0) for figure in figures)
    inside = sum(map(_inside, rows))
    return [
        "The variances of the filter and of the regression agree to within a relative difference "
        f"of {apart:.1g}. The filter accumulates information in a basis of Legendre polynomials, "
        "without numerical integration. The paper's equations for γ, integrated with Euler steps "
        "of 1 ms, no longer yield a valid covariance after the first step for C₂ = 0.1 m²·s, and "
        "diverge later.",
        f"{inside} of {len(rows)} mean squared errors over {runs} runs lie within their 99.9 % "
        "bands. The values of a run are correlated; with about one seed in fifty, one value lies "
        "outside its band.",
        _note_on_published_values(figures),
        "Misprints in the paper are corrected: the gain is (γ₀₀, γ₁₀, γ₂₀)/C₂, the last term of "
        "the equation for γ₀₁ is γ₀₀ γ₀₁/C₂, and C₂ is an intensity in m²·s. In figure 2, the "
        "value of −2 m/s² belongs to α₂, not α₀. This value is ten prior sigmas away from its "
        "prior mean, so the filter lags until it has enough observations.",
    ]


def _note_on_published_values(figures: list[Figure]) -> str:
    ratios = {
        (figure.time_s > figure.observed_until_s, figure.time_s, figure.intensity): value
        / figure.exact
        for figure in figures
        if (value := published_value(figure)) is not None
    }
    furthest = max(ratios, key=lambda cell: abs(ratios[cell] - 1.0))
    others = [ratio for cell, ratio in ratios.items() if cell != furthest]
    ahead = [ratio for (forecast, *_), ratio in ratios.items() if forecast]
    all_runs, other_runs = map(largest_consistent_runs, (list(ratios.values()), others))
    return (
        "The published values are mean squared errors over an unpublished number of runs. The "
        f"value that differs most from the exact value (t = {furthest[1]:g} s, C₂ = "
        f"{furthest[2]:g} m²·s) is {ratios[furthest]:.2f} times as large. All {len(ratios)} values "
        f"lie within their 99.9 % bands only if the number of runs was at most {all_runs}; without "
        f"this value, it was at most {other_runs}. The published forecast variances are "
        f"{min(ahead):.2f} to {max(ahead):.2f} times the exact values; all deviate in the same "
        "direction because they were computed from the same trajectories."
    )
