"""Compares encounters with the state-based conflict detection of BlueSky, an open simulator.

::

    pip download --no-deps bluesky-simulator==1.1.1
    unzip bluesky_simulator-*.whl -d bluesky-simulator
    python -m validation.peers.compare_bluesky bluesky-simulator  # a minute; 4 GiB for the last row

BlueSky compares all pairs (Hoekstra and Ellerbroek): closest point of approach by position and
velocity, and the times at which each pair enters and leaves a disc; no errors, no probabilities.
Its compiled form is used, without the simulator. Both search the same aircraft for pairs within
five nautical miles in the next two minutes; one line for each number of aircraft.
"""

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from time import process_time
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np

TESTS = Path(__file__).parents[2] / "tests"
sys.path.insert(0, str(TESTS))

from benchmark.encounters import NOW_S, PLANE, airspace  # noqa: E402
from multiradar.runtime.queries.encounter_query import EncounterQuery  # noqa: E402
from multiradar.runtime.queries.encounters import TrackSnapshot, encounters  # noqa: E402
from multiradar.tracking.forecast.forecast_calibration import calibration_for  # noqa: E402
from multiradar.tracking.settings import TrackingSettings  # noqa: E402

AIRCRAFT = (150, 1000, 4000, 15_000)
QUERY = EncounterQuery(limit=None)
HEIGHT_M = 9000.0
#: Larger than all height differences.
ANY_HEIGHT_M = 1e5


def main() -> None:
    """Print a line for each number of aircraft."""
    detect = conflict_detection(Path(sys.argv[1]) / "bluesky")
    settings = TrackingSettings(filter_name="two-stage")
    rest = QUERY, PLANE, settings, calibration_for(settings)
    for count in AIRCRAFT:
        scene = airspace(count, modes=0)
        scene.states.time_s[:] = NOW_S
        scene.rows["time_s"] = NOW_S
        encounters(scene, *rest)
        begin = process_time()
        answer = encounters(scene, *rest)
        own_s = process_time() - begin
        traffic = as_traffic(scene)
        zone = (np.full(count, each) for each in (QUERY.distance_m, ANY_HEIGHT_M, QUERY.horizon_s))
        begin = process_time()
        found = detect(traffic, traffic, *zone)
        their_s = process_time() - begin
        own = {(one["first_track_id"], one["second_track_id"]): one for one in answer["encounters"]}
        pairs = [tuple(sorted(pair)) for pair in found[0]]
        apart = dict(zip(pairs, found[6], strict=True))
        common = [
            abs(one["distance_m"] - apart[pair])
            for pair, one in own.items()
            if pair in apart and 0.0 < one["time_to_closest_s"] < QUERY.horizon_s
        ]
        print(
            f"{count} aircraft: {own_s:.2f} s against {their_s:.2f} s; {len(own)} pairs, of which "
            f"{len(set(own) & set(apart))} are among the {len(apart)} of BlueSky; distances differ "
            f"by {np.median(common):.0f} m (median), {max(common):.0f} m at most",
            flush=True,
        )


def as_traffic(scene: TrackSnapshot) -> SimpleNamespace:
    """Return the aircraft in the form of BlueSky."""
    mean = scene.states.mean
    latitude_rad, longitude_rad = PLANE.to_geodetic(mean[:, 0], mean[:, 1])
    speed, heading_rad = PLANE.ground_velocity(
        mean[:, 0], mean[:, 1], mean[:, 2], mean[:, 3], HEIGHT_M
    )
    count = len(mean)
    return SimpleNamespace(
        ntraf=count, lat=np.degrees(latitude_rad), lon=np.degrees(longitude_rad),
        trk=np.degrees(heading_rad), gs=speed, alt=np.full(count, HEIGHT_M), vs=np.zeros(count),
        id=scene.states.track_id.tolist(),
    )  # fmt: skip


def conflict_detection(package: Path) -> Any:
    """Load the compiled detection with the minimum of the simulator it needs."""
    settings = SimpleNamespace(
        set_variable_defaults=lambda **_: None, prefer_compiled=False, casmach_threshold=2.0
    )
    for name in ("bluesky", "bluesky.stack", "bluesky.tools", "bluesky.traffic"):
        module = ModuleType(name)
        module.__path__ = [str(package.joinpath(*name.split(".")[1:]))]
        vars(module)["settings"] = settings
        sys.modules[name] = module
    name = "cstatebased"
    (binary,) = (package / "traffic/asas").glob(f"{name}*.so")
    spec = spec_from_file_location(name, binary)
    assert spec is not None
    assert spec.loader is not None
    loaded = module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded.detect


if __name__ == "__main__":
    main()
