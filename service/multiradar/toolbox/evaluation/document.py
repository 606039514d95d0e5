"""The scorecard as a document: its summary, command, tables and plots."""

import dataclasses
import re
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from multiradar.evaluation.scorecard import Scorecard
    from multiradar.report.content import Document

#: Number of aircraft in the terminal; the report has all.
_WORST = 8
#: Part of the names of settings that options omit.
_UNIT = re.compile(r"(_max)?_(m|s)$")
_REFERENCES = {
    "truth": "the truth of a simulation",
    "recorded": "the ADS-B reports of the dump",
    "adsb": "ADS-B reports",
    "smoothed": "all measurements, smoothed",
    "system-tracks": "the system tracks of another processor",
}


def scorecard_document(tracks: Path, card: "Scorecard", figures: Any, *, whole: bool) -> "Document":
    """Return the scorecard for readers: in the terminal, or the whole of it for a page."""
    from multiradar.evaluation.card.plots import card_plots
    from multiradar.evaluation.card.tables import (
        aircraft_table,
        card_tables,
        notes_of,
        preset_table,
        rejects_tables,
    )
    from multiradar.report.content import Document

    compared, reference = figures["compared"], figures["reference"]
    summary = (
        f"{_headline(compared)} with {compared['updates']} updates, compared with "
        f"{_REFERENCES[reference['kind']]}: {compared['aircraft']} aircraft with "
        f"{compared['reference_positions']} positions over {compared['duration_s']:.0f} s; "
        f"{compared['updates_compared']} updates compared."
    )
    most = None if whole else _WORST
    return Document(
        title="Track scorecard",
        summary=summary,
        command=_command(tracks, figures),
        tables=[
            preset_table(figures),
            *card_tables(figures),
            aircraft_table(figures, most),
            *rejects_tables(figures, most),
        ],
        plots=card_plots(card) if whole else [],
        notes=notes_of(card, figures),
    )


def _headline(compared: Any) -> str:
    text = f"{compared['tracks_confirmed']} confirmed tracks"
    return f"{text} ({compared['tracks_initiated']} initiated)"


# Only options that differ from the defaults.
def _command(tracks: Path, figures: Any) -> str:
    from multiradar.evaluation.presets import PRESETS
    from multiradar.evaluation.settings import EvaluationSettings

    reference = figures["reference"]
    option = "truth" if reference["kind"] == "recorded" else reference["kind"]
    parts = ["multiradar", "evaluate", str(tracks), f"--{option}", reference["path"]]
    for name in ("truth", "processor", "sensors", "measurements"):
        if name in reference:
            parts += [flag_of(name), reference[name]]
    evaluated = dict.fromkeys(one["preset"] for one in figures["presets"])
    if len(evaluated) < len(PRESETS):
        parts += [part for one in evaluated for part in ("--preset", one)]
    if reference.get("smoother") == "imm":
        parts += ["--smoother", "imm"]
    for name, value in dataclasses.asdict(EvaluationSettings()).items():
        given = figures["settings"][name]
        if given != value:
            parts += [flag_of(name)] if given is True else [flag_of(name), f"{given:g}"]
    return shlex.join(parts)


def flag_of(name: str) -> str:
    """Return the option of a setting."""
    return f"--{_UNIT.sub('', name).replace('_', '-')}"
