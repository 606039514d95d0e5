"""The output feed never blocks, and notifies the reader of losses."""

import threading

from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.output_feed import OutputFeed
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch
from support.processes.waiting import join
from support.scenarios.live_scene import recording, sensors

TABLE = sensors()


def made(pieces: int) -> list[EngineOutput]:
    """Outputs with some updates each."""
    engine = Engine(TABLE, TrackingSettings())
    frame = recording(100 * pieces)
    found = [
        engine.push(measurement_batch(frame[100 * k : 100 * (k + 1)], TABLE)[0])
        for k in range(pieces)
    ]
    return [output for output in found if len(output.updates)]


def test_output_comes_in_order_and_then_the_end() -> None:
    feed, outputs = OutputFeed(), made(6)
    for output in outputs:
        feed.put(output)
    feed.close()
    assert feed.rows == sum(len(output.updates) for output in outputs)
    taken = [feed.pop() for _ in outputs]
    assert [fed.output for fed in taken if fed is not None] == outputs
    assert feed.pop() is None
    assert (feed.rows, feed.dropped) == (0, 0)


def test_what_is_too_much_is_dropped_and_counted_and_notices_stay() -> None:
    outputs = made(6)
    rows = [len(output.updates) for output in outputs]
    feed = OutputFeed(rows_max=rows[0] + rows[1])
    feed.put(outputs[0])
    feed.catch_up()
    feed.put(outputs[1])
    assert feed.dropped == 0
    feed.put(outputs[2])
    assert feed.dropped == sum(rows[:3])
    feed.put(outputs[3])
    feed.close()
    taken = [feed.pop() for _ in range(3)]
    assert [fed is not None and fed.caught_up for fed in taken] == [True, False, False]
    assert [fed is not None and fed.lost for fed in taken] == [False, True, False]
    assert taken[2] is not None
    assert taken[2].output is outputs[3]


def test_a_restart_replaces_the_queued_output() -> None:
    feed, outputs = OutputFeed(), made(3)
    feed.put(outputs[0])
    feed.restart()
    feed.close()
    fed = feed.pop()
    assert fed is not None
    assert fed.restarted
    assert (feed.rows, feed.dropped) == (0, 0)


def test_the_end_of_the_replay_is_notified_across_a_restart() -> None:
    """The notice is sent once, and nothing is reported before it."""
    feed, outputs = OutputFeed(), made(3)
    feed.put(outputs[0])
    feed.catch_up()
    feed.restart()
    first, second = feed.pop(), feed.pop()
    assert first is not None
    assert (first.caught_up, first.restarted) == (True, False)
    assert first.reached_s == outputs[0].updates.time_s.max()
    assert first.reached == outputs[0].updates.sequence[-1]
    assert second is not None
    assert (second.caught_up, second.restarted) == (False, True)


def test_a_closed_feed_accepts_no_output() -> None:
    feed, outputs = OutputFeed(), made(3)
    feed.close()
    feed.put(outputs[0])
    assert feed.rows == 0
    assert feed.pop() is None


def test_a_waiting_reader_is_woken() -> None:
    feed, outputs = OutputFeed(), made(3)
    taken = []
    reader = threading.Thread(target=lambda: taken.extend([feed.pop(), feed.pop()]))
    reader.start()
    feed.put(outputs[0])
    feed.close()
    join(reader)
    assert [fed if fed is None else fed.output for fed in taken] == [outputs[0], None]
