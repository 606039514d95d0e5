"""The reference of an evaluation, and what belongs to it."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import polars as pl

if TYPE_CHECKING:
    from multiradar.evaluation.trajectories import Reference


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """The reference and what belongs to it.

    Attributes
    ----------
    kind : str
        truth, recorded, adsb, smoothed or system-tracks.
    path : Path
        As it was given.
    reference : Reference
        Positions of the aircraft.
    plots : DataFrame
        `time_s`, `sensor_id` and `name` (of the aircraft, null where unknown) of the plots.
    true_biases : (DataFrame, str), optional
        The true biases, and their name in error messages.
    claimed : dict of str to float or str
        Inputs and reported accuracy of an estimated reference.
    reporters : tuple of str
        Sensors whose reports are the reference.
    findings : tuple of str
        What is wrong with the measurements that it was computed from.
    """

    kind: str
    path: Path
    reference: "Reference"
    plots: pl.DataFrame
    true_biases: tuple[pl.DataFrame, str] | None = None
    claimed: dict[str, float | str] = field(default_factory=dict)
    reporters: tuple[str, ...] = ()
    findings: tuple[str, ...] = ()
