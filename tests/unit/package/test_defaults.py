"""Defaults, bounds of settings, options and parameters, and statuses of answers change on purpose.

A change of one changes its line in `tests/golden/defaults.txt`, too, and has an entry in the
changelog.
"""

import json
from typing import TYPE_CHECKING

import typer
from pydantic import BaseModel

from multiradar.api.factory import create_api
from multiradar.cli.main import app
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.ingest.asterix_inlet import InletBounds
from multiradar.ingest.http import IntakeBounds, measurement_routes
from multiradar.ingest.replay.replaying import ReplayPlan
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.research.bundle.search_rules import SearchRules
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.forecast.settings import ForecastSettings
from multiradar.runtime.asterix.channel import ChannelOptions
from multiradar.runtime.offline.offline_job import OfflineJob
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.settings.service import Settings
from multiradar.simulation.scenario.tables import ScenarioTable
from multiradar_converters.asterix.live.reception import LiveOptions
from multiradar_converters.asterix.options import Options as AsterixOptions
from multiradar_converters.inspection.recordings import InspectionOptions
from multiradar_converters.normalised.parsed import ROWS_MAX
from multiradar_converters.vid.options import Options as VidOptions
from multiradar_converters.vid.profile import Profile
from multiradar_schemas.export import documents
from multiradar_schemas.sensors.sensor import SensorsFile
from support.defaults import (
    answer_lines,
    command_lines,
    dataclass_lines,
    model_lines,
    parameter_lines,
    schema_lines,
)
from support.fakes.fake_service import FakeService
from support.paths import TESTS

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

RECORD = TESTS / "golden" / "defaults.txt"
MODELS: tuple[type[BaseModel], ...] = (Settings, SensorsFile, ScenarioTable, Profile)
DATACLASSES: tuple[type["DataclassInstance"], ...] = (
    BundleSettings, ForecastSettings, SearchRules, EvaluationSettings, EncounterQuery, OfflineJob,
    ReplayPlan, IntakeBounds, InletBounds, ChannelOptions, ZenohOptions, LiveOptions,
    AsterixOptions, VidOptions, InspectionOptions,
)  # fmt: skip


def test_defaults_and_bounds_are_those_on_record() -> None:
    service = FakeService()
    api = create_api(service, routers=[measurement_routes(service, IntakeBounds())])
    lines = [line for model in MODELS for line in model_lines(model)]
    lines += [line for kind in DATACLASSES for line in dataclass_lines(kind)]
    lines += command_lines(typer.main.get_command(app), "multiradar")
    given = [json.loads(text) for name, text in documents().items() if name.endswith(".json")]
    lines += dict.fromkeys(line for document in given for line in schema_lines(document))
    lines += [*parameter_lines(api.openapi()), *answer_lines(api.openapi())]
    assert lines == RECORD.read_text(encoding="utf-8").splitlines()


def test_the_service_and_the_converters_have_one_bound_of_rows() -> None:
    assert Settings.model_fields["rows_per_message_max"].default == ROWS_MAX
