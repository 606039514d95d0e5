"""The pages on simulation name every key, file, column and scenario, and the examples work."""

from pathlib import Path

import numpy as np
import pytest

from multiradar.simulation.flat import flat_plots
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import TRUE_BIAS_SCHEMA, TRUTH_SCHEMA
from multiradar.simulation.scenario.bias_tables import BiasesTable, BiasTable
from multiradar.simulation.scenario.file import builtin_names, builtin_scenario, load_scenario
from multiradar.simulation.scenario.reported_tables import AtmosphereTable, RegistersTable
from multiradar.simulation.scenario.tables import (
    AircraftTable,
    CoupledTable,
    LegTable,
    PlaneTable,
    ReportErrorTable,
    ScenarioTable,
    SensorTable,
    TrafficTable,
)
from multiradar_schemas.documents.tables import Table
from support.paths import ROOT

EXAMPLES = sorted((ROOT / "examples" / "scenes").glob("*.toml"))
TABLES = (
    ScenarioTable, PlaneTable, AircraftTable, LegTable, ReportErrorTable, CoupledTable,
    TrafficTable, SensorTable, BiasesTable, BiasTable, AtmosphereTable, RegistersTable,
)  # fmt: skip


@pytest.fixture(scope="module")
def page() -> str:
    pages = ("howto/simulate.md", "reference/scenario.md")
    return "".join((ROOT / "docs" / name).read_text(encoding="utf-8") for name in pages)


@pytest.mark.parametrize("table", TABLES)
def test_every_key_is_explained(table: type[Table], page: str) -> None:
    headings = {"plane": "[plane]", "aircraft": "[[aircraft]]", "traffic": "[[traffic]]",
                "sensor": "[[sensor]]", "leg": "[[aircraft.leg]]",
                "report_error": "[[aircraft.report_error]]", "bias": "`bias`"}  # fmt: skip
    for key in table.model_fields:
        known = (f"`{key}`", f".{key}`", headings.get(key, f"`{key}`"))
        assert any(name in page for name in known), key


def test_every_scenario_and_column_is_explained(page: str) -> None:
    for name in (*builtin_names(), *TRUTH_SCHEMA, *TRUE_BIAS_SCHEMA):
        assert f"`{name}`" in page, name


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_can_be_simulated(path: Path) -> None:
    scenario = load_scenario(path)
    assert len(observe(scenario, np.random.default_rng(0)).measurements) > 1000


@pytest.mark.parametrize("name", builtin_names())
def test_every_scenario_gives_each_sensor_measurements(name: str) -> None:
    scenario = builtin_scenario(name)
    seen = observe(scenario, np.random.default_rng(0))
    assert np.all(np.bincount(seen.measurements.sensor, minlength=len(scenario.sensors)) > 500)
    # All aircraft stay within the heights that the tracker accepts and on the plane.
    assert np.nanmin(seen.measurements.true_height_m) > 0.0
    assert np.nanmax(seen.measurements.true_height_m) < 20_000.0
    if scenario.plane == "flat":
        assert len(flat_plots(scenario, np.random.default_rng(0))) == len(seen.measurements)
