"""The Zenoh configurations of deploy/, opened by the service's own session."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import zenoh

from multiradar.errors import ConfigurationError
from multiradar.ingest.zenoh.access_control import access_control
from multiradar.ingest.zenoh.gateway import ZenohGateway
from multiradar.ingest.zenoh.keys import query_key
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.session import ZenohBus
from multiradar.runtime.queries.registry import QUERIES, Query
from multiradar.settings.access import AccessSettings
from support.access import clients as listed
from support.fakes.fake_service import FakeService
from support.paths import ROOT
from support.processes.certificates import Authority
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.processes.zenoh_subscriber import certified_config, client_config
from support.scenarios.live_scene import recording
from support.scenarios.zenoh_scene import StreamingView, connections, free_endpoint

FOLDER = ROOT / "deploy/zenoh"
JSON = "application/json"
#: Keys on which the service alone publishes, and expressions that contain them.
OUTPUT = (
    "tracks/7", "ended/7", "biases/41-10", "status", "sensors/41-10", "forecasts/7", "encounters",
    "plots/7", "residuals", "regions", "instances/x", "tracks/*", "**", "tracks/7/@adv/pub/a/1/_",
)  # fmt: skip


@pytest.mark.parametrize("name", ["loopback.json5", "router.json5", "mtls.json5", "service.json5"])
def test_every_configuration_disables_discovery_and_bounds_messages(name: str) -> None:
    config = zenoh.Config.from_file(str(FOLDER / name))
    assert json.loads(config.get_json("scouting/multicast/enabled")) is False
    assert json.loads(config.get_json("scouting/gossip/enabled")) is False
    assert json.loads(config.get_json("adminspace/enabled")) is False
    assert json.loads(config.get_json("timestamping/enabled")) is True
    # A subscriber may block for five seconds without losing its connection; a router does not.
    lease_ms = 2_000 if name == "service.json5" else 10_000
    assert json.loads(config.get_json("transport/link/tx/lease")) == lease_ms
    assert json.loads(config.get_json("transport/link/rx/max_message_size")) == 16 * 1024 * 1024


def test_the_mtls_configuration_denies_what_no_rule_allows() -> None:
    config = zenoh.Config.from_file(str(FOLDER / "mtls.json5"))
    access = json.loads(config.get_json("access_control"))
    assert access["enabled"] is True
    assert access["default_permission"] == "deny"
    assert access["subjects"]
    assert all(subject["cert_common_names"] for subject in access["subjects"])
    assert json.loads(config.get_json("transport/link/tls/enable_mtls")) is True
    assert json.loads(config.get_json("transport/link/protocols")) == ["tls"]
    listens = json.loads(config.get_json("listen/endpoints"))
    assert listens
    assert all(endpoint.startswith("tls/") for endpoint in listens)


@pytest.mark.parametrize("query", QUERIES, ids=lambda query: query.name)
def test_a_display_may_send_every_query_and_receive_its_answer(query: Query) -> None:
    config = zenoh.Config.from_file(str(FOLDER / "mtls.json5"))
    access = json.loads(config.get_json("access_control"))
    names = [one["rules"] for one in access["policies"] if one["subjects"] == ["display"]]
    key = zenoh.KeyExpr(query_key(query, "7"))
    for flow, message in (("ingress", "query"), ("egress", "reply")):
        granted = [
            zenoh.KeyExpr(one)
            for rule in access["rules"]
            if rule["id"] in names[0] and flow in rule["flows"] and message in rule["messages"]
            for one in rule["key_exprs"]
        ]
        assert any(one.includes(key) for one in granted), (flow, str(key))


def test_the_configuration_of_one_machine_carries_updates(tmp_path: Path) -> None:
    text = (FOLDER / "loopback.json5").read_text(encoding="utf-8")
    endpoint = free_endpoint()
    file = tmp_path / "loopback.json5"
    file.write_text(text.replace("tcp/127.0.0.1:7447", endpoint), encoding="utf-8")
    view = StreamingView()
    service = ZenohGateway(FakeService(view=view), ZenohOptions(config_file=file))
    service.start()
    try:
        assert service.endpoints == (endpoint,)
        with zenoh.open(client_config(endpoint)) as session:
            assert document(session, "multiradar/v1/status")["event_sequence"] == 0
    finally:
        service.stop()


def test_clients_on_one_machine_cannot_speak_for_the_service(tmp_path: Path) -> None:
    text = (FOLDER / "loopback.json5").read_text(encoding="utf-8")
    endpoint = free_endpoint()
    file = tmp_path / "loopback.json5"
    file.write_text(text.replace("tcp/127.0.0.1:7447", endpoint), encoding="utf-8")
    view = StreamingView()
    sink = FakeService(view=view)
    service = ZenohGateway(sink, ZenohOptions(config_file=file, status_period_s=0.2))
    service.start()
    try:
        with (
            zenoh.open(client_config(endpoint)) as victim,
            zenoh.open(client_config(endpoint)) as forger,
        ):
            received = subscribed(victim, "multiradar/v1/**")
            wait_until(lambda: bool(received), "the status")
            forge(forger)
            # What the forger sent before has arrived when this has.
            forger.put("multiradar/v1/measurements/41-10", plots("41-10"), encoding=JSON)
            wait_until(lambda: bool(sink.submissions), "the measurements")
            view.publish_updates([7])
            wait_until(lambda: b'"track_id":7' in b"".join(received), "the update")
            assert document(victim, "multiradar/v1/status")["event_sequence"] == 1
    finally:
        service.stop()
    assert [one for one in received if one in (b"forged", b"")] == []


@pytest.mark.parametrize("access", [AccessSettings(clients=listed()), AccessSettings()])
def test_clients_of_the_router_of_compose_cannot_speak_for_the_service(
    tmp_path: Path, access: AccessSettings
) -> None:
    clients, own = free_endpoint(), free_endpoint().replace("tcp/", "ws/")
    text = (FOLDER / "router.json5").read_text(encoding="utf-8")
    for found, put in {"tcp/0.0.0.0:7447": clients, "ws/0.0.0.0:7449": own}.items():
        assert found in text
        text = text.replace(found, put)
    file = tmp_path / "router.json5"
    file.write_text(text, encoding="utf-8")
    view = StreamingView()
    sink = FakeService(view=view)
    text = (FOLDER / "service.json5").read_text(encoding="utf-8")
    assert "ws/router:7449" in text
    of_service = tmp_path / "service.json5"
    of_service.write_text(text.replace("ws/router:7449", own), encoding="utf-8")
    # As in compose.yaml: it has clients with keys, or none, and no certificates.
    options = ZenohOptions(config_file=of_service, access=access, status_period_s=0.2)
    service = ZenohGateway(sink, options)
    with zenoh.open(zenoh.Config.from_file(str(file))):
        service.start()
        try:
            with (
                zenoh.open(client_config(clients)) as victim,
                zenoh.open(client_config(clients)) as forger,
            ):
                received = subscribed(victim, "multiradar/v1/**")
                wait_until(lambda: bool(received), "the status")
                forge(forger)
                # What the forger sent before has arrived when this has.
                forger.put("multiradar/v1/measurements/41-10", plots("41-10"), encoding=JSON)
                wait_until(lambda: bool(sink.submissions), "the measurements")
                view.publish_updates([7])
                wait_until(lambda: b'"track_id":7' in b"".join(received), "the update")
                assert document(victim, "multiradar/v1/status")["event_sequence"] == 1
                receipt = document(
                    victim,
                    "multiradar/v1/measurements/41-10",
                    payload=plots("41-10"),
                    encoding=JSON,
                )
                assert receipt["accepted"] > 0
                # Operations need a key, over HTTP.
                for operation in (
                    "flush", "clock?time_s=1", "**?force=true", "measurements/*?flush",
                ):  # fmt: skip
                    asked = answers(victim, f"multiradar/v1/{operation}")
                    assert not [one for one in asked if one.ok]
                assert (sink.flushes, sink.clocks) == ([], [])
        finally:
            service.stop()
    assert [one for one in received if one in (b"forged", b"")] == []


def test_clients_of_the_router_may_ask_for_all_output() -> None:
    config = zenoh.Config.from_file(str(FOLDER / "router.json5"))
    rules = {one["id"]: one for one in json.loads(config.get_json("access_control"))["rules"]}
    own = {one["id"]: one for one in access_control(AccessSettings())["rules"]}
    assert set(rules["ask"]["key_exprs"]) == set(own["read"]["key_exprs"])


def test_an_invalid_configuration_is_rejected_with_its_name(tmp_path: Path) -> None:
    file = tmp_path / "broken.json5"
    file.write_text("{ mode: 'unknown' }", encoding="utf-8")
    with pytest.raises(ConfigurationError, match=r"broken\.json5"):
        ZenohBus(ZenohOptions(config_file=file))


class Guarded:
    """A service behind mtls.json5, and clients with certificates."""

    def __init__(self, folder: Path) -> None:
        self.authority = Authority(folder / "authority")
        self.endpoint = free_endpoint().replace("tcp/", "tls/")
        certificate, key = self.authority.issue("multiradar")
        text = (FOLDER / "mtls.json5").read_text(encoding="utf-8")
        for found, put in {
            "tls/0.0.0.0:7448": self.endpoint,
            "/etc/multiradar/tls/ca.pem": str(self.authority.certificate),
            "/etc/multiradar/tls/service.pem": str(certificate),
            "/etc/multiradar/tls/service.key": str(key),
        }.items():
            assert found in text
            text = text.replace(found, put)
        file = folder / "mtls.json5"
        file.write_text(text, encoding="utf-8")
        self.view = StreamingView()
        self.service = FakeService(view=self.view)
        self.gateway = ZenohGateway(self.service, ZenohOptions(config_file=file))

    def wait_for_their_end(self) -> None:
        """Wait until no client is connected: all earlier messages have arrived."""
        wait_until(lambda: connections(self.gateway) == 0, "the end of the connection")

    def client(self, name: str, authority: Authority | None = None) -> zenoh.Config:
        """Configuration of a client with a certificate of this common name."""
        return certified_config(self.endpoint, self.authority, name, authority)


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Guarded]:
    scene = Guarded(tmp_path_factory.mktemp("mtls"))
    scene.gateway.start()
    yield scene
    scene.gateway.stop()


def subscribed(session: zenoh.Session, *keys: str) -> list[bytes]:
    """Return a list of the content of all samples on these keys, which grows."""
    received: list[bytes] = []
    for key in keys:
        session.declare_subscriber(key, lambda one: received.append(one.payload.to_bytes()))
    return received


def forge(session: zenoh.Session) -> None:
    """Send samples in the name of the service, remove its own, and offer to answer for it."""
    for key in OUTPUT:
        session.put(f"multiradar/v1/{key}", b"forged")
        session.delete(f"multiradar/v1/{key}")
    for key in ("status", "tracks/*", "**"):
        session.declare_queryable(
            f"multiradar/v1/{key}", lambda query: query.reply(query.key_expr, b"forged")
        )


def answers(session: zenoh.Session, selector: str, **content: Any) -> list[zenoh.Reply]:
    return list(session.get(selector, timeout=WAIT_TIMEOUT_S, **content))


def document(session: zenoh.Session, selector: str, **content: Any) -> dict[str, Any]:
    (reply,) = answers(session, selector, **content)
    assert reply.ok is not None
    found: dict[str, Any] = json.loads(reply.ok.payload.to_bytes())
    return found


def plots(sensor_id: str) -> bytes:
    frame = recording(30)
    return json.dumps(frame.filter(frame["sensor_id"] == sensor_id).to_dicts()).encode()


def test_a_feed_may_measure_under_its_own_name_only(guarded: Guarded) -> None:
    with zenoh.open(guarded.client("feed-41-10")) as session:
        receipt = document(
            session,
            "multiradar/v1/measurements/41-10",
            payload=plots("41-10"),
            encoding=JSON,
        )
        assert receipt["accepted"] > 0
        taken = len(guarded.service.submissions)
        rejected = answers(
            session, "multiradar/v1/measurements/41-20", payload=plots("41-20"), encoding=JSON
        )
        assert all(reply.ok is None for reply in rejected)
        # Nor does it read.
        assert not [reply for reply in answers(session, "multiradar/v1/status") if reply.ok]
        session.put("multiradar/v1/measurements/41-20", plots("41-20"), encoding=JSON)
    guarded.wait_for_their_end()
    assert len(guarded.service.submissions) == taken


def test_a_display_reads_and_may_not_measure(guarded: Guarded) -> None:
    received: list[bytes] = []
    with zenoh.open(guarded.client("display")) as session:
        subscriber = zenoh.ext.declare_advanced_subscriber(
            session,
            "multiradar/v1/tracks/*",
            lambda sample: received.append(sample.payload.to_bytes()),
            history=zenoh.ext.HistoryConfig(),
            recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
        )
        assert document(session, "multiradar/v1/status")["zenoh"]["instance"]
        guarded.view.publish_updates([1, 2, 3])
        wait_until(lambda: len(received) >= 3, "three updates")
        assert len(received) == 3
        taken = len(guarded.service.submissions)
        session.put("multiradar/v1/measurements/41-10", plots("41-10"), encoding=JSON)
        subscriber.undeclare()  # type: ignore[no-untyped-call]  # so in its stubs
    guarded.wait_for_their_end()
    assert len(guarded.service.submissions) == taken


@pytest.mark.fault(42)
def test_a_certificate_of_another_authority_is_rejected(guarded: Guarded, tmp_path: Path) -> None:
    stranger = Authority(tmp_path / "stranger", "another-authority")
    with pytest.raises(zenoh.ZError):
        zenoh.open(guarded.client("display", stranger))


@pytest.mark.fault(42)
def test_a_client_without_a_certificate_or_without_tls_is_rejected(guarded: Guarded) -> None:
    without = client_config(guarded.endpoint)
    without.insert_json5("connect/timeout_ms", "1500")
    without.insert_json5("connect/exit_on_failure", "true")
    ca = str(guarded.authority.certificate)
    without.insert_json5("transport/link/tls/root_ca_certificate", json.dumps(ca))
    with pytest.raises(zenoh.ZError):
        zenoh.open(without)
    plain = client_config(guarded.endpoint.replace("tls/", "tcp/"))
    plain.insert_json5("connect/timeout_ms", "1500")
    plain.insert_json5("connect/exit_on_failure", "true")
    with pytest.raises(zenoh.ZError):
        zenoh.open(plain)


def test_a_known_authority_does_not_give_rights_to_an_unknown_name(guarded: Guarded) -> None:
    with zenoh.open(guarded.client("somebody")) as session:
        assert not [reply for reply in answers(session, "multiradar/v1/status") if reply.ok]
        taken = len(guarded.service.submissions)
        session.put("multiradar/v1/measurements/41-10", plots("41-10"), encoding=JSON)
    guarded.wait_for_their_end()
    assert len(guarded.service.submissions) == taken


@pytest.mark.parametrize(
    ("name", "asked"),
    [("feed-41-10", "measurements/41-10"), ("display", "status"), ("somebody", "status")],
)
@pytest.mark.fault(20)
def test_no_client_can_speak_for_the_service_to_another(
    guarded: Guarded, name: str, asked: str
) -> None:
    seen = ("tracks/**", "biases/**", "ended/**", "sensors/**", "status", "encounters", "regions")
    with zenoh.open(guarded.client("display")) as victim:
        received = subscribed(victim, *(f"multiradar/v1/{one}" for one in seen))
        wait_until(lambda: connections(guarded.gateway) == 1, "the connection")
        with zenoh.open(guarded.client(name)) as forger:
            forge(forger)
            # What the forger sent before has arrived when this is answered.
            answers(forger, f"multiradar/v1/{asked}")
            status = document(victim, "multiradar/v1/status")
        wait_until(lambda: connections(guarded.gateway) == 1, "the end of the forger")
        guarded.view.publish_updates([7])
        wait_until(lambda: b'"track_id":7' in b"".join(received), "the update")
    guarded.wait_for_their_end()
    assert status["zenoh"]["instance"]
    assert [one for one in received if one in (b"forged", b"")] == []
