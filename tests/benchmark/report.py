"""Rows of benchmark.json, of the terminal and of docs/validation/benchmarks.md."""

import json
import os
import platform
import textwrap
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

#: Width of the paragraphs of the document.
COLUMNS = 118


@dataclass(frozen=True)
class Row:
    """One figure, and its reference in the same run.

    Attributes
    ----------
    name, unit : str
        What was measured.
    value : float
        The median of the runs, unless the name says otherwise.
    runs : int
        How many runs.
    peer : str, optional
        What else was measured.
    peer_value : float, optional
        Its value, in the same unit.
    """

    name: str
    value: float
    unit: str
    runs: int
    peer: str | None = None
    peer_value: float | None = None

    @property
    def ratio(self) -> float | None:
        """The figure over its peer's."""
        return None if self.peer_value is None else self.value / self.peer_value


def write(path: Path, suites: dict[str, list[Row]]) -> None:
    """Write all rows as a JSON array."""
    documents = [
        {"suite": suite} | asdict(row) | {"ratio": row.ratio}
        for suite, rows in suites.items()
        for row in rows
    ]
    path.write_text(json.dumps(documents, indent=1) + "\n", encoding="utf-8")


def show(rows: Sequence[Row]) -> None:
    """Print one line per row."""
    for row in rows:
        beside = "" if row.ratio is None else f"   {_digits(row.ratio):>8} × {row.peer}"
        print(f"{row.name:62} {_digits(row.value):>10} {row.unit:15}{beside}", flush=True)


def write_markdown(
    path: Path,
    suites: dict[str, list[Row]],
    texts: dict[str, str],
    command: str,
    load_before: float,
) -> None:
    """Write the document: a table for each suite with its description."""
    made = (
        "After this page you know the speed of the parts of multiradar, and their ratio to a peer. "
        f"Made by `{command}` on {os.cpu_count()} cores ({platform.machine()}, "
        f"{platform.system()}, Python {platform.python_version()}). Load average {load_before:.1f} "
        f"before, {os.getloadavg()[0]:.1f} at the end, including the benchmarks. "
        "Everything runs on loopback and ends by itself.\n\n"
        "Figures are medians of the runs. They depend on the machine and its load; the ratio to "
        "the peer, measured in the same run, depends on them far less. *Ratio* is the figure over "
        "that of the peer: above 1 is better for a rate, below 1 for a time."
    )
    lines = ["# Benchmarks", "", _wrapped(made)]
    for suite, rows in suites.items():
        lines += ["", f"## {suite.capitalize()}", "", _wrapped(texts[suite]), ""]
        lines += ["| What | Figure | Unit | Runs | Peer | Peer's figure | Ratio |"]
        lines += ["|---|---:|---|---:|---|---:|---:|"]
        lines += [_markdown_row(row) for row in rows]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _wrapped(text: str) -> str:
    return "\n\n".join(
        textwrap.fill(one, COLUMNS, break_long_words=False, break_on_hyphens=False)
        for one in text.split("\n\n")
    )


def _markdown_row(row: Row) -> str:
    head = f"| {row.name} | {_digits(row.value)} | {row.unit} | {row.runs} |"
    if row.ratio is None or row.peer_value is None:
        return f"{head} | | |"
    return f"{head} {row.peer} | {_digits(row.peer_value)} | {_digits(row.ratio)} |"


def _digits(value: float) -> str:
    """Write three significant digits, without an exponent."""
    if value == 0.0:
        return "0"
    text = f"{float(f'{value:.3g}'):,.6f}".rstrip("0").rstrip(".")
    return text.replace(",", " ")
