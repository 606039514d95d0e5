"""Who sends system tracks: what goes out, when, and what becomes of what cannot."""

import os
import socket
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from multiradar.errors import ConfigurationError
from multiradar.ingest.asterix_output.sender import AsterixSender, Outlet
from multiradar.ingest.asterix_output.sinks import MemorySink, Sink, open_sink
from multiradar.runtime.asterix.channel import Channel, ChannelOptions
from multiradar.runtime.asterix.cycles import Cycles
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.output_feed import FeedItem, OutputFeed
from multiradar.settings.asterix_output import AsterixOutputSettings
from multiradar.tracking.outputs import EndedTracks, EngineOutput
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch
from multiradar_converters.asterix.layout.catalogue import layout_of
from multiradar_converters.asterix.layout.fields import record_fields
from multiradar_converters.asterix.layout.program import program_of, walk
from support.asterix.reports import SENDER
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import cut, recording, sensors

TABLE = sensors()
TRACKING = TrackingSettings()
BLOCKS = [bytes([62, 0, 4, 1]), bytes([63, 0, 5, 1, 2])]


class Rejecting:
    """A sink that takes nothing."""

    def send(self, blocks: Sequence[bytes]) -> int:
        return 0

    def close(self) -> None:
        """Nothing is open."""


def outputs(rows: int, pieces: int) -> list[EngineOutput]:
    engine = Engine(TABLE, TRACKING)
    frames = cut(recording(rows), [rows // pieces] * pieces)
    made = [engine.push(measurement_batch(frame, TABLE)[0]) for frame in frames]
    return [output for output in [*made, engine.flush()] if len(output.updates)]


def tracks(blocks: Sequence[bytes]) -> list[dict[str, Any]]:
    """Read the records of category 062 in blocks."""
    data = np.frombuffer(bytearray().join(one[3:] for one in blocks if one[0] == 62), np.uint8)
    program = program_of(layout_of(62, "1.21"))
    walked = walk(program, data, np.array([0]), np.array([len(data)]))
    assert not walked.faults[0, 0]
    return [record_fields(program, data, starts) for starts in walked.starts]


def sender(sink: Sink, live: Sequence[int] = ()) -> tuple[AsterixSender, OutputFeed]:
    feed = OutputFeed()
    outlet = Outlet("display", Channel(ChannelOptions(SENDER, status_period_s=4.0)), sink)
    ids = np.array(live, np.int64)
    return AsterixSender(feed, lambda: ids, TABLE, TRACKING, [outlet]), feed


def test_nothing_is_sent_of_what_the_journal_says_again() -> None:
    made = outputs(1200, 6)
    played, new = made[:3], made[3:]
    sink = MemorySink()
    sending, _ = sender(sink)
    for output in played:
        sending.step(FeedItem(output))
    sending.step(FeedItem(caught_up=True))
    assert sink.blocks == []
    for output in new:
        sending.step(FeedItem(output))
    assert {block[0] for block in sink.blocks} == {62, 63, 65}
    # The same as for a user from the start, except for the marks of first messages.
    whole = MemorySink()
    other, _ = sender(whole)
    other.step(FeedItem(caught_up=True))
    for output in made:
        other.step(FeedItem(output))
    assert whole.blocks[-2:] == sink.blocks[-2:]
    assert len(sink.blocks) < len(whole.blocks)


def test_reports_of_the_time_that_the_journal_reached_are_not_sent() -> None:
    made = outputs(1200, 6)
    channel = Channel(ChannelOptions(SENDER, status_period_s=4.0))
    cycles = Cycles(TABLE, TRACKING, [channel])
    due = [one for output in made for one in cycles.push(output)]
    reached_s = due[len(due) // 2].time_s
    sink = MemorySink()
    sending, _ = sender(sink)
    sending.step(FeedItem(caught_up=True, reached_s=reached_s))
    for output in made:
        sending.step(FeedItem(output))
    expected = [block for one in due if one.time_s > reached_s for block in one.blocks]
    assert len(sink.blocks) == len(expected) > 0


def test_after_a_failure_of_the_engine_nothing_is_reported_twice() -> None:
    made = outputs(1200, 6)
    once, again = MemorySink(), MemorySink()
    for sink in (once, again):
        sending, _ = sender(sink)
        sending.step(FeedItem(caught_up=True))
        for output in made[:4]:
            sending.step(FeedItem(output))
        if sink is again:
            sending.step(FeedItem(restarted=True))
            for output in made[:4]:
                sending.step(FeedItem(output))
        for output in made[4:]:
            sending.step(FeedItem(output))
    # What was in the air when it happened may differ; the number of messages does not.
    assert len(once.blocks) == len(again.blocks)
    assert once.blocks[-1] == again.blocks[-1]


@pytest.mark.parametrize("at", [3, 6, 8])
def test_nothing_is_reported_twice_after_the_data_time_was_set_back(at: int) -> None:
    """Times before the step back were taken for new ones, and everything since was sent again."""
    engine = Engine(TABLE, TRACKING)
    batches = [measurement_batch(frame, TABLE)[0] for frame in cut(recording(1000), [250] * 4)]
    items = [FeedItem(engine.push(batch)) for batch in batches]
    items += [FeedItem(engine.restart()), FeedItem(set_back=True)]
    items += [FeedItem(engine.push(batch)) for batch in batches]
    once, again, twice = MemorySink(), MemorySink(), MemorySink()
    for sink, repeats in ((once, []), (again, [at]), (twice, [at // 2, at])):
        sending, _ = sender(sink)
        sending.step(FeedItem(caught_up=True))
        for item in items[:at]:
            sending.step(item)
        for repeat in repeats:
            sending.step(FeedItem(restarted=True))
            for item in items[:repeat]:
                sending.step(item)
        for item in items[at:]:
            sending.step(item)
    assert len(once.blocks) == len(again.blocks) == len(twice.blocks) > 0
    assert once.blocks[-1] == again.blocks[-1] == twice.blocks[-1]


def test_tracks_that_ended_while_output_was_lost_are_given_up() -> None:
    made = outputs(1200, 6)
    sink = MemorySink()
    sending, _ = sender(sink, live=[1, 2, 3])
    sending.step(FeedItem(caught_up=True))
    for output in made[:3]:
        sending.step(FeedItem(output))
    sending.step(FeedItem(lost=True))
    sink.blocks.clear()
    # No later output reports their end.
    sending.step(FeedItem(replace(made[3], ended=EndedTracks.concatenate([]))))
    ended = [track["040"] for track in tracks(sink.blocks) if track["080"]["TSE"]]
    assert sorted(ended) == [4, 5, 6, 7, 8, 9, 10, 11, 12]
    # The next service status reports it.
    states = [block for block in sink.blocks if block[0] == 65 and block[3] == 0xF4]
    assert [block[-1] for block in states] == [0x60] + [0] * (len(states) - 1)


def test_what_a_sink_does_not_take_is_counted() -> None:
    sending, _ = sender(Rejecting())
    sending.step(FeedItem(caught_up=True))
    for output in outputs(800, 2):
        sending.step(FeedItem(output))
    counts = sending.counts()["outputs"]["display"]
    assert counts["blocks_sent"] == 0
    assert counts["octets"] == 0
    assert counts["blocks_dropped"] > 10
    assert counts["records"]["062"] > 50


def test_the_thread_sends_all_and_that_the_service_ends() -> None:
    sink = MemorySink()
    sending, feed = sender(sink)
    sending.start()
    sending.begin()
    for output in outputs(800, 2):
        feed.put(output)
    sending.stop()
    assert sink.blocks[-1][0] == 65
    assert sink.blocks[-1][3] == 0xF2
    assert sink.blocks[-1][-1] == 7
    counts = sending.counts()
    assert (counts["failure"], counts["updates_dropped"]) == (None, 0)
    assert counts["outputs"]["display"]["blocks_sent"] == len(sink.blocks)
    assert counts["outputs"]["display"]["octets"] == sum(map(len, sink.blocks))


def test_an_error_in_the_thread_is_reported_and_the_service_continues(
    caplog: pytest.LogCaptureFixture,
) -> None:
    sending, feed = sender(MemorySink())
    sending.start()
    sending.begin()
    engine = Engine(TABLE, TRACKING)
    output = engine.push(measurement_batch(recording(400), TABLE)[0])
    feed.put(replace(output, spread=output.spread[:0]))
    sending.stop()
    assert "expected one plot and one covariance" in str(sending.counts()["failure"])
    assert "ASTERIX output has stopped" in caplog.text


def receiver(group: str | None = None) -> socket.socket:
    found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    found.bind(("127.0.0.1" if group is None else group, 0))
    if group is not None:
        member = socket.inet_aton(group) + socket.inet_aton("127.0.0.1")
        found.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
    found.settimeout(WAIT_TIMEOUT_S)
    return found


@pytest.mark.parametrize("group", [None, "239.192.77.62"])
def test_blocks_go_out_as_datagrams(group: str | None) -> None:
    with receiver(group) as heard:
        port = heard.getsockname()[1]
        sink = open_sink(AsterixOutputSettings(address=group or "127.0.0.1", port=port))
        try:
            assert sink.send(BLOCKS) == 2
            assert [heard.recv(2000) for _ in BLOCKS] == BLOCKS
        finally:
            sink.close()


def test_a_datagram_that_is_too_large_is_dropped() -> None:
    sink = open_sink(AsterixOutputSettings(port=9))
    try:
        assert sink.send([bytes(70_000), BLOCKS[0]]) == 1
    finally:
        sink.close()


def test_a_missing_interface_is_reported() -> None:
    wrong = AsterixOutputSettings(address="239.192.77.62", port=9, interface="192.0.2.1")
    with pytest.raises(ConfigurationError, match=r"cannot send via 192\.0\.2\.1"):
        open_sink(wrong)


def test_blocks_are_added_to_a_file(tmp_path: Path) -> None:
    path = tmp_path / "tracks.ast"
    path.write_bytes(b"before")
    sink = open_sink(AsterixOutputSettings(file=path))
    assert sink.send(BLOCKS) == 2
    assert sink.send([]) == 0
    sink.close()
    assert path.read_bytes() == b"before" + b"".join(BLOCKS)


def test_a_file_that_cannot_be_written_to_is_reported(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="cannot write"):
        open_sink(AsterixOutputSettings(file=tmp_path / "nowhere" / "tracks.ast"))


def test_a_pipe_is_rejected_instead_of_waited_for(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(ConfigurationError, match="is a pipe"):
        open_sink(AsterixOutputSettings(file=pipe))


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_a_full_disk_drops_blocks() -> None:
    sink = open_sink(AsterixOutputSettings(file=Path("/dev/full")))
    try:
        assert sink.send(BLOCKS) == 0
    finally:
        sink.close()
