"""Alert rules and the board ask for metrics that a running service has, with their labels."""

import json
import re
import shutil
from collections.abc import Iterator
from typing import Any

import pytest
import yaml
from prometheus_client import CollectorRegistry
from prometheus_client.metrics_core import Metric

from multiradar.ingest.zenoh.gateway import ZenohGateway
from multiradar.ingest.zenoh.memory_bus import MemoryBus
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.observability.metrics import REGISTRY, watch
from multiradar.observability.pipeline_metrics import PipelineCollector, ReadinessCollector
from multiradar.runtime.live.readiness import CODES
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from support.paths import ROOT
from support.processes.live_services import services, settled, submit
from support.processes.waiting import run_to_end
from support.scenarios.live_scene import recording

MONITORING = ROOT / "deploy" / "monitoring"
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
    with services() as start:
        service = start(SqliteJournal(tmp_path_factory.mktemp("journal") / "journal.sqlite", ""))
        gateway = ZenohGateway(service, ZenohOptions(), open_bus=lambda _: MemoryBus())
        service.publication.count_edge("zenoh", gateway.document)
        submit(service, recording(40))
        settled(service)
        watch(registry, PipelineCollector(service.view.status))
        watch(registry, ReadinessCollector(service, CODES))
        yield {
            name: labels
            for family in [*registry.collect(), *REGISTRY.collect()]
            for name, labels in _series(family)
        }


def _series(family: Metric) -> Iterator[tuple[str, list[dict[str, str]]]]:
    name = f"{family.name}_total" if family.type == "counter" else family.name
    yield name, [sample.labels for sample in family.samples if sample.name == name]


#: In real time only; `test_silence` reads them.
_REAL_TIME = {"multiradar_data_delay_s", "multiradar_silence_s"}
#: Labels of series that exist after an event only.
_LABELS = {
    "multiradar_sensor_alarm": {"sensor", "alarm"},
    "multiradar_rejected_total": {"source", "code"},
    "multiradar_http_requests_total": {"method", "route", "status"},
    "multiradar_http_refusals_total": {"code"},
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


@pytest.mark.skipif(PROMTOOL is None, reason="promtool is not installed")
def test_alerts_fire_as_their_tests_expect() -> None:
    assert PROMTOOL is not None
    tested = run_to_end([PROMTOOL, "test", "rules", "alerts_test.yaml"], cwd=MONITORING)
    assert tested.returncode == 0, tested.stdout + tested.stderr
