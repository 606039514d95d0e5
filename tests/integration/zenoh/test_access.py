"""Clients cannot speak for the service over Zenoh, in its built-in configuration."""

import json
from collections.abc import Iterator
from typing import Any

import pytest
import zenoh
from structlog.testing import capture_logs

from multiradar.ingest.zenoh.access_control import access_control
from multiradar.ingest.zenoh.gateway import ZenohGateway
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.session import ZenohBus, all_may_operate
from multiradar.settings.access import AccessSettings
from support.access import clients
from support.fakes.fake_service import FakeService
from support.paths import ROOT as ROOT_FOLDER
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.processes.zenoh_subscriber import client_config
from support.scenarios.live_scene import recording
from support.scenarios.zenoh_scene import StreamingView, free_endpoint

ROOT = "multiradar/v1"
#: What the service publishes, and key expressions that reach it.
FORGED = (
    "tracks/7", "ended/7", "biases/41-10", "status", "sensors/41-10", "forecasts/7", "encounters",
    "plots/7", "residuals", "instances/x", "tracks/*", "**", "tracks/7/@adv/pub/a/1/_",
)  # fmt: skip


class Scene:
    """A service and the endpoint of its clients."""

    def __init__(self, **options: Any) -> None:
        self.view = StreamingView()
        self.service = FakeService(view=self.view)
        self.endpoint = free_endpoint()
        given = ZenohOptions(listen=(self.endpoint,), status_period_s=0.2, **options)
        self.gateway = ZenohGateway(self.service, given)


@pytest.fixture(scope="module")
def scene() -> Iterator[Scene]:
    made = Scene()
    made.gateway.start()
    yield made
    made.gateway.stop()


def plots() -> bytes:
    frame = recording(30)
    return json.dumps(frame.filter(frame["sensor_id"] == "41-10").to_dicts()).encode()


def asked(session: zenoh.Session, selector: str, **content: Any) -> list[zenoh.Reply]:
    return list(session.get(selector, timeout=WAIT_TIMEOUT_S, **content))


@pytest.mark.fault(20)
def test_one_client_cannot_forge_the_output_to_another(scene: Scene) -> None:
    received: list[tuple[str, bytes]] = []
    with (
        zenoh.open(client_config(scene.endpoint)) as victim,
        zenoh.open(client_config(scene.endpoint)) as forger,
    ):
        victim.declare_subscriber(
            f"{ROOT}/**",
            lambda sample: received.append((str(sample.key_expr), sample.payload.to_bytes())),
        )
        # The service knows the subscription once its status arrives.
        wait_until(lambda: bool(received), "the status")
        for key in FORGED:
            forger.put(f"{ROOT}/{key}", b"forged")
            forger.delete(f"{ROOT}/{key}")
        forger.put("**", b"forged")
        # What the forger sent before has arrived when this has.
        before = len(scene.service.submissions)
        forger.put(f"{ROOT}/measurements/41-10", plots(), encoding="application/json")
        wait_until(lambda: len(scene.service.submissions) > before, "the measurements")
        scene.view.publish_updates([7])
        wait_until(lambda: any(b'"track_id":7' in payload for _, payload in received), "the update")
    forged = [key for key, payload in received if payload in (b"forged", b"")]
    assert forged == []


def test_a_client_cannot_answer_for_the_service(scene: Scene) -> None:
    with (
        zenoh.open(client_config(scene.endpoint)) as victim,
        zenoh.open(client_config(scene.endpoint)) as forger,
    ):
        for key in (f"{ROOT}/status", f"{ROOT}/tracks/*", f"{ROOT}/**"):
            forger.declare_queryable(key, lambda query: query.reply(query.key_expr, b"forged"))
        # A query of the forger's own shows that its declarations have arrived.
        assert asked(forger, f"{ROOT}/status")
        replies = asked(victim, f"{ROOT}/status", consolidation=zenoh.ConsolidationMode.NONE)
        contents = [one.ok.payload.to_bytes() for one in replies if one.ok is not None]
    assert len(contents) == 1
    assert b"forged" not in contents[0]


def test_the_end_of_a_stream_is_not_on_the_key_of_a_sensor(scene: Scene) -> None:
    with zenoh.open(client_config(scene.endpoint)) as session:
        (rejected,) = asked(session, f"{ROOT}/measurements/41-10?flush")
        assert rejected.err is not None
        assert json.loads(rejected.err.payload.to_bytes())["code"] == "ROLE_NOT_ALLOWED"
        assert scene.service.flushes == []
        assert all(one.ok is None for one in asked(session, "multiradar/*/flush"))
        assert scene.service.flushes == []
        for key in ("flush", "measurements/*?flush"):
            (answer,) = asked(session, f"{ROOT}/{key}")
            assert answer.ok is not None
    assert scene.service.flushes == ["zenoh", "zenoh"]


def test_other_hosts_cannot_operate_without_credentials() -> None:
    endpoint = free_endpoint()
    service = FakeService(view=StreamingView())
    given = ZenohOptions(
        listen=(endpoint.replace("127.0.0.1", "0.0.0.0"),), access=AccessSettings(insecure=True)
    )
    gateway = ZenohGateway(service, given)
    gateway.start()
    try:
        with zenoh.open(client_config(endpoint)) as session:
            for operation in ("flush?force=true", "clock?time_s=1", "measurements/*?flush"):
                replies = asked(session, f"{ROOT}/{operation}")
                assert [one for one in replies if one.ok is not None] == []
            sent = asked(
                session, f"{ROOT}/measurements/41-10", payload=plots(), encoding="application/json"
            )
            assert [one.ok is not None for one in sent] == [True]
    finally:
        gateway.stop()
    assert (service.flushes, service.clocks) == ([], [])


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({}, True),
        ({"connect": ("tcp/localhost:7447?rel=1",)}, True),
        ({"connect": ("ws/router:7449",)}, False),
        ({"listen": ("tcp/[::1]:0", "tcp/[::]:0")}, False),
        ({"multicast": True}, False),
        ({"config_file": ROOT_FOLDER / "deploy/zenoh/loopback.json5"}, True),
        ({"config_file": ROOT_FOLDER / "deploy/zenoh/service.json5"}, False),
        ({"access": AccessSettings(clients=clients())}, False),
    ],
)
def test_all_may_operate_only_where_no_other_host_connects(
    given: dict[str, Any], expected: bool
) -> None:
    assert all_may_operate(ZenohOptions(**given)) == expected


def keys(rules: dict[str, Any], client: str, message: str, flow: str = "ingress") -> set[str]:
    """Return the key expressions on which a client may send a message."""
    by_name = {one["id"]: one for one in rules["rules"]}
    return {
        key
        for policy in rules["policies"]
        if client in policy["subjects"]
        for name in policy["rules"]
        if flow in by_name[name]["flows"] and message in by_name[name]["messages"]
        for key in by_name[name]["key_exprs"]
    }


def test_names_have_the_same_roles_as_over_http() -> None:
    rules = access_control(AccessSettings(clients=clients()))
    assert rules["default_permission"] == "deny"
    assert {tuple(one["cert_common_names"]) for one in rules["subjects"]} == {
        (one.name,) for one in clients()
    }
    sent = {one.name: keys(rules, one.name, "put") for one in clients()}
    every = {f"{ROOT}/measurements/*"}
    assert sent == {
        "feed": every, "rival": every, "operate": every, "display": set(),
        "radar": {f"{ROOT}/measurements/41-10"},
    }  # fmt: skip
    asked_by = {one.name: keys(rules, one.name, "query") for one in clients()}
    # What each query may reach: the key expressions of the service that intersect.
    reached = {
        (name, target)
        for name, allowed in asked_by.items()
        for target in (
            "status",
            "tracks/1",
            "flush",
            "clock",
            "measurements/41-20",
            "measurements/41-10",
        )
        for key in allowed
        if zenoh.KeyExpr(key).intersects(f"{ROOT}/{target}")
    }
    measured = ("measurements/41-10", "measurements/41-20")
    assert reached == {
        *((name, target) for name in ("display", "operate") for target in ("status", "tracks/1")),
        *((name, target) for name in ("feed", "rival", "operate") for target in measured),
        ("radar", "measurements/41-10"),
        ("operate", "flush"),
        ("operate", "clock"),
    }
    for one in clients():
        assert not keys(rules, one.name, "declare_queryable") | keys(rules, one.name, "reply")


def test_a_router_without_a_certificate_is_warned_of() -> None:
    router = free_endpoint()
    with capture_logs() as logs:
        for access in (AccessSettings(), AccessSettings(clients=clients())):
            # Options may contain a key.
            given = ZenohOptions(listen=(), connect=(f"{router}?rel=1#iface=lo",), access=access)
            ZenohBus(given).close()
    assert [(one["event"], one["endpoint"]) for one in logs] == [("peer_denied", router)]
