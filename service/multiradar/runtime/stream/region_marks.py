"""What subscribers get of a track about neighbouring regions."""

import json
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

#: Octets of a reference: name of a region of at most 16, a slash, a number of at most 18.
REFERENCE_OCTETS = 35
#: Marks of a track update: whether this region is responsible; else the responsible track of a
#: neighbour; and the track whose number the aircraft has, if it is of another region.
MARK_DTYPE = np.dtype(
    [
        ("responsible", np.bool_),
        ("duplicate_of", f"S{REFERENCE_OCTETS}"),
        ("continues", f"S{REFERENCE_OCTETS}"),
    ]
)
#: The fields of a track that are added to those of `tracks.parquet`.
FIELDS = ("region", "responsible", "duplicate_of", "continues")


class RegionMarks(NamedTuple):
    """Name of the region, and rows of `MARK_DTYPE`."""

    region: str
    rows: NDArray[np.void]


def reference(region: str, track_id: int) -> bytes:
    """Return the reference to a track of a region."""
    return f"{region}/{track_id}".encode()


def mark_texts(region: str, marks: NDArray[np.void]) -> Iterator[str]:
    """Yield the fields of each row as members of a JSON object, with a comma before them.

    Parameters
    ----------
    region : str
        Name of this region.
    marks : (n,) ndarray of `MARK_DTYPE`
        Marks.
    """
    name = json.dumps(region)
    for responsible, duplicate_of, continues in marks.tolist():
        yield (
            f',"region":{name},"responsible":{"true" if responsible else "false"},'
            f'"duplicate_of":{_text(duplicate_of)},"continues":{_text(continues)}'
        )


def _text(value: bytes) -> str:
    return f'"{value.decode()}"' if value else "null"
