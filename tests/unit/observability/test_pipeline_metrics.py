"""The metrics of the pipeline are its status at the moment of the scrape."""

from dataclasses import dataclass
from typing import Any

from prometheus_client import CollectorRegistry, generate_latest

from multiradar.observability.metrics import watch
from multiradar.observability.pipeline_metrics import PipelineCollector, ReadinessCollector
from multiradar.runtime.live.readiness import Reason


def test_the_metrics_follow_the_status_until_they_are_unregistered() -> None:
    status: dict[str, Any] = {
        "state": "running",
        "accepted": 5,
        "rejected": 2,
        "duplicate": 1,
        "engine": {"UPDATED": 4, "STARTED": 1},
        "data_time_s": None,
        "journal_sequence": 3,
        "rejected_by_source": {"http": {"TIME_LATE": 2}},
        "lags_s": {"intake": 0.0, "processor": 11.5},
        "sensor_ages_s": {"41-10": 4.25},
        "sensor_alarms": {"41-10": ["noise", "address"], "41-11": []},
        "alarms": ["no_data"],
        "journal_disk": {"free_bytes": 5, "size_bytes": 10, "used_bytes": 2},
        "zenoh": {
            "messages_read": 7,
            "links": 1,
            "streams": 3,
            "unreachable": ["tcp/a:7447"],
            "publish_lag_s": 0.5,
            "instance": "1f",
            "alarms": [],
        },
    }
    registry = CollectorRegistry()
    unwatch = watch(registry, PipelineCollector(lambda: status))
    text = generate_latest(registry).decode()
    assert 'multiradar_measurements_total{result="accepted"} 5.0' in text
    assert 'multiradar_outcomes_total{outcome="updated"} 4.0' in text
    assert "multiradar_data_time_s" not in text
    for line in (
        'rejected_total{code="TIME_LATE",source="http"} 2.0',
        'lag_seconds{stage="processor"} 11.5',
        'lag_seconds{stage="publish"} 0.5',
        'sensor_age_seconds{sensor="41-10"} 4.25',
        'sensor_alarm{alarm="noise",sensor="41-10"} 1.0',
        'sensor_alarm{alarm="address",sensor="41-10"} 1.0',
        "no_data 1.0",
        "journal_disk_free_bytes 5.0",
        'zenoh_events_total{event="messages_read"} 7.0',
        "zenoh_links 1.0",
        "zenoh_unreachable 1.0",
    ):
        assert f"multiradar_{line}\n" in text, line
    assert 'stage="follow"' not in text
    assert 'alarm="noise",sensor="41-11"' not in text
    status.update(state="failed", role="standby", lag_s=0.25, data_time_s=12.5, accepted=6)
    text = generate_latest(registry).decode()
    assert 'multiradar_measurements_total{result="accepted"} 6.0' in text
    assert 'multiradar_lag_seconds{stage="follow"} 0.25' in text
    assert "multiradar_data_time_s 12.5" in text
    unwatch()
    assert generate_latest(registry) == b""


def test_readiness_is_that_of_the_service_at_the_moment_of_the_scrape() -> None:
    @dataclass
    class Service:
        state: str
        reasons: tuple[Reason, ...] = ()

        def unready(self) -> tuple[Reason, ...]:
            return self.reasons

    service = Service("recovering", (Reason("NOT_READY", "the service is starting"),))
    registry = CollectorRegistry()
    unwatch = watch(registry, ReadinessCollector(service, ("NOT_READY", "LAG")))
    for running, reasons in ((0.0, (1.0, 0.0)), (1.0, (0.0, 1.0))):
        text = generate_latest(registry).decode()
        assert f"multiradar_running {running}\n" in text
        for code, value in zip(("NOT_READY", "LAG"), reasons, strict=True):
            assert f'multiradar_unready{{reason="{code}"}} {value}\n' in text
        service.state, service.reasons = "running", (Reason("LAG", "behind"),)
    unwatch()
    assert generate_latest(registry) == b""
