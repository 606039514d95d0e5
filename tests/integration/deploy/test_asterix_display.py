"""A display as in the example of `deploy/`, over a restart of the service."""

from pathlib import Path

from multiradar.app import Application
from multiradar.settings.service import load_settings
from support.asterix.display import display, heard
from support.paths import ROOT
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import cut, recording, sensors

EXAMPLE = ROOT / "deploy" / "asterix.toml"
#: Not the group of the example, which another test may receive at the same time.
GROUP = "239.192.77.63"


def test_a_display_gets_system_tracks(tmp_path: Path) -> None:
    with display(GROUP, 0) as screen:
        (output,) = load_settings(EXAMPLE).asterix.output
        moved = {"address": GROUP, "port": screen.getsockname()[1]}
        settings = load_settings(
            EXAMPLE,
            {
                "asterix": {"listen": (), "output": (output.model_dump() | moved,)},
                "server": {"port": 0},
                "zenoh": {"enabled": False},
                "journal": {"path": tmp_path / "journal.sqlite"},
            },
        )
        first, second = cut(recording(1600), [800])[:2]
        for frame in (first, second):
            # The second start replays the journal and sends only new data.
            application = Application(settings, sensors(), lambda: None)
            application.start()
            try:
                application.service.submit(frame, source="test").result(WAIT_TIMEOUT_S)
                application.service.flush(source="test").result(WAIT_TIMEOUT_S)
                application.service.settled().result(WAIT_TIMEOUT_S)
                status = application.service.view.status()
            finally:
                application.stop()
            records = heard(screen)
            assert {one["010"]["SIC"] for one in records[62]} == {250}
            assert len({one["040"] for one in records[62]}) == 12
            assert {one["380"]["ADR"] >> 8 for one in records[62]} == {0x4B00}
            times = [one["070"] for one in records[62]]
            assert times == sorted(times)
            # 40 s each, by 4 s.
            assert len(set(times)) >= 9
            assert status["asterix_output"]["failure"] is None
            numbers = {one["380"]["ADR"]: one["040"] for one in records[62]}
        # Biases have settled by then.
        assert "081" in records[63][-1]
    # The same numbers at both starts: a number follows from the track alone.
    assert sorted(numbers.values()) == list(range(1, 13))
