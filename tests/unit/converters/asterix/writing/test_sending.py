"""Replay of recordings: due times, and shifted times of day."""

from pathlib import Path

import numpy as np
import pytest

from multiradar_converters.asterix.decoding.editions import Editions
from multiradar_converters.asterix.decoding.gathering import gather
from multiradar_converters.asterix.decoding.timing import time_targets
from multiradar_converters.asterix.framing.containers import read_blocks
from multiradar_converters.asterix.writing.sending import Sending, read_sending
from support.asterix.octets import block, datagram, gps, north_mark, pcap, plot_001, plot_048, rply

DAY_S = 86_400.0


def sending(tmp_path: Path, content: bytes, shift_s: int = 0) -> Sending:
    path = tmp_path / "recording"
    path.write_bytes(content)
    return read_sending(path).moved(shift_s)


def payloads(sent: Sending) -> list[bytes]:
    ends = zip(sent.datagrams.begins.tolist(), sent.datagrams.ends.tolist(), strict=True)
    return [sent.datagrams.data[begin:end].tobytes() for begin, end in ends]


def times(tmp_path: Path, octets: bytes) -> list[float]:
    """Return the times of the plots, by the decoder."""
    path = tmp_path / "sent"
    path.write_bytes(octets)
    timed, _ = time_targets(gather(read_blocks(path), Editions()))
    assert timed is not None
    found: list[float] = timed.targets.time_s.tolist()
    return found


ONE, TWO = block(48, plot_048(100.0)), block(48, plot_048(101.5))


def test_datagrams_of_a_capture_are_sent_whole_when_they_came(tmp_path: Path) -> None:
    content = pcap([(1000.25, datagram(ONE + TWO)), (1004.5, datagram(b"\x00junk" + ONE))])
    sent = sending(tmp_path, content)
    assert payloads(sent) == [ONE + TWO, b"\x00junk" + ONE]
    assert sent.due_s.tolist() == [0.0, 4.25]
    assert sent.left_out == 0


def test_datagrams_of_a_replay_file_are_sent_after_their_pauses(tmp_path: Path) -> None:
    sent = sending(tmp_path, rply([(7, ONE), (250, TWO + ONE), (1000, ONE)]))
    assert payloads(sent) == [ONE, TWO + ONE, ONE]
    assert sent.due_s.tolist() == [0.0, 0.25, 1.25]


def test_blocks_are_sent_as_the_recorder_reports_over_midnight(tmp_path: Path) -> None:
    sent = sending(tmp_path, gps([(DAY_S - 1.0, ONE), (0.5, TWO), (0.25, ONE)]))
    assert payloads(sent) == [ONE, TWO, ONE]
    assert sent.due_s.tolist() == [0.0, 1.5, 1.5]


def test_blocks_without_a_recorder_are_due_by_their_records(tmp_path: Path) -> None:
    other = block(8, b"\x80\x14\x82")
    sent = sending(tmp_path, other + ONE + other + TWO + b"\x01\x02")
    assert payloads(sent) == [other, ONE, other, TWO]
    assert sent.due_s.tolist() == [0.0, 0.0, 0.0, 1.5]
    assert sent.left_out == 2


def test_no_octet_is_changed_unless_times_are_moved(tmp_path: Path) -> None:
    content = ONE + TWO
    assert b"".join(payloads(sending(tmp_path, content))) == content


@pytest.mark.parametrize("shift_s", [1, 3600, 50_000, 86_000])
def test_moved_times_of_day_are_read_back_moved(tmp_path: Path, shift_s: int) -> None:
    """Whole and truncated ones, over midnight too, where truncated ones begin again."""
    parts = [
        part
        for turn in range(200)
        for part in (
            north_mark((70_000.0 + 4.0 * turn) % DAY_S),
            block(1, plot_001(70_000.0 + 4.0 * turn + 1.5)),
            block(48, plot_048(70_000.0 + 4.0 * turn + 2.25, source="1401")),
        )
    ]
    whole = b"".join(parts)
    before = np.array(times(tmp_path, whole))
    moved = sending(tmp_path, whole, shift_s)
    after = np.array(times(tmp_path, b"".join(payloads(moved))))
    assert after.tolist() == ((before + shift_s) % DAY_S).tolist()
    assert moved.begin_s == 70_000.0


def test_an_invalid_time_of_day_is_not_shifted(tmp_path: Path) -> None:
    content = block(48, plot_048(90_000.0))
    assert payloads(sending(tmp_path, content, 10)) == [content]
