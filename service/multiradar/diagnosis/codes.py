"""Mode 3/A codes of a sensor that are not those of the tracks that it updates."""

from collections.abc import Callable

import numpy as np
import polars as pl

from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.names import listed
from multiradar.diagnosis.plots import CONSPICUITY

#: Codes of a sensor are those of other aircraft if at most this fraction of the tracks that it has
#: in common with each other sensor has the same code; such tracks, and plots with a code in each.
CODES_EQUAL_MAX, CODES_TRACKS_MIN, CODES_PLOTS_MIN = 0.25, 8, 3
#: Transformations of codes, octal digits, with what is wrong.
_CODE_FORMS: dict[str, Callable[[str], str]] = {
    "decimal instead of octal numbers": lambda code: str(int(code, 8)).zfill(4),
    "hexadecimal instead of octal numbers": lambda code: f"{int(code, 8):04x}",
    "digits in reverse order (D, C, B, A)": lambda code: code[::-1],
    "digits in the order A, C, B, D": lambda code: code[0] + code[2] + code[1] + code[3],
}


def check_codes(evidence: Evidence) -> list[Diagnosis]:
    """Diagnose Mode 3/A codes of a sensor that differ from those of others for the same tracks.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    """
    codes = _codes_of_tracks(evidence)
    pairs = codes.join(codes, on="track", suffix="_other").filter(
        pl.col("sensor") != pl.col("sensor_other"),
        ~pl.col("code_other").is_in(CONSPICUITY),
    )
    equal = (pl.col("code") == pl.col("code_other")).mean().alias("equal")
    shares = (
        pairs.group_by("sensor", "sensor_other")
        .agg(equal, pl.len().alias("tracks"))
        .filter(pl.col("tracks") >= CODES_TRACKS_MIN)
    )
    best = shares.group_by("sensor").agg(pl.col("equal").max(), pl.col("tracks").max())
    wrong = best.filter(pl.col("equal") <= CODES_EQUAL_MAX).sort("sensor")
    right = best.filter(pl.col("equal") > 1.0 - CODES_EQUAL_MAX)
    names = [evidence.sensors.ids[one] for one in wrong["sensor"].to_list()]
    if not names or (right.is_empty() and len(names) > 2):
        return []
    if right.is_empty():
        tracks = int(wrong["tracks"].max())  # type: ignore[arg-type]  # of a column of integers
        return [_codes_differ(names[0], f"those of {listed(names[1:])}", tracks, "")]
    found = []
    for name, number, tracks in zip(names, wrong["sensor"], wrong["tracks"], strict=True):
        own = pairs.filter(
            pl.col("sensor") == number, pl.col("sensor_other").is_in(right["sensor"].to_list())
        )
        found.append(_codes_differ(name, "those of the other sensors", tracks, _code_form(own)))
    return found


def _codes_differ(name: str, of: str, tracks: int, why: str) -> Diagnosis:
    cause = why or "the codes of one of them belong to other rows or are in another form"
    return Diagnosis(
        name,
        "codes",
        f"{name}: its Mode 3/A codes (mode_3a) differ from {of} for nearly all of {tracks} common "
        f"tracks: {cause}; correct the column, or leave it empty",
    )


# The code of most plots of each sensor in each track.
def _codes_of_tracks(evidence: Evidence) -> pl.DataFrame:
    plots = evidence.tracked()
    columns = {
        "track": plots.track_id,
        "sensor": plots.measured.sensor,
        "code": plots.measured.mode_3a,
    }
    return (
        pl.DataFrame(columns)
        .filter(pl.col("code") >= 0)
        .group_by("track", "sensor")
        .agg(pl.col("code").mode().min(), pl.len().alias("plots"))
        .filter(pl.col("plots") >= CODES_PLOTS_MIN)
        .select("track", "sensor", pl.col("code").cast(pl.Int64))
    )


def _code_form(pairs: pl.DataFrame) -> str:
    own = [f"{code:04o}" for code in pairs["code"].to_list()]
    others = [f"{code:04o}" for code in pairs["code_other"].to_list()]
    for what, form in _CODE_FORMS.items():
        same = sum(form(other) == one for one, other in zip(own, others, strict=True))
        if same > 0.5 * len(own):
            return f"probably {what}"
    if len(set(own)) == 1:
        return f"all are {own[0]}"
    if np.isin(own, others).mean() > 0.5:
        return "they are codes of other aircraft, and probably belong to other rows"
    return "they are probably in another form"
