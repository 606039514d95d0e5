"""Identities of a sensor that are other numbers: decimal codes, numbers of plots."""

import numpy as np
import polars as pl

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.names import counted
from multiradar.diagnosis.plots import KEYS, Plots

#: Fraction of the codes that have a digit which no octal number has, at least; a garbled code has
#: none. Decimal codes of all aircraft have one in half of the cases.
_NOT_OCTAL_MIN = 0.02
#: Greatest code.
_CODE_MAX = 0o7777
#: Numbers that differ from plot to plot are no track numbers: fraction of the plots with a number
#: of their own, at least, of so many plots, in more than this time, s (in one scan there is one
#: plot of each aircraft).
_OWN_MIN, _NUMBERED_MIN, _NUMBERED_S = 0.9, 100, 120.0


def check_decimal_codes(name: str, codes: pl.Series) -> Diagnosis | None:
    """Diagnose codes with the digits 8 and 9, which are rejected, beside others without them.

    Parameters
    ----------
    name : str
        The sensor.
    codes : (n,) Series of String
        Codes as recorded, also of rejected measurements.
    """
    known = codes.drop_nulls()
    numbers = known.filter(known.str.contains(r"^[0-9]{1,4}$"))
    wrong = int(numbers.str.contains("[89]").sum())
    if len(numbers) < len(known) or wrong < max(TESTED_MIN, _NOT_OCTAL_MIN * len(known)):
        return None
    if numbers.cast(pl.Int64).max() > _CODE_MAX:  # type: ignore[operator]  # of integers
        return None
    return Diagnosis(
        name,
        "codes",
        f"{name}: its Mode 3/A codes (mode_3a) are probably decimal numbers: "
        f"{wrong / len(known):.0%} have the digits 8 or 9, and none exceeds {_CODE_MAX}; write "
        "them as four octal digits",
    )


def check_plot_numbers(name: str, plots: Plots) -> Diagnosis | None:
    """Diagnose track numbers of which nearly every plot has another one.

    Parameters
    ----------
    name : str
        The sensor.
    plots : Plots
        Its plots.
    """
    numbers = plots.keys[:, KEYS.index("track_number")]
    known = numbers[numbers >= 0]
    if len(known) < _NUMBERED_MIN or np.ptp(plots.time_s[numbers >= 0]) <= _NUMBERED_S:
        return None
    _, counts = np.unique(known, return_counts=True)
    if np.count_nonzero(counts == 1) < _OWN_MIN * len(known):
        return None
    return Diagnosis(
        name,
        "track_numbers",
        f"{name}: its track numbers (track_number) are probably the numbers of its plots: "
        f"{counted(len(known))} plots have {counted(len(counts))} different numbers, so each "
        "plot initiates a track; write the number of the track, or leave track_number empty",
    )
