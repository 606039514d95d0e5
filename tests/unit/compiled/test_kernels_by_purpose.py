"""The list of kernels by purpose contains all kernels of commands."""

from dataclasses import replace

import pytest

from multiradar.cli.options import FilterChoice
from multiradar.research.studies.catalogue import STUDIES
from multiradar.runtime.kernel_purposes import serve_purposes, track_purposes
from multiradar.tracking.settings import TrackingSettings
from multiradar_compiled.kernel_list import kernels_by_purpose, kernels_for
from support.scenarios import bearing_scene, live_scene

IMM = TrackingSettings(filter_name="imm")

OUTPUTS = (
    "--encounters",
    "--forecasts",
    "--trajectories",
    "--manoeuvre-planes",
    "--observability",
)


@pytest.mark.parametrize("name", [one.value for one in FilterChoice])
def test_every_filter_is_listed_with_every_output_and_kind_of_sensor(name: str) -> None:
    outputs = dict.fromkeys(OUTPUTS, 60.0)
    settings = TrackingSettings(filter_name=name)
    for sensors in (live_scene.sensors(), bearing_scene.sensors()):
        purposes = track_purposes(settings, sensors, outputs)
        assert len(kernels_for(purposes)) > len(kernels_for([f"track {name}"])) > 15
        for wanted in (True, False):
            kernels_for(serve_purposes(settings, sensors, trajectories=wanted, asterix=wanted))


def test_an_output_that_is_not_wanted_adds_nothing() -> None:
    plain = track_purposes(IMM, live_scene.sensors(), {})
    assert plain == ["track imm"]
    assert track_purposes(IMM, live_scene.sensors(), dict.fromkeys(OUTPUTS)) == plain


def test_a_service_wants_what_it_is_configured_for() -> None:
    sensors = live_scene.sensors()
    plain = serve_purposes(IMM, sensors, trajectories=False, asterix=False)
    assert plain == ["track imm", "serve imm"]
    received = serve_purposes(IMM, sensors, trajectories=False, asterix=True)
    assert received == [*plain, "convert asterix"]
    bundles = serve_purposes(IMM, sensors, trajectories=True, asterix=False)
    tracked = track_purposes(IMM, sensors, {"--trajectories": True})
    assert bundles == [*tracked, "serve imm"] != plain


def test_direction_finders_add_kernels() -> None:
    assert track_purposes(IMM, bearing_scene.sensors(), {}) == ["track imm", "bearings imm"]


def test_shared_plots_add_kernels() -> None:
    shared = replace(IMM, association="probabilistic")
    purposes = track_purposes(shared, live_scene.sensors(), {})
    assert purposes == ["track imm", "track probabilistic imm"]
    assert len(kernels_for(purposes)) > len(kernels_for(["track imm"]))


def test_conversions_and_studies_are_listed() -> None:
    known = kernels_by_purpose()
    for form in ("vid", "asterix", "adsb"):
        assert known[f"convert {form}"]
    assert {f"study {name}" for name in STUDIES} <= set(known)


def test_the_longest_come_first_and_each_comes_once() -> None:
    both = kernels_for(["track two-stage", "track imm", "track two-stage"])
    seconds = [one.seconds for one in both]
    assert seconds == sorted(seconds, reverse=True)
    assert len(set(both)) == len(both)


def test_an_unknown_purpose_is_an_error() -> None:
    with pytest.raises(KeyError):
        kernels_for(["no such purpose"])
