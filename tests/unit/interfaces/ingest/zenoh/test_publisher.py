"""What the publisher makes of the service's events."""

import json
from collections.abc import Callable
from typing import Any

from multiradar.clock import FixedClock
from multiradar.ingest.zenoh.catch_up import CatchUp, NumberedUpdate
from multiradar.ingest.zenoh.counts import ZenohCounts
from multiradar.ingest.zenoh.joining import JoinGate
from multiradar.ingest.zenoh.memory_bus import MemoryBus
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.publisher import CACHE_SAMPLES_MIN, Publisher
from support.scenarios.zenoh_scene import StreamingView

TRACK_7 = "multiradar/v1/tracks/7"


class Scene:
    def __init__(self, known_until: int = 0, **options: Any) -> None:
        self.view = StreamingView()
        self.bus = MemoryBus()
        self.clock = FixedClock()
        self.counts = ZenohCounts()
        self.catch_up = CatchUp(100)
        self.publisher = Publisher(
            outlet=self.bus,
            source=self.view.subscribe(0, 1000),
            known_until=known_until,
            gate=JoinGate(self.clock),
            catch_up=self.catch_up,
            counts=self.counts,
            options=ZenohOptions(retention_s=60.0, **options),
            clock=self.clock,
        )

    def publish(self, act: Callable[[StreamingView], None]) -> None:
        act(self.view)
        while self.publisher.step():
            continue


def test_an_update_goes_out_under_its_track_with_its_number() -> None:
    scene = Scene()
    scene.publish(lambda view: view.publish_updates([7, 9, 7]))
    assert [message.key for message in scene.bus.sent] == [
        TRACK_7,
        "multiradar/v1/tracks/9",
        TRACK_7,
    ]
    assert [message.attachment for message in scene.bus.sent] == [b"1", b"2", b"3"]
    assert scene.counts.number("published_tracks") == 3


def test_what_was_there_before_fills_the_caches_and_is_not_sent_again() -> None:
    scene = Scene(known_until=2)
    scene.publish(lambda view: view.publish_updates([7, 7, 7]))
    assert [message.attachment for message in scene.bus.sent] == [b"3"]
    assert len(scene.bus.streams[TRACK_7].kept) == 3


def test_a_bias_goes_out_under_its_sensor_with_its_number() -> None:
    scene = Scene()
    scene.publish(
        lambda view: view.publish_event("bias", "41-10", b'{"sensor_id":"41-10","epoch":4}')
    )
    (message,) = scene.bus.sent
    assert message.key == "multiradar/v1/biases/41-10"
    assert json.loads(message.payload) == {"sensor_id": "41-10", "epoch": 4, "sequence": 1}
    assert message.attachment == b"1"


def test_a_change_of_a_sensor_goes_out_once_under_the_sensor() -> None:
    scene = Scene(known_until=1)
    for _ in range(2):
        scene.publish(lambda view: view.publish_event("sensor", "41-10", b'{"added":false}'))
    (message,) = scene.bus.sent
    assert message.key == "multiradar/v1/sensors/41-10"
    assert (message.payload, message.attachment) == (b'{"added":false}', b"2")
    assert scene.counts.number("published_sensors") == 1


def test_a_dropped_track_is_reported_and_discarded_only_later() -> None:
    scene = Scene()
    scene.publish(lambda view: view.publish_updates([7]))
    scene.publish(lambda view: view.publish_event("ended", "7", b'{"track_id":7}'))
    assert scene.bus.sent[-1].key == "multiradar/v1/ended/7"
    scene.clock.advance(59.0)
    scene.publisher.step()
    assert not scene.bus.streams[TRACK_7].closed
    scene.clock.advance(2.0)
    scene.publisher.step()
    assert scene.bus.streams[TRACK_7].closed
    assert scene.counts.number("streams") == 0


def test_a_track_that_lives_again_is_not_discarded() -> None:
    scene = Scene()
    scene.publish(lambda view: view.publish_event("ended", "7", b"{}"))
    scene.publish(lambda view: view.publish_updates([7]))
    scene.clock.advance(100.0)
    scene.publisher.step()
    assert not scene.bus.streams[TRACK_7].closed


def test_many_tracks_share_what_may_be_kept() -> None:
    scene = Scene(cache_samples_max=1000, cache_samples_total=3000)
    scene.publish(lambda view: view.publish_updates(list(range(1, 101))))
    depths = [stream.kept.maxlen for stream in scene.bus.streams.values()]
    assert depths[:4] == [1000, 1000, 1000, 750]
    assert depths[-1] == CACHE_SAMPLES_MIN


def test_a_gap_is_counted_and_raises_an_alarm() -> None:
    scene = Scene()
    scene.publish(lambda view: view.publish_event("gap", "", b'{"gap":{"from":1,"to":5}}'))
    assert scene.counts.number("published_gaps") == 1
    assert scene.counts.document()["alarms"][0]["code"] == "PUBLICATION_GAP"


def test_catching_up_says_what_is_lost() -> None:
    catch_up = CatchUp(10)
    for number in range(1, 31):
        catch_up.append(NumberedUpdate(number, TRACK_7, b""))
    updates, lost = catch_up.after(25, 100)
    assert ([update.sequence for update in updates], lost) == ([26, 27, 28, 29, 30], 0)
    updates, lost = catch_up.after(20, 3)
    assert ([update.sequence for update in updates], lost) == ([21, 22, 23], 0)
    updates, lost = catch_up.after(15, 100)
    assert (updates[0].sequence, lost) == (21, 5)
    assert catch_up.after(30, 100) == ([], 0)


def test_the_limit_counts_the_updates_of_the_wanted_track() -> None:
    catch_up = CatchUp(100)
    for number in range(1, 31):
        key = TRACK_7 if number % 10 == 0 else "multiradar/v1/tracks/9"
        catch_up.append(NumberedUpdate(number, key, b""))
    after, received = 0, []
    while updates := catch_up.after(after, 2, TRACK_7)[0]:
        received += [update.sequence for update in updates]
        after = received[-1]
    assert received == [10, 20, 30]


def test_catching_up_restarts_when_the_journal_is_replayed() -> None:
    catch_up = CatchUp(10)
    for number in (1, 2, 3, 1, 2):
        catch_up.append(NumberedUpdate(number, TRACK_7, b""))
    assert [update.sequence for update in catch_up.after(0, 10)[0]] == [1, 2]
