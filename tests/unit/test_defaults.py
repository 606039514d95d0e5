"""Defaults and bounds of settings change on purpose only.

Whoever changes one changes its line in `tests/golden/defaults.txt`, too, and tells users of it in
the changelog.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import BaseModel

from multiradar.evaluation.settings import EvaluationSettings
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.restoration.forecast_settings import ForecastSettings
from multiradar.restoration.settings import BundleSettings
from multiradar.settings import Settings
from multiradar.simulation.scene_tables import SceneTable
from multiradar_converters.vid.profile import Profile
from multiradar_schemas.sensor import SensorsFile
from support.defaults import dataclass_lines, model_lines

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

RECORD = Path(__file__).parents[1] / "golden" / "defaults.txt"
MODELS: tuple[type[BaseModel], ...] = (Settings, SensorsFile, SceneTable, Profile)
DATACLASSES: tuple["DataclassInstance", ...] = (
    BundleSettings(), ForecastSettings(), EvaluationSettings(), ZenohOptions(),
)  # fmt: skip


def test_defaults_and_bounds_are_those_on_record() -> None:
    lines = [line for model in MODELS for line in model_lines(model)]
    lines += [line for settings in DATACLASSES for line in dataclass_lines(settings)]
    assert lines == RECORD.read_text(encoding="utf-8").splitlines()
