"""Routers that go and come back, instances that die, publications that fall behind."""

import json
import threading
from typing import Any

import pytest
import zenoh

from multiradar.errors import ConfigurationError
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.session import ZenohBus, zenoh_config
from support.processes.waiting import WAIT_TIMEOUT_S, join, wait_until
from support.processes.zenoh_subscriber import SubscriberProcess, client_config
from support.scenarios.zenoh_scene import StreamingView, free_endpoint, gateway


def router(endpoint: str) -> zenoh.Session:
    return zenoh.open(zenoh_config(ZenohOptions(mode="router", listen=(endpoint,))))


def close(session: zenoh.Session) -> None:
    session.close()  # type: ignore[no-untyped-call]  # so in its stubs


@pytest.mark.slow
@pytest.mark.fault(31, 32)
def test_a_router_that_restarts_costs_no_update() -> None:
    view, endpoint = StreamingView(), free_endpoint()
    first = router(endpoint)
    with (
        gateway(view, mode="client", listen=(), connect=(endpoint,)) as running,
        SubscriberProcess(endpoint, 3000) as subscriber,
    ):
        view.stream(1000, tracks=20, per_s=5000)
        close(first)
        # No client is notified of these when they happen.
        view.stream(1000, tracks=20, per_s=5000)
        wait_until(lambda: running.counts.number("published_tracks") == 2000, "2000 updates")
        second = router(endpoint)
        wait_until(lambda: len(second.info.transports()) == 2, "both to come back")
        view.stream(1000, tracks=20, per_s=1000)
        result = subscriber.result()
        close(second)
    assert result == {
        **result,
        "distinct": 3000,
        "greatest": 3000,
        "twice": 0,
        "out_of_order": 0,
    }, result


def test_a_service_starts_without_its_router_and_publishes_when_it_is_available() -> None:
    view, endpoint = StreamingView(), free_endpoint()
    with gateway(view, mode="peer", listen=(), connect=(endpoint,)):
        view.stream(200, tracks=5, per_s=100_000)
        late = router(endpoint)
        with SubscriberProcess(endpoint, 200) as subscriber:
            result = subscriber.result()
        close(late)
    assert result["distinct"] == 200, result


def test_a_client_without_its_router_reports_an_error() -> None:
    options = ZenohOptions(
        mode="client", listen=(), connect=("tcp/127.0.0.1:1",), client_wait_s=0.3
    )
    with pytest.raises(
        ConfigurationError, match=r"cannot open the Zenoh session.*127\.0\.0\.1:1"
    ) as caught:
        ZenohBus(options)
    assert "/src/" not in str(caught.value)


def test_of_an_endpoint_only_protocol_and_address_are_reported() -> None:
    endpoint, secret = free_endpoint(), "#private_key_base64=c2VjcmV0"
    options = ZenohOptions(
        listen=(f"{endpoint}{secret}",), connect=(f"tcp/127.0.0.1:1?rel=1{secret}",)
    )
    bus = ZenohBus(options)
    assert (bus.endpoints, bus.unreachable) == ((endpoint,), ("tcp/127.0.0.1:1",))
    bus.close()
    for wrong in ("tcp/192.0.2.1:1", "192.0.2.1:1"):
        with pytest.raises(ConfigurationError, match=wrong) as caught:
            ZenohBus(ZenohOptions(listen=(f"{wrong}{secret}",)))
        assert "private_key" not in str(caught.value)


@pytest.mark.fault(31)
def test_of_two_routers_at_one_port_the_lost_one_is_reported() -> None:
    first = free_endpoint()
    second = first.replace("127.0.0.1", "127.0.0.2")
    routers = [router(first), router(second)]
    bus = ZenohBus(ZenohOptions(listen=(), connect=(first, second)))
    wait_until(lambda: bus.links == 2 and bus.unreachable == (), "both links")
    close(routers.pop())
    wait_until(lambda: bus.unreachable == (second,), "the lost router")
    bus.close()
    close(routers.pop())


def test_a_port_in_use_is_an_error_at_the_start() -> None:
    with (
        gateway(StreamingView()) as running,
        pytest.raises(ConfigurationError, match="cannot open the Zenoh session"),
    ):
        ZenohBus(ZenohOptions(listen=running.endpoints))


def test_a_standby_waits_until_the_service_before_it_has_closed_its_port() -> None:
    opened: list[ZenohBus] = []
    with gateway(StreamingView()) as running:
        options = ZenohOptions(listen=running.endpoints, listen_wait_s=WAIT_TIMEOUT_S)
        waiting = threading.Thread(target=lambda: opened.append(ZenohBus(options)), daemon=True)
        waiting.start()
        # The session before serves while the other one tries.
        with zenoh.open(client_config(running.endpoints[0])) as client:
            assert client.info.peers_zid()
        assert opened == []
    join(waiting)
    assert opened[0].endpoints == options.listen
    opened[0].close()


def test_others_see_an_instance_come_and_go() -> None:
    seen: list[tuple[str, str]] = []
    endpoint = free_endpoint()
    hub = router(endpoint)
    with zenoh.open(client_config(endpoint)) as watcher:
        watcher.liveliness().declare_subscriber(
            "multiradar/v1/instances/*",
            lambda sample: seen.append((str(sample.kind), str(sample.key_expr))),
        )
        with gateway(StreamingView(), mode="client", listen=(), connect=(endpoint,)):
            wait_until(lambda: len(seen) >= 1, "the instance to come")
        wait_until(lambda: len(seen) >= 2, "the instance to go")
    close(hub)
    assert [kind.rpartition(".")[2] for kind, _ in seen] == ["PUT", "DELETE"]
    assert seen[0][1] == seen[1][1]


def test_late_subscribers_get_the_data_from_before_the_start() -> None:
    view = StreamingView()
    view.publish_updates([1, 2, 3] * 100)
    view.ring.lead()
    with gateway(view) as running:
        with SubscriberProcess(running.endpoints[0], 300) as subscriber:
            result = subscriber.result()
        assert running.counts.number("published_tracks") == 300
    assert (result["distinct"], result["twice"]) == (300, 0), result


def test_a_publication_behind_reports_lost_events() -> None:
    view = StreamingView()
    with gateway(view) as running:
        gap = json.dumps({"gap": {"from": 1, "to": 9}}).encode()
        view.publish_event("gap", "", gap)
        wait_until(lambda: running.counts.number("published_gaps") == 1, "the gap")
        with zenoh.open(client_config(running.endpoints[0])) as session:
            status = _documents(session, "multiradar/v1/status")[0]
    assert status["zenoh"]["published_gaps"] == 1
    assert status["zenoh"]["alarms"][-1]["code"] == "PUBLICATION_GAP"


def _documents(session: zenoh.Session, selector: str) -> list[Any]:
    replies = list(session.get(selector, timeout=WAIT_TIMEOUT_S))
    return [json.loads(one.ok.payload.to_bytes()) for one in replies if one.ok is not None]
