"""Past times from files are those of memory, also after the data time was set back."""

from pathlib import Path

import polars as pl
import pytest

from multiradar.runtime.live.service import Service
from multiradar.runtime.picture.past import PastAsked
from multiradar.settings.limits import RuntimeLimits
from support.inputs.picture_frames import decoded
from support.processes.live_services import settled
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import START_S
from unit.runtime.recorded import test_history
from unit.runtime.recorded.test_history import FRAME, SMALL, Site

pytestmark = pytest.mark.slow

STEP_S = START_S + 300.0
#: Rows of the recording, one a second: up to the step, and after it.
BEFORE, AFTER = 1400, 1000


def seen(service: Service, after_s: float) -> tuple[list[int], list[float], set[int], int]:
    """Return the tracks at a time, their times, those that have a path, and the number of plots."""
    at_s = START_S + after_s
    tracks = service.view.tracks(at_s)
    _, tables = decoded(service.view.past_picture(PastAsked(at_s)))
    path, plots = set(tables["path"]["track_id"].tolist()), len(tables["plots"]["time_s"])
    return tracks["track_id"].to_list(), tracks["time_s"].to_list(), path, plots


def test_after_a_step_back_past_times_have_the_tracks_since_the_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files had the terminated tracks beside the present ones, or alone until the next write."""
    site, other = Site(tmp_path / "small", SMALL), Site(tmp_path / "whole", RuntimeLimits())
    for one in (site, other):
        one.history.parent.mkdir()
    # The plots since the step have other times.
    later = FRAME.with_columns(pl.col("time_s") + 0.1)
    times_s = (150.3, 290.3, 310.3, 420.3, 700.3, 990.3)

    def step(one: Site, service: Service) -> None:
        monkeypatch.setattr(test_history, "FRAME", FRAME)
        one.feed(service, 0, BEFORE)
        service.set_clock(STEP_S, source="test").result(WAIT_TIMEOUT_S)
        monkeypatch.setattr(test_history, "FRAME", later)
        one.feed(service, 300, 310)

    with other.service(history=False) as whole:
        step(other, whole)
        soon = seen(whole, 305.3)
        other.feed(whole, 310, AFTER)
        expected = [seen(whole, one) for one in times_s]
        with site.service() as service:
            step(site, service)
            past = service.publication.known.past
            assert past.complete_from_s("updates") == STEP_S
            assert seen(service, 305.3)[:3] == soon[:3]
            assert seen(service, 150.3)[:3] == expected[0][:3]
            site.feed(service, 310, AFTER)
            assert past.complete_from_s("updates") > STEP_S
            found = [seen(service, one) for one in times_s]
            assert [one[:3] for one in found] == [one[:3] for one in expected]
    assert expected[0][0][0] < expected[-1][0][0]
    assert [one[3] for one in found] == [one[3] for one in expected]
    with site.service() as service:
        assert settled(service)["alarms"] == []
        assert [seen(service, one)[:3] for one in times_s] == [one[:3] for one in expected]
