"""Figures of the scorecard that count by a limit."""

from types import SimpleNamespace
from typing import cast

import numpy as np

from multiradar.evaluation.card import figures
from multiradar.evaluation.measures.track_classes import TrackClasses
from multiradar.evaluation.scorecard import Scorecard


def test_false_tracks_of_more_than_30_s_are_counted() -> None:
    life_s = np.array([29.0, 30.0, 30.5, 31.0, 100.0, 60.0])
    false = np.array([True, True, True, True, True, False])
    none = np.zeros(len(life_s), np.bool_)
    card = cast(
        "Scorecard", SimpleNamespace(track_classes=TrackClasses(~false, none, false, life_s))
    )
    found = figures._tracks(card)
    assert found == {
        "of_aircraft": 1, "duplicate": 0, "duplicate_longest_s": None, "false": 5,
        "false_longest_s": 100.0, "false_longer_than_30_s": 3, "not_judged": 0,
    }  # fmt: skip


def test_the_median_and_the_longest_initiation_are_also_in_scans() -> None:
    card = SimpleNamespace(
        delay_s=np.array([4.0, 20.0, 8.0, np.inf, np.nan]),
        settings=SimpleNamespace(scan_period_s=4.0),
    )
    found = figures._initiation(cast("Scorecard", card))
    assert (found["median_s"], found["longest_s"], found["never_tracked"]) == (8.0, 20.0, 1)
    assert (found["median_scans"], found["longest_scans"]) == (2.0, 5.0)
