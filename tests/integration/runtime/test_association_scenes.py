"""Named scenes tracked without identity, judged as `docs/check_association.py` does."""

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from multiradar import wire
from multiradar.cli.inputs import load_sensor_table
from multiradar.runtime.engine import Engine
from multiradar.simulation.observation import observe
from multiradar.simulation.output import measurements_frame, truth_frame
from multiradar.simulation.scene_file import builtin_scene
from multiradar.simulation.sensors_text import sensors_text
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings

NAMELESS = ("track_number", "mode_s_address", "mode_3a")
CODES = ("track_number", "mode_s_address")
ADDRESSES = ("track_number",)


def checks() -> ModuleType:
    path = Path(__file__).parents[3] / "docs" / "check_association.py"
    specification = importlib.util.spec_from_file_location("check_association", path)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("name", "hidden"),
    [
        ("crossing", NAMELESS), ("formation", NAMELESS), ("shared-code", CODES),
        ("code-change", CODES), ("shared-address", ADDRESSES), ("clutter", NAMELESS),
    ],
)  # fmt: skip
def test_every_aircraft_has_one_track_and_every_track_one_aircraft(
    tmp_path: Path, name: str, hidden: tuple[str, ...]
) -> None:
    scene = builtin_scene(name)
    seen = observe(scene, np.random.Generator(np.random.PCG64(scene.seed)))
    path = tmp_path / "sensors.toml"
    path.write_text(sensors_text(scene), encoding="utf-8")
    table = load_sensor_table(path)
    batch, _ = wire.measurement_batch(measurements_frame(scene, seen), table)
    engine = Engine(table, TrackingSettings(hidden_fields=hidden))
    updates = TrackUpdates.concatenate([engine.push(batch).updates, engine.flush().updates])
    truth = truth_frame(scene, seen).select("time_s", "sensor_id", "track_number")
    periods = dict(zip(table.ids, table.rotation_period_s.tolist(), strict=True))
    found = checks().figures(wire.tracks_frame(updates, table), truth, periods)
    assert found.swaps == 0
    assert found.right_share >= 0.999
    assert found.all_share >= 0.98
    assert found.aircraft <= found.tracks <= found.aircraft + 2
    assert found.false_life_s <= 30.0
    assert np.percentile(found.scans, 95) <= 3.0
