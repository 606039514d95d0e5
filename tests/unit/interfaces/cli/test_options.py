"""Names repeated in the command line modules, so that help is fast, are those of the core."""

import re

import pytest

from multiradar.cli.main import run
from multiradar.cli.options import (
    KIND_CHOICES,
    FilterChoice,
    chosen_kinds,
    hidden_fields,
    parse_hidden,
    parse_kinds,
)
from multiradar.cli.playback.replay import _BATCH_ROWS_MAX, EncodingChoice
from multiradar.cli.serve import LogForm, LogLevel
from multiradar.estimation.filters.bank import FILTERS
from multiradar.ingest.replay.http import Encoding
from multiradar.ingest.replay.replaying import AWAY_MAX_S, ReplayPlan
from multiradar.settings.service import load_settings
from multiradar.storage.recording import BLOCK_ROWS
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.measurements.measurement import KINDS


def test_the_choices_are_those_of_the_core() -> None:
    assert {choice.value for choice in FilterChoice} == set(FILTERS)
    assert set(KIND_CHOICES) == set(KINDS)
    assert {choice.value for choice in EncodingChoice} == {one.value for one in Encoding}
    assert BLOCK_ROWS == _BATCH_ROWS_MAX
    assert ReplayPlan().away_max_s == AWAY_MAX_S == 120.0


def test_the_defaults_that_help_shows_are_those_of_the_tracker(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "250")
    assert run(["track", "--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    defaults = TrackingSettings()
    for option in ("epoch_s", "reorder_horizon_s", "acceleration_density"):
        flag = f"--{option.replace('_', '-')} "
        output = [line for line in lines if flag in line]
        assert len(output) == 1
        assert f"[default: ({getattr(defaults, option):g})]" in output[0]
    assert any(f"[default: ({defaults.filter_name})]" in line for line in lines)


@pytest.mark.parametrize(
    "option",
    ["manoeuvre-planes", "observability", "encounters", "trajectories", "forecasts", "asterix"],
)
def test_help_gives_the_cost_of_what_is_expensive(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], option: str
) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    assert run(["track", "--help"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if f" --{option} " in line]
    assert len(lines) == 1
    assert re.search(r"Costs [\d.]+ ms of CPU time per plot", lines[0])


def test_every_log_option_is_a_setting() -> None:
    for level in LogLevel:
        for form in LogForm:
            log = load_settings(None, {"log": {"level": level.value, "form": form.value}}).log
            assert (log.level, log.form) == (level.value, form.value)


def test_kinds_are_separated_by_commas() -> None:
    assert chosen_kinds(None) is None
    assert chosen_kinds("radar, adsb") == frozenset({"radar", "adsb"})


def test_hidden_fields_come_in_one_order_and_once() -> None:
    assert hidden_fields("mode_3a, track_number,mode_3a") == ("track_number", "mode_3a")


def test_checked_lists_are_kept_as_they_are() -> None:
    for text in ("mode_3a, track_number", "callsign"):
        assert parse_hidden(text) == text
    for text in ("radar, adsb", "bearing"):
        assert parse_kinds(text) == text


def test_a_field_that_cannot_be_hidden_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    line = ["track", "here", "--sensors", "s.toml", "--out", "o", "--hide", "track_number,height_m"]
    assert run(line) == 2
    output = capsys.readouterr().err
    assert (
        "unknown field 'height_m'; known: track_number, mode_3a, mode_s_address, callsign" in output
    )
    assert "height_m" in output
