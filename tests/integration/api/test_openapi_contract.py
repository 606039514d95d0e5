"""What OpenAPI declares is what the service accepts and answers, with requests by Schemathesis.

Valid requests must be accepted, invalid ones rejected, and each answer must have a declared status,
media type and form. The requests are the same in each run.
"""

import itertools
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from hypothesis import strategies as st

from multiradar.api.answers.paging import page_by_time, track_cursor
from multiradar.api.factory import create_api
from multiradar.api.routes.overlays import overlay_routes
from multiradar.app import build_service
from multiradar.ingest.http import IntakeBounds, measurement_routes
from multiradar.ingest.http_sensors import sensor_change_routes
from multiradar.ingest.replay.http import Encoding, encode
from multiradar.runtime.live.receipt import IDEMPOTENCY_KEY_LENGTH_MAX
from multiradar.settings.service import load_settings
from multiradar.storage.overlays import read_overlays
from support.fakes.fake_service import updates_of
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import recording, sensors, sensors_file

#: Requests drawn for each operation and kind, beside those at the bounds of its parameters.
_EXAMPLES = 4
#: The same of messages with measurements.
_MESSAGES = 40
#: An endless answer; `test_streams` reads it.
_ENDLESS = "/v1/events"

_PLOTS = recording(600)


@pytest.fixture
def application(tmp_path: Path) -> Iterator[FastAPI]:
    overlays = tmp_path / "overlays"
    overlays.mkdir()
    (overlays / "border.geojson").write_text('{"type": "FeatureCollection", "features": []}')
    settings = load_settings(None, {"journal": {"path": tmp_path / "journal.sqlite"}})
    service = build_service(settings, sensors(), described=sensors_file())
    service.start()
    service.submit(_PLOTS, source="http").result(WAIT_TIMEOUT_S)
    service.flush(source="http").result(WAIT_TIMEOUT_S)
    intake = measurement_routes(service, IntakeBounds(acknowledge_deadline_s=WAIT_TIMEOUT_S))
    changes = sensor_change_routes(service, WAIT_TIMEOUT_S)
    yield create_api(service, routers=(intake, changes, overlay_routes(read_overlays(overlays))))
    service.stop()


@pytest.mark.fault(40)
def test_requests_made_from_openapi_are_answered_as_it_declares(application: FastAPI) -> None:
    # Imported here: half a second in every other process of the tests.
    import schemathesis
    from schemathesis.config import SchemathesisConfig
    from schemathesis.engine import events, from_schema

    _declare_forms(schemathesis)
    config = SchemathesisConfig.from_dict(
        {
            "seed": 1,
            "continue-on-failure": True,
            "warnings": False,
            "request-timeout": WAIT_TIMEOUT_S,
            "generation": {
                "mode": "all",
                "max-examples": _EXAMPLES,
                "deterministic": True,
                "database": "none",
            },
            "phases": {"stateful": {"enabled": False}},
            "operations": [
                {
                    "include-path": "/v1/measurements",
                    "generation": {"max-examples": _MESSAGES},
                    "phases": {
                        # Not possible with media types that Schemathesis does not know.
                        "examples": {"enabled": False},
                        # Thousands of requests: 40 fields of four kinds.
                        "coverage": {"enabled": False},
                    },
                }
            ],
        }
    )
    schema = schemathesis.openapi.from_asgi("/openapi.json", application, config=config).exclude(
        path=_ENDLESS
    )
    schemathesis.hook(_made_consistent())
    mismatches: dict[tuple[str, str], str] = {}
    operations: set[str] = set()
    for event in from_schema(schema).execute():
        if isinstance(event, events.NonFatalError | events.FatalError):
            problem = event.info if isinstance(event, events.NonFatalError) else event.exception
            pytest.fail(str(problem))
        if not isinstance(event, events.ScenarioFinished):
            continue
        operations.add(event.label or "")
        for name, failure, request in _failures(event.recorder):
            mismatches.setdefault((event.label or "", name), f"{failure}\n{request}")
    paths = application.openapi()["paths"]
    declared = {f"{one.upper()} {path}" for path, methods in paths.items() for one in methods}
    assert declared - operations == {f"GET {_ENDLESS}"}
    assert not mismatches, "\n\n".join(
        f"{label}: {text}" for (label, _), text in sorted(mismatches.items())
    )


def _failures(recorder: Any) -> Iterator[tuple[str, str, str]]:
    for case_id, checks in recorder.checks.items():
        for check in checks:
            if check.failure_info is not None:
                failure = check.failure_info.failure
                request = recorder.cases[case_id].value.as_curl_command()
                text = f"{failure.title}\n{failure.message}"
                if request.endswith("/readyz") and failure.title == "Server error":
                    # Its documented answer while the service lags behind, as on a busy machine.
                    continue
                yield type(failure).__name__, text, request


# Forms that JSON Schema does not describe, and media types that Schemathesis does not know.
def _declare_forms(schemathesis: Any) -> None:
    longitudes = st.integers(-180, 180)
    latitudes = st.lists(st.integers(-90, 90), min_size=2, max_size=2).map(sorted)
    schemathesis.openapi.format(
        "bounding-box", st.builds("{0},{2[0]},{1},{2[1]}".format, longitudes, longitudes, latitudes)
    )
    # Later ones than the year 4821 are rejected.
    times = st.integers(0, 90_000_000_000)
    schemathesis.openapi.format(
        "date-time", times.map(lambda time_s: datetime.fromtimestamp(time_s, UTC).isoformat())
    )
    schemathesis.openapi.format("cursor-by-number", st.integers(0, 10**18).map(track_cursor))
    _, by_time = page_by_time(lambda *_: updates_of(1, 9), None, None, 3)
    schemathesis.openapi.format("cursor-by-time", st.just(by_time))
    for encoding, media_type in (
        (Encoding.NDJSON, "application/x-ndjson"),
        (Encoding.ARROW, "application/vnd.apache.arrow.stream"),
    ):
        bodies = [encode(_PLOTS[:rows], encoding) for rows in (1, 20)]
        schemathesis.openapi.media_type(media_type, st.sampled_from(bodies))


# What holds between parameters, and between requests, cannot be declared in OpenAPI.
def _made_consistent() -> Callable[..., None]:
    numbers = itertools.count()

    def before_call(context: Any, case: Any, kwargs: Any) -> None:
        del context, kwargs
        if case.meta is None or not case.meta.generation.mode.is_positive:
            return
        for name in _unusable(case.path, case.query or {}):
            case.query.pop(name, None)
        key = (case.headers or {}).get("Idempotency-Key")
        if key is not None:
            # A key that was used for another message is rejected.
            unique = f"{key}{next(numbers):06d}"
            case.headers["Idempotency-Key"] = unique[-IDEMPOTENCY_KEY_LENGTH_MAX:]
        for row in case.body if isinstance(case.body, list) else [case.body]:
            if isinstance(row, dict):
                row |= _integers(row)

    return before_call


def _unusable(path: str, query: Mapping[str, Any]) -> tuple[str, ...]:
    if path == "/v1/picture":
        return ("after",) if "at" in query else ("since", "layer")
    if path.endswith("/bias") and query.get("history") != "true":
        return ("since", "until", "cursor")
    if "until" in query:
        return ("cursor",)
    # A short step to a far horizon is too many points.
    return ("step_s",) if path.endswith("/forecast") else ()


# 7.0 is an integer of JSON Schema, and 7 the only form of it that is read.
def _integers(row: Mapping[str, Any]) -> dict[str, int]:
    names = ("time_ns", "track_number")
    return {name: int(row[name]) for name in names if isinstance(row.get(name), float)}
