"""Every key of the service, asked by a certificate of every role: what no role allows is denied."""

import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import zenoh

from multiradar.ingest.zenoh.gateway import ZenohGateway
from multiradar.ingest.zenoh.keys import CLOCK, FLUSH, MEASUREMENTS
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.session import ZenohBus
from multiradar.settings.access import AccessSettings
from support.access import clients
from support.fakes.fake_service import FakeService
from support.processes.certificates import Authority
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.processes.zenoh_subscriber import certified_config
from support.scenarios.live_scene import recording
from support.scenarios.zenoh_scene import StreamingView, connections, free_endpoint

#: A name that the authority knows and the settings do not.
STRANGER = "stranger"
CALLERS = (*(one.name for one in clients()), STRANGER)
MEASURES = {"feed", "rival", "radar", "operate"}
JSON = "application/json"
#: `radar` is bound to the first.
SENSORS = ("41-10", "41-20")
READS = {"display", "operate"}


class Scene:
    """A service with certificates and a client of each role, and the keys that it declared."""

    def __init__(self, folder: Path, keys: set[str]) -> None:
        self.authority = Authority(folder)
        self.keys = keys
        certificate, private_key = self.authority.issue("multiradar")
        access = AccessSettings(
            clients=clients(),
            certificate=certificate,
            private_key=private_key,
            client_authority=self.authority.certificate,
        )
        self.endpoint = free_endpoint().replace("tcp/", "tls/")
        self.service = FakeService(view=StreamingView())
        self.gateway = ZenohGateway(
            self.service, ZenohOptions(listen=(self.endpoint,), access=access)
        )

    def config(self, name: str) -> zenoh.Config:
        """Return the configuration of a client with a certificate of this name."""
        return certified_config(self.endpoint, self.authority, name)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Scene]:
    keys: set[str] = set()
    with pytest.MonkeyPatch.context() as patch:
        for name in ("answer", "subscribe"):
            declare = getattr(ZenohBus, name)

            def noted(bus: ZenohBus, key: str, *given: Any, declare: Any = declare) -> Any:
                keys.add(key)
                return declare(bus, key, *given)

            patch.setattr(ZenohBus, name, noted)
        made = Scene(tmp_path_factory.mktemp("roles"), keys)
        made.gateway.start()
    yield made
    made.gateway.stop()


def allowed(key: str) -> set[str]:
    """Return who may ask on a key that the service declared."""
    if key in (FLUSH, CLOCK):
        return {"operate"}
    return MEASURES if key == f"{MEASUREMENTS}/*" else READS


@pytest.mark.parametrize("caller", CALLERS)
def test_each_key_is_answered_to_the_roles_that_it_is_for(scene: Scene, caller: str) -> None:
    # Caches of updates without samples do not answer.
    keys = {key for key in scene.keys if "@adv" not in key}
    assert len(keys) > 10
    with zenoh.open(scene.config(caller)) as session:
        answered = {
            key
            for key in keys
            if list(session.get(key.replace("*", "41-10"), timeout=WAIT_TIMEOUT_S))
        }
    assert answered == {key for key in keys if caller in allowed(key)}


def test_only_feeds_put_measurements_and_no_one_puts_anything_else(scene: Scene) -> None:
    scene.service.flushes.clear()
    # Those who may put arrive last: what others put before them would be there, too.
    for caller in sorted(CALLERS, key=lambda one: one in MEASURES):
        with zenoh.open(scene.config(caller)) as session:
            for key in scene.keys - {f"{MEASUREMENTS}/*"}:
                session.put(key.replace("*", "41-10"), _plots("41-10"), encoding=JSON)
            for sensor in SENSORS:
                session.put(f"{MEASUREMENTS}/{sensor}", _plots(sensor), encoding=JSON)
        wait_until(lambda: connections(scene.gateway) == 0, "the end of the connection")
    expected = {SENSORS[0]: len(MEASURES), SENSORS[1]: len(MEASURES - {"radar"})}
    sent = scene.service.submissions
    wait_until(lambda: len(sent) >= sum(expected.values()), "the measurements")
    assert Counter(one.frame["sensor_id"][0] for one in sent) == expected
    assert scene.service.flushes == []


def _plots(sensor_id: str) -> bytes:
    frame = recording(30)
    return json.dumps(frame.filter(frame["sensor_id"] == sensor_id).to_dicts()).encode()
