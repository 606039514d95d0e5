"""Prints the gain from plots later than the reordering horizon, by four methods.

::

    python -m validation.tracker.check_late

One aircraft with white acceleration, three radars (one plot in 4 s each, 60 m on each axis). The
third radar is later than the horizon allows: when its plot arrives, the state is ahead by `late`.
Its offset (prior 500 m on each axis) is estimated as well. The methods: *rejected*, as in the
service; *retrodicted*, one step back over all updates since; *exact*, all filtered again in order,
the optimum; *waited for*, with a horizon longer by `late`. Given are RMS position errors at each
update and at the time of display (6 s of horizon later, or 6 s + `late`), and error² / sigma² at
updates, which is 1 where sigma is right.

The step back is that of Y. Bar-Shalom, H. Chen and M. Mallick, "One-step solution for the multistep
out-of-sequence-measurement problem in tracking", IEEE Transactions on Aerospace and Electronic
Systems 40 (2004), 27-37.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

RUNS, DURATION_S, SETTLED_S = 400, 300.0, 80.0
SCAN_S, SIGMA_M, HORIZON_S = 4.0, 60.0, 6.0
OFFSET_SIGMA_M = 500.0
LATE_S = (2.0, 4.0, 8.0)
DENSITIES = (0.01, 0.3, 4.0)
METHODS = ("rejected", "retrodicted", "exact", "waited for")
SEED = 7


@dataclass(frozen=True)
class Plot:
    """One plot: time of measurement, time of processing, radar, and values of all runs."""

    time_s: float
    processed_s: float
    radar: int
    value: Floats


@dataclass(frozen=True)
class State:
    """Estimates of all runs (n, 6): east, north, rates and offset, with one covariance."""

    time_s: float
    mean: Floats
    covariance: Floats


def moved(state: State, time_s: float, density: float) -> State:
    """Extrapolate a state forwards, or backwards without noise."""
    step, noise = motion(time_s - state.time_s, density)
    return State(time_s, state.mean @ step.T, step @ state.covariance @ step.T + noise)


def motion(ahead_s: float, density: float) -> tuple[Floats, Floats]:
    """Return transition matrix and process noise covariance."""
    step = np.eye(6)
    step[0, 2] = step[1, 3] = ahead_s
    noise = np.zeros((6, 6))
    if ahead_s > 0.0:
        part = density * np.array([[ahead_s**3 / 3, ahead_s**2 / 2], [ahead_s**2 / 2, ahead_s]])
        for axis in (0, 1):
            noise[axis : axis + 3 : 2, axis : axis + 3 : 2] = part
    return step, noise


def seen(plot: Plot) -> Floats:
    """Return the measurement matrix of a plot."""
    matrix = np.zeros((2, 6))
    matrix[0, 0] = matrix[1, 1] = 1.0
    if plot.radar == 2:
        matrix[0, 4] = matrix[1, 5] = 1.0
    return matrix


def update(state: State, plot: Plot) -> State:
    """Update with a plot at the time of the state."""
    return updated(state, plot, state.mean, state.covariance, state.covariance)


def retrodicted(now: State, before: State, plot: Plot, density: float) -> State:
    """Update with a plot older than the state and not older than ``before``."""
    predicted = moved(before, now.time_s, density)
    back, _ = motion(plot.time_s - now.time_s, density)
    _, noise = motion(now.time_s - plot.time_s, density)
    inverse = np.linalg.inv(predicted.covariance)
    # All updates since, as one measurement of the whole state.
    weight = inverse @ (predicted.covariance - now.covariance) @ inverse
    equivalent = (now.mean - predicted.mean) @ inverse
    # The state at the time of the plot, and its covariance with the present state.
    mean = (now.mean - equivalent @ noise) @ back.T
    own = noise - noise @ weight @ noise
    common = noise - predicted.covariance @ weight @ noise
    covariance = back @ (now.covariance + own - common - common.T) @ back.T
    return updated(now, plot, mean, covariance, (now.covariance - common) @ back.T)


def updated(state: State, plot: Plot, mean: Floats, covariance: Floats, shared: Floats) -> State:
    """Update a state with a plot of another state, by their cross-covariance."""
    matrix = seen(plot)
    spread = matrix @ covariance @ matrix.T + SIGMA_M**2 * np.eye(2)
    gain = np.linalg.solve(spread, matrix @ shared.T).T
    corrected_mean = state.mean + (plot.value - mean @ matrix.T) @ gain.T
    return State(state.time_s, corrected_mean, state.covariance - gain @ spread @ gain.T)


def run(plots: list[Plot], first: Floats, density: float, method: str) -> list[State]:
    """Return the states after each plot that arrived in time, in processing order."""
    prior = np.diag([SIGMA_M**2] * 2 + [300.0**2] * 2 + [OFFSET_SIGMA_M**2] * 2)
    kept = [State(0.0, first, prior)]
    processed: list[Plot] = []
    states = []
    for plot in sorted(plots, key=lambda one: (one.processed_s, one.radar)):
        if plot.time_s >= kept[-1].time_s:
            processed.append(plot)
            kept.append(update(moved(kept[-1], plot.time_s, density), plot))
            states.append(kept[-1])
        elif method == "retrodicted":
            before = next(one for one in reversed(kept) if one.time_s <= plot.time_s)
            kept[-1] = retrodicted(kept[-1], before, plot, density)
        elif method == "exact":
            index = next(n for n in range(len(kept), 0, -1) if kept[n - 1].time_s <= plot.time_s)
            processed.insert(index - 1, plot)
            del kept[index:]
            for one in processed[index - 1 :]:
                kept.append(update(moved(kept[-1], one.time_s, density), one))
    return states


def main() -> None:
    """Print a Markdown table."""
    names = [
        f"{what}, {method}" for what in ("update", "shown", "error² / sigma²") for method in METHODS
    ]
    print(f"| density, m²/s³ | late, s | {' | '.join(names)} |\n|{'---|' * (len(names) + 2)}")
    for density in DENSITIES:
        for late_s in LATE_S:
            print(f"| {density:g} | {late_s:g} | {' | '.join(row(density, late_s))} |", flush=True)


def row(density: float, late_s: float) -> list[str]:
    """Return the figures of one case as text."""
    grid, truth = flown(np.random.Generator(np.random.PCG64(SEED)), density)
    rng = np.random.Generator(np.random.PCG64(SEED + 1))
    offset = OFFSET_SIGMA_M * rng.normal(size=(RUNS, 2))
    first = np.zeros((RUNS, 6))
    first[:, :2] = truth[:, 0, :2] + SIGMA_M * rng.normal(size=(RUNS, 2))
    first[:, 2:4] = truth[:, 0, 2:] + 300.0 * rng.normal(size=(RUNS, 2))
    stamps = [(scan + radar / 3.0, radar) for scan in range(1, int(DURATION_S / SCAN_S) - 1)
              for radar in range(3)]  # fmt: skip
    noise = SIGMA_M * rng.normal(size=(len(stamps), RUNS, 2))
    found: dict[str, list[str]] = {"update": [], "shown": [], "nes": []}
    for method in METHODS:
        plots = []
        for (scan, radar), error in zip(stamps, noise, strict=True):
            time_s = SCAN_S * scan
            value = state_at(grid, truth, time_s)[:, :2] + error + (radar == 2) * offset
            delay_s = late_s if radar == 2 and method != "waited for" else 0.0
            plots.append(Plot(time_s, time_s + delay_s, radar, value))
        shown_s = HORIZON_S + (late_s if method == "waited for" else 0.0)
        states = [one for one in run(plots, first, density, method) if one.time_s > SETTLED_S]
        errors = [one.mean[:, :2] - state_at(grid, truth, one.time_s)[:, :2] for one in states]
        ahead = [
            moved(one, one.time_s + shown_s, density).mean[:, :2]
            - state_at(grid, truth, one.time_s + shown_s)[:, :2]
            for one in states if one.time_s + shown_s < DURATION_S
        ]  # fmt: skip
        variances = [one.covariance[0, 0] + one.covariance[1, 1] for one in states]
        squares = [np.sum(error**2, axis=1) for error in errors]
        nes = np.mean([np.mean(one) / var for one, var in zip(squares, variances, strict=True)])
        found["update"].append(f"{np.sqrt(np.mean(squares)):.1f} m")
        found["shown"].append(f"{np.sqrt(np.mean([np.sum(e**2, axis=1) for e in ahead])):.1f} m")
        found["nes"].append(f"{nes:.2f}")
    return [*found["update"], *found["shown"], *found["nes"]]


def flown(rng: np.random.Generator, density: float) -> tuple[Floats, Floats]:
    """Return a grid of times and the true states (runs, t, 4) on it."""
    step_s = SCAN_S / 12.0
    grid = np.arange(0.0, DURATION_S + step_s, step_s)
    step, noise = motion(step_s, density)
    root = np.linalg.cholesky(noise[:4, :4] + 1e-12 * np.eye(4))
    truth = np.zeros((RUNS, len(grid), 4))
    truth[:, 0, 2:] = 200.0 * rng.normal(size=(RUNS, 2))
    for n in range(1, len(grid)):
        truth[:, n] = truth[:, n - 1] @ step[:4, :4].T + rng.normal(size=(RUNS, 4)) @ root.T
    return grid, truth


def state_at(grid: Floats, truth: Floats, time_s: float) -> Floats:
    """Return the true states (runs, 4) at a time of the grid."""
    return truth[:, int(np.rint(time_s / (grid[1] - grid[0])))]


if __name__ == "__main__":
    main()
