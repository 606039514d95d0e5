"""The rules of `multiradar shorten`, from the section `retention` of the settings."""

from typing import Any

import pytest

from multiradar.errors import ConfigurationError
from multiradar.settings.service import load_settings
from multiradar.storage.retention import Rules
from multiradar.toolbox.operation import shortening

_MODULE: Any = shortening


def test_days_are_seconds_and_octets_stay() -> None:
    given = {
        "journal_days": 2, "journal_octets": 10**9, "archive_days": 30, "archive_octets": 2 * 10**9,
        "recording_days": 7,
    }  # fmt: skip
    found = _MODULE._rules(load_settings(None, {"retention": given}))
    assert found == Rules(172_800.0, 10**9, 2_592_000.0, 2 * 10**9, 604_800.0)


def test_a_rule_of_the_archive_alone_shortens_no_journal() -> None:
    with pytest.raises(ConfigurationError, match="no rule for the journal"):
        _MODULE._rules(load_settings(None, {"retention": {"archive_days": 30}}))
