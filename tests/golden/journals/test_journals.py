"""Journals of earlier versions: read, and continued or carried over, without a difference.

Each folder is the state of a service of a version, written by `support.inputs.golden_journals`;
that of 0.2.0 by the code of its release (commit 41fd38ef), without an engine.
"""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from multiradar.errors import ConfigurationError
from multiradar.runtime.engine.fingerprint import OUTPUT_RULES
from multiradar.settings.service import load_settings
from multiradar.storage.backup import DATABASE
from multiradar.storage.snapshots import SnapshotFolder
from multiradar.storage.sqlite.journal_rows import FORMAT_VERSION
from multiradar.storage.sqlite.reading import journal_entries
from multiradar.storage.verification import verify_journal
from multiradar.toolbox.operation.migration import migrate
from multiradar_compiled.arithmetic_kernels import arithmetic
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile
from support.inputs.golden_journals import GOLDEN, METADATA, figures, service, unpack
from support.processes.live_services import settled, submit
from support.scenarios.live_scene import recording

KNOWN = {
    path.parent.name: json.loads(path.read_text(encoding="utf-8"))
    for path in sorted(GOLDEN.glob(f"*/{METADATA}"))
}
#: Those that this version continues; it carries the others over.
CONTINUED = [
    name
    for name, known in KNOWN.items()
    if (known["format"], known["rules"]) == (FORMAT_VERSION, OUTPUT_RULES)
]


def sensors_of(known: dict[str, Any]) -> SensorsFile:
    return SensorsFile(sensor=tuple(Sensor.model_validate(one) for one in known["sensor"]))


def test_one_is_of_this_format_and_these_rules() -> None:
    """If not: `python -m support.inputs.golden_journals VERSION` in `tests`, and commit it."""
    assert CONTINUED


@pytest.mark.parametrize("name", KNOWN)
def test_all_entries_are_read(name: str, tmp_path: Path) -> None:
    known = unpack(GOLDEN / name, tmp_path)
    with journal_entries(tmp_path / DATABASE) as (first, last, stored):
        entries = list(stored)
    assert (first, last) == (1, known["figures"]["journal_sequence"])
    assert [one.sequence for one in entries] == list(range(1, last + 1))
    assert entries[-1].digest.hex() == known["digest"]
    counted = [(one.entry.accepted, len(one.entry.rejects)) for one in entries if one.entry.payload]
    accepted, rejected = (sum(column) for column in zip(*counted, strict=True))
    assert (accepted, rejected) == (known["figures"]["accepted"], known["figures"]["rejected"])


@pytest.mark.parametrize("name", CONTINUED)
@pytest.mark.parametrize("snapshots", [True, False])
def test_a_journal_is_continued_with_the_same_output(
    name: str, snapshots: bool, tmp_path: Path
) -> None:
    known = unpack(GOLDEN / name, tmp_path)
    if known["arithmetic"] != arithmetic():
        pytest.skip("elementary functions of this processor are rounded in another way")
    found = verify_journal(tmp_path / DATABASE)
    assert (found.damage, found.digest) == ((), known["digest"])
    folder = SnapshotFolder(tmp_path / DATABASE)
    assert folder.files()
    if not snapshots:
        shutil.rmtree(folder.path)
    running = service(tmp_path, sensors_of(known))
    running.start()
    assert figures(running) == known["figures"]
    receipt = submit(running, recording(1, seed=2), "later")
    assert receipt.journal_sequence == known["figures"]["journal_sequence"] + 1
    settled(running)
    running.stop()


@pytest.mark.parametrize("name", sorted(set(KNOWN) - set(CONTINUED)))
def test_a_journal_of_another_format_or_other_rules_is_carried_over(
    name: str, tmp_path: Path
) -> None:
    state, new = tmp_path / "state", tmp_path / "new"
    state.mkdir()
    known = unpack(GOLDEN / name, state)
    running = service(state, sensors_of(known))
    with pytest.raises(ConfigurationError, match="multiradar migrate"):
        running.start()
    sensors = tmp_path / "sensors.toml"
    tables = [
        "\n".join(f"{field} = {json.dumps(value)}" for field, value in one.items())
        for one in known["sensor"]
    ]
    sensors.write_text("".join(f"[[sensor]]\n{table}\n" for table in tables), encoding="utf-8")
    done = migrate(state, new, load_settings(None, {"sensors": sensors}), lambda *_: {})
    assert done.entries == known["figures"]["journal_sequence"]
    assert done.accepted == done.accepted_before
    assert done.rejected_now == {}
    continued = service(new, sensors_of(known))
    continued.start()
    found = figures(continued)
    continued.stop()
    names = ("journal_sequence", "accepted", "rejected")
    assert {one: found[one] for one in names} == {one: known["figures"][one] for one in names}
    assert found["output_sequence"] > 0
