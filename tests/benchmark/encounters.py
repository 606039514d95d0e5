"""Cost of an encounter query for increasing numbers of aircraft at constant density."""

from time import process_time

import numpy as np

from benchmark.plan import Plan
from benchmark.report import Row
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.memory.history import UPDATE_DTYPE
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.runtime.queries.encounters import TrackSnapshot, encounters
from multiradar.tracking.forecast.forecast_calibration import ForecastCalibration, calibration_for
from multiradar.tracking.forecast.forecast_family import STRAIGHT
from multiradar.tracking.forecast.region_sizes import HORIZONS_S
from multiradar.tracking.mode_states import ModeStates
from multiradar.tracking.outputs import STATE_CONFIRMED, TrackStates
from multiradar.tracking.settings import TrackingSettings

TEXT = (
    "The answer to `GET /v1/encounters` (120 s ahead, 9 260 m, the first 100 pairs) from the "
    "states of the tracks, in CPU time, minimum of the runs. All horizons are calibrated, and "
    "straight flight fits best. Aircraft fly straight, 1 000 on each square of 1 000 km; more "
    "aircraft use a larger airspace. Peer: all pairs in NumPy by the formula of the closest "
    "point of approach, without forecasts, sigmas or probabilities; with 15 000 aircraft its "
    "matrices exceed the memory."
)
AIRCRAFT = (150, 1000, 4000, 15_000)
#: The peer runs out of memory beyond this number.
ALL_PAIRS_MAX = 4000
AIRCRAFT_PER_M2 = 1000.0 / 1e12
RUNS = 5
NOW_S = 1000.0
QUERY = EncounterQuery()
MODES = 8
PLANE = SystemPlane(0.8, 0.2)


def run(plan: Plan) -> list[Row]:
    """Measure both filters and the peer."""
    rows, runs = [], 1 if plan.quick else RUNS
    for name in ("two-stage", "imm"):
        settings = TrackingSettings(filter_name=name)
        for count in (plan.size(one) for one in AIRCRAFT):
            scene = airspace(count, modes=MODES if name == "imm" else 0)
            value = least_ms(scene, settings, runs)
            label = f"{name}, {count} aircraft"
            peer = all_pairs_ms(scene, runs) if count <= ALL_PAIRS_MAX else None
            beside = None if peer is None else "all pairs"
            rows.append(Row(label, value, "ms", runs, beside, peer))
            rows.append(Row(f"{label}, each", 1e3 * value / count, "µs/aircraft", runs))
    return rows


def airspace(count: int, modes: int, seed: int = 1) -> TrackSnapshot:
    """Return tracks of aircraft anywhere in a square, at flight levels."""
    rng = np.random.Generator(np.random.PCG64(seed))
    half_m = 0.5 * np.sqrt(count / AIRCRAFT_PER_M2)
    course, speed = rng.uniform(0.0, 2.0 * np.pi, count), rng.uniform(150.0, 250.0, count)
    mean = np.column_stack(
        [rng.uniform(-half_m, half_m, (count, 2)), speed * np.sin(course), speed * np.cos(course)]
    )
    covariance = np.kron([[2500.0, 100.0], [100.0, 16.0]], np.eye(2))
    climbs = np.tile([0.0, 0.0, 100.0, 0.0, 1.0, 2.0], (count, 1))
    climbs[:, 0] = 300.0 * rng.integers(20, 40, count)
    kept = None
    if modes:
        chances = np.full(modes, 0.02)
        chances[0] = 1.0 - 0.02 * (modes - 1)
        packed = covariance[np.triu_indices(4)]
        kept = ModeStates(
            np.tile(chances, (count, 1)), np.repeat(mean[:, None], modes, axis=1),
            np.tile(packed, (count, modes, 1)),
        )  # fmt: skip
    states = TrackStates(
        np.arange(1, count + 1), rng.uniform(NOW_S - 4.0, NOW_S, count), mean,
        np.tile(covariance, (count, 1, 1)), climbs[:, 0], kept, None, climbs,
    )  # fmt: skip
    rows = np.zeros(count, UPDATE_DTYPE)
    rows["track_id"], rows["time_s"], rows["state"] = (
        states.track_id, states.time_s, STATE_CONFIRMED,
    )  # fmt: skip
    return TrackSnapshot(NOW_S, rows, states)


def least_ms(scene: TrackSnapshot, settings: TrackingSettings, runs: int) -> float:
    """Return the least CPU time of an answer, ms; the kernels are compiled before."""
    calibration = taught(settings)
    encounters(scene, QUERY, PLANE, settings, calibration)
    spent = []
    for _ in range(runs):
        begin = process_time()
        encounters(scene, QUERY, PLANE, settings, calibration)
        spent.append(process_time() - begin)
    return 1e3 * min(spent)


def taught(settings: TrackingSettings) -> ForecastCalibration:
    """Return the calibration of a run with straight flight and Gaussian errors."""
    calibration = calibration_for(settings)
    names = calibration.family.names
    scores = np.tile(-2.0 * np.log1p(-(np.arange(500)[:, None] + 0.5) / 500.0), len(names))
    sizes = np.tile(np.where(np.array(names) == STRAIGHT, 0.0, 9.0), (500, 1))
    for horizon in range(len(HORIZONS_S)):
        calibration.scores.record(horizon, scores, sizes)
    calibration.scores.settle()
    return calibration


def all_pairs_ms(scene: TrackSnapshot, runs: int) -> float:
    """Return the least CPU time of the closest points of approach of all pairs, ms."""
    spent = []
    for _ in range(runs):
        begin = process_time()
        east, north, rate_east, rate_north = (
            column[None] - column[:, None] for column in scene.states.mean.T
        )
        square = np.maximum(rate_east**2 + rate_north**2, 1e-9)
        time_s = np.clip(-(east * rate_east + north * rate_north) / square, 0.0, QUERY.horizon_s)
        apart = np.hypot(east + time_s * rate_east, north + time_s * rate_north)
        np.nonzero(np.triu(apart <= QUERY.distance_m, 1))
        spent.append(process_time() - begin)
    return 1e3 * min(spent)
