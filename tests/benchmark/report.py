"""Rows of benchmark.json."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path


@dataclass(frozen=True)
class Row:
    """One figure, and what it is compared with in the same run."""

    name: str
    value: float
    unit: str
    peer: str | None = None
    peer_value: float | None = None

    @property
    def ratio(self) -> float | None:
        """The figure over its peer's."""
        return None if self.peer_value is None else self.value / self.peer_value


def write(path: Path, rows: list[Row]) -> None:
    """Write all rows as a JSON array."""
    path.write_text(
        json.dumps([asdict(row) | {"ratio": row.ratio} for row in rows], indent=1) + "\n"
    )


def show(rows: list[Row]) -> None:
    """Print one line a row."""
    for row in rows:
        ratio = "" if row.ratio is None else f"   {row.ratio:9.4f} of {row.peer}"
        print(f"{row.name:58} {row.value:12.4g} {row.unit:16}{ratio}", flush=True)
