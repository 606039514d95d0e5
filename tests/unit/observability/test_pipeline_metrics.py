"""The metrics of the pipeline are its status at the moment of the scrape."""

from typing import Any

from prometheus_client import CollectorRegistry, generate_latest

from multiradar.observability.metrics import watch
from multiradar.observability.pipeline_metrics import PipelineCollector


def test_the_metrics_follow_the_status_until_they_are_unregistered() -> None:
    status: dict[str, Any] = {
        "state": "running",
        "accepted": 5,
        "rejected": 2,
        "duplicate": 1,
        "engine": {"UPDATED": 4, "STARTED": 1},
        "data_time_s": None,
        "journal_sequence": 3,
    }
    registry = CollectorRegistry()
    unwatch = watch(registry, PipelineCollector(lambda: status))
    text = generate_latest(registry).decode()
    assert 'multiradar_measurements_total{result="accepted"} 5.0' in text
    assert 'multiradar_outcomes_total{outcome="updated"} 4.0' in text
    assert "multiradar_running 1.0" in text
    assert "multiradar_data_time_s" not in text
    status.update(state="failed", data_time_s=12.5, accepted=6)
    text = generate_latest(registry).decode()
    assert 'multiradar_measurements_total{result="accepted"} 6.0' in text
    assert "multiradar_running 0.0" in text
    assert "multiradar_data_time_s 12.5" in text
    unwatch()
    assert generate_latest(registry) == b""
