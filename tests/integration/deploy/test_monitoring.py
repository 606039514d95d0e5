"""Alert rules and the board ask for metrics that a running service has, with their labels."""

import json
import re
import shutil
from collections.abc import Iterator
from typing import Any

import polars as pl
import pytest
import yaml
from prometheus_client import CollectorRegistry
from prometheus_client.metrics_core import Metric

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.ingest.zenoh.gateway import ZenohGateway
from multiradar.ingest.zenoh.memory_bus import MemoryBus
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.observability.metrics import REGISTRY, watch
from multiradar.observability.pipeline_metrics import (
    ALARMS,
    PipelineCollector,
    ReadinessCollector,
)
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.alarms.supervision import SOURCE_QUARANTINED
from multiradar.runtime.live.readiness import CODES
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import sensor_table
from multiradar_schemas.sensors.sensor import SensorsFile
from support.paths import ROOT
from support.processes.live_services import services, settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S, run_to_end
from support.required import skip_unless_required
from support.scenarios.live_scene import recording, sensors_file

MONITORING = ROOT / "deploy" / "monitoring"
#: A radar, and its name in a second network.
TWICE = {"41-10": "43-10"}
PROMTOOL = shutil.which("promtool")
_SELECTOR = re.compile(r"\b((?:multiradar|process)_\w+)(?:\{([^}]*)\})?")
_GROUPED = re.compile(r"(?:by|on) \(([^)]*)\)")
_MATCHER = re.compile(r'(\w+)\s*(?:=~|!=|=)\s*"([^"]*)"')
# Prometheus adds these to every series.
_TARGET = {"job", "instance"}


def _rules() -> list[dict[str, Any]]:
    document = yaml.safe_load((MONITORING / "alerts.yaml").read_text(encoding="utf-8"))
    return [rule for group in document["groups"] for rule in group["rules"]]


def _panels() -> list[dict[str, Any]]:
    board = json.loads((MONITORING / "grafana.json").read_text(encoding="utf-8"))
    panels: list[dict[str, Any]] = board["panels"]
    return panels


def _expressions() -> list[tuple[str, str]]:
    """Return each expression, and the text that names labels of its series."""
    alerts = [(rule["expr"], rule["annotations"]["summary"]) for rule in _rules()]
    curves = [
        (target["expr"], target["legendFormat"])
        for panel in _panels()
        for target in panel["targets"]
    ]
    return alerts + curves


@pytest.fixture(scope="module")
def metrics(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, list[dict[str, str]]]]:
    """Return the labels of the series of a service by metric; those without any are declared."""
    registry = CollectorRegistry()
    table = _two_networks()
    with services() as start:
        journal = SqliteJournal(tmp_path_factory.mktemp("journal") / "journal.sqlite", "")
        service = start(journal, lambda: Engine(table, TrackingSettings()), table)
        gateway = ZenohGateway(service, ZenohOptions(), open_bus=lambda _: MemoryBus())
        service.publication.count_edge("zenoh", gateway.document)
        rows = recording(40)
        submit(service, rows)
        submit(service, rows.with_columns(pl.col("sensor_id").replace(TWICE)))
        service.flush(source="test").result(WAIT_TIMEOUT_S)
        settled(service)
        watch(registry, PipelineCollector(service.view.status))
        watch(registry, ReadinessCollector(service, CODES))
        yield {
            name: labels
            for family in [*registry.collect(), *REGISTRY.collect()]
            for name, labels in _series(family)
        }


def _two_networks() -> SensorTable:
    """The sensors, one of them received through a second network, too."""
    sensors = sensors_file().sensor
    return sensor_table(
        SensorsFile(
            sensor=tuple(
                one.model_copy(update={"also": (TWICE[one.id],)}) if one.id in TWICE else one
                for one in sensors
            )
        )
    )


def _series(family: Metric) -> Iterator[tuple[str, list[dict[str, str]]]]:
    name = f"{family.name}_total" if family.type == "counter" else family.name
    yield name, [sample.labels for sample in family.samples if sample.name == name]


#: In real time only; `tests/unit/runtime/live/test_silence.py` reads them from the metrics.
_REAL_TIME = {"multiradar_data_delay_s", "multiradar_silence_s"}
#: Labels of series that exist after an event only.
_LABELS = {
    "multiradar_sensor_alarm": {"sensor", "alarm"},
    "multiradar_rejected_total": {"source", "code"},
    "multiradar_http_requests_total": {"method", "route", "status"},
    "multiradar_http_refusals_total": {"code"},
    "multiradar_certificate_remaining_seconds": {"interface"},
}


@pytest.mark.parametrize(("expression", "text"), _expressions())
def test_metrics_and_labels_exist(
    expression: str, text: str, metrics: dict[str, list[dict[str, str]]]
) -> None:
    selectors = _SELECTOR.findall(expression)
    assert selectors or expression.startswith("up{")
    for name, matchers in selectors:
        assert name in metrics or name in _REAL_TIME, name
        series = metrics.get(name, [])
        known = _LABELS.get(name) or {label for labels in series for label in labels}
        for label, value in _MATCHER.findall(matchers):
            assert any(labels.get(label) == value for labels in series), (label, value)
        named = {one.strip() for group in _GROUPED.findall(expression) for one in group.split(",")}
        named |= {a or b for a, b in re.findall(r"\$labels\.(\w+)|\{\{(\w+)\}\}", text)}
        assert named - _TARGET - {""} <= known or len(selectors) > 1, named


def test_every_reason_has_an_alert_and_alerts_say_what_is_the_case() -> None:
    rules = _rules()
    assert len({rule["alert"] for rule in rules}) == len(rules)
    for rule in rules:
        assert rule["labels"]["severity"] in {"warning", "critical"}
        assert rule["annotations"]["summary"]
    # All but one: a new reason is an alert, too.
    assert 'multiradar_unready{reason!="STANDBY"} == 1' in [rule["expr"] for rule in rules]


def test_every_alarm_has_an_alert_and_a_panel() -> None:
    named = [
        {name for expression in expressions for name, _ in _SELECTOR.findall(expression)}
        for expressions in (
            [rule["expr"] for rule in _rules()],
            [target["expr"] for panel in _panels() for target in panel["targets"]],
        )
    ]
    alarms = {f"multiradar_{name}" for name in (*ALARMS, SOURCE_QUARANTINED)}
    # These have alerts that say more: on the reason NO_DATA, and on the time that is left.
    assert alarms - named[0] == {"multiradar_no_data", "multiradar_certificate_expiring"}
    assert alarms <= named[1]


def test_panels_are_apart_and_have_numbers_of_their_own() -> None:
    panels = _panels()
    assert [panel["id"] for panel in panels] == list(range(1, len(panels) + 1))
    places = [
        (place["x"] + x, place["y"] + y)
        for place in (panel["gridPos"] for panel in panels)
        for x in range(place["w"])
        for y in range(place["h"])
    ]
    assert len(set(places)) == len(places)
    assert all(x < 24 for x, _ in places)


def test_each_alert_is_tested_where_it_fires_and_where_it_does_not() -> None:
    document = yaml.safe_load((MONITORING / "alerts_test.yaml").read_text(encoding="utf-8"))
    cases = [case for group in document["tests"] for case in group["alert_rule_test"]]
    found = {bool(case["exp_alerts"]): set[str]() for case in cases}
    for case in cases:
        found[bool(case["exp_alerts"])].add(case["alertname"])
    names = {rule["alert"] for rule in _rules()}
    assert found == {True: names, False: names}


def test_alerts_fire_as_their_tests_expect() -> None:
    if PROMTOOL is None:
        skip_unless_required("promtool", "promtool is not installed")
    tested = run_to_end([PROMTOOL, "test", "rules", "alerts_test.yaml"], cwd=MONITORING)
    assert tested.returncode == 0, tested.stdout + tested.stderr
