"""Names that are repeated on the command line, so that help is fast, are those of the core."""

from multiradar.cli.options import KIND_CHOICES, FilterChoice, chosen_kinds
from multiradar.cli.replay import _BATCH_ROWS_MAX, EncodingChoice
from multiradar.cli.serve import LogForm, LogLevel
from multiradar.estimation.filters.bank import FILTERS
from multiradar.ingest.replay import RETRIES_MAX, ReplayPlan
from multiradar.ingest.replay_http import Encoding
from multiradar.settings import load_settings
from multiradar.storage.recording import BLOCK_ROWS
from multiradar_schemas.measurement import KINDS


def test_the_choices_are_those_of_the_core() -> None:
    assert {choice.value for choice in FilterChoice} == set(FILTERS)
    assert set(KIND_CHOICES) == set(KINDS)
    assert {choice.value for choice in EncodingChoice} == {one.value for one in Encoding}
    assert BLOCK_ROWS == _BATCH_ROWS_MAX
    assert ReplayPlan().retries_max == RETRIES_MAX == 50


def test_every_log_option_is_a_setting() -> None:
    for level in LogLevel:
        for form in LogForm:
            log = load_settings(None, {"log": {"level": level.value, "form": form.value}}).log
            assert (log.level, log.form) == (level.value, form.value)


def test_kinds_are_separated_by_commas() -> None:
    assert chosen_kinds(None) is None
    assert chosen_kinds("radar, adsb") == frozenset({"radar", "adsb"})
