"""Four services around one point: each aircraft has one responsible track, and one name."""

from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from multiradar.runtime.live.snapshots import SnapshotRules
from multiradar.runtime.live.view import REGION_SILENT
from multiradar.storage.entries import StoredEntry
from multiradar.storage.snapshots import SnapshotFolder
from support.scenarios.region_scene import CENTRES, SCAN_S, Scene, Unit

pytestmark = pytest.mark.slow

AIRCRAFT = 24
#: All cross; then a region is not heard; it is heard; another ends, and starts again.
CROSSED_S, CUT_S, HEARD_S, ENDED_S, CONTINUED_S = 44.0, 54.0, 62.0, 70.0, 80.0


class Seen:
    """Which tracks are responsible for each aircraft at the end of each second."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.times: dict[str, list[float]] = {"none": [], "several": []}
        self.names: dict[str, set[str]] = defaultdict(set)
        self.regions: dict[str, list[str]] = defaultdict(list)
        self._since: dict[tuple[str, str], float] = {}

    def look(self, time_s: float) -> None:
        """Note the responsible tracks."""
        found: dict[str, list[str]] = defaultdict(list)
        for unit in self._scene.units.values():
            for row in unit.tracks().iter_rows(named=True):
                if row["responsible"]:
                    found[row["mode_s_address"]].append(row["region"])
                    self.names[row["mode_s_address"]].add(row["name"])
        for flight in self._scene.traffic:
            address = f"{flight.address:06x}"
            regions = found[address]
            self._note("none", address, time_s, wrong=not regions and address in self.regions)
            self._note("several", address, time_s, wrong=len(regions) > 1)
            if len(regions) == 1 and self.regions[address][-1:] != regions:
                self.regions[address] += regions

    def longest_s(self, what: str) -> float:
        """Return the longest time without, or with several, since the last call."""
        times, self.times[what] = self.times[what], []
        return max(times, default=0.0)

    def _note(self, what: str, address: str, time_s: float, *, wrong: bool) -> None:
        since_s = self._since.pop((what, address), time_s)
        if wrong:
            self._since[what, address] = since_s
            # It lasts from the second before until the next look.
            self.times[what].append(time_s - since_s + 1.0)


class Part(NamedTuple):
    """What was seen in a part of the run; the names and regions of each aircraft since its start.

    Attributes
    ----------
    none_s, several_s : float
        Longest time in which an aircraft had no responsible track, or several.
    """

    none_s: float
    several_s: float
    names: dict[str, int]
    regions: dict[str, list[str]]
    status: dict[str, Any]


class Run(NamedTuple):
    """The scene at its end, and what was seen of it."""

    scene: Scene
    parts: dict[str, Part]


@pytest.fixture(scope="module")
def run() -> Iterator[Run]:
    """Run all, and return what was seen in each part."""
    scene = Scene(AIRCRAFT, CONTINUED_S + 2.0)
    seen = Seen(scene)
    found = Run(scene, {})
    try:
        for name, until_s in (
            ("crossed", CROSSED_S), ("cut", CUT_S), ("heard", HEARD_S), ("ended", ENDED_S),
            ("continued", CONTINUED_S),
        ):  # fmt: skip
            scene.cut = {"south-west"} if name == "cut" else set()
            if name == "ended":
                journal = scene.units["north-east"].journal
                scene.kill("north-east")
            if name == "continued":
                scene.restart("north-east", journal)
            scene.run(until_s, seen.look)
            found.parts[name] = Part(
                seen.longest_s("none"), seen.longest_s("several"),
                {one: len(names) for one, names in seen.names.items()},
                {one: list(regions) for one, regions in seen.regions.items()},
                scene.units["south-east"].service.view.status(),
            )  # fmt: skip
        yield found
    finally:
        scene.stop()


def test_each_aircraft_has_one_responsible_track_across_boundaries_and_the_corner(run: Run) -> None:
    part = run.parts["crossed"]
    assert (len(part.names), part.none_s) == (AIRCRAFT, 0.0)
    assert part.several_s <= SCAN_S
    # Those that fly along a boundary, and across the corner, too.
    assert part.regions["4b0001"][-1] == "north-east"
    assert sum(len(set(regions)) > 1 for regions in part.regions.values()) > AIRCRAFT / 2
    assert set().union(*part.regions.values()) == set(CENTRES)


def test_an_aircraft_keeps_its_name_in_all_regions(run: Run) -> None:
    assert set(run.parts["continued"].names.values()) == {1}


@pytest.mark.parametrize("part", ["cut", "heard", "ended", "continued"])
def test_a_region_that_is_silent_or_ends_loses_and_doubles_no_aircraft_for_a_scan(
    run: Run, part: str
) -> None:
    assert run.parts[part].none_s <= SCAN_S
    assert run.parts[part].several_s <= SCAN_S


def test_a_silent_region_raises_an_alarm_until_it_is_heard_again(run: Run) -> None:
    raised = {name: REGION_SILENT in part.status["alarms"] for name, part in run.parts.items()}
    assert raised == {
        "crossed": False, "cut": True, "heard": False, "ended": True, "continued": False,
    }  # fmt: skip
    assert any("south-west" in one for one in run.parts["cut"].status["warnings"])


def test_a_replay_of_the_journal_has_the_same_events(run: Run) -> None:
    unit = run.scene.units["south-east"]
    again = Unit("south-east", run.scene.clock, unit.journal)
    try:
        events = again.read()
        assert events == unit.read()
        assert any(b'"duplicate_of":"north-east/' in one for one in events)
        assert any(b'"continues":"north-west/' in one for one in events)
    finally:
        again.stop()


def test_a_start_from_a_snapshot_continues_the_regions(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each snapshot was rejected: what the neighbours had handed over could not be restored."""
    journal = run.scene.units["south-east"].journal
    rules = SnapshotRules(SnapshotFolder(tmp_path / "journal"), 1e9, 1, "")
    read, begins = journal.read, list[int]()

    def noted(after: int) -> Iterator[StoredEntry]:
        begins.append(after)
        return read(after)

    monkeypatch.setattr(journal, "read", noted)
    found = []
    # The first replays the journal, and writes a snapshot at its end; the second starts from it,
    # and verifies the journal afterwards.
    for _ in range(2):
        unit = Unit("south-east", run.scene.clock, journal, rules)
        try:
            near, reached_s = unit.board.near()
            tracks = unit.tracks().to_dicts()
            found.append((unit.board.figures(), near.tobytes(), reached_s, tracks))
        finally:
            unit.stop()
    assert begins[:2] == [0, journal.counts().entries]
    assert found[0] == found[1]
    assert found[0][0]["neighbours"][0]["matched"] > 0
