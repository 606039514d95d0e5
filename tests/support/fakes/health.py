"""Records of radar health with the columns given by a test."""

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from multiradar.tracking.health.health_records import HealthRecords

_NUMBERS = {"epoch", "sensor", "tracks_in_cover", "tracks_heard", "jumps", "alarms"}


def health_records(**given: Sequence[float]) -> HealthRecords:
    """Return records with these columns; the others are 0, or not known."""
    count = len(next(iter(given.values())))
    empty = HealthRecords.concatenate([])
    columns = {
        field.name: np.full(count, 0 if field.name in _NUMBERS else np.nan)
        for field in fields(HealthRecords)
    }
    columns |= {name: np.asarray(values) for name, values in given.items()}
    columns["looks"] = np.nan_to_num(columns["looks"])
    return HealthRecords(
        **{name: values.astype(getattr(empty, name).dtype) for name, values in columns.items()}
    )
