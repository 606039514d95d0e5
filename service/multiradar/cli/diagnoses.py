"""Diagnoses as commands print them."""

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from multiradar.diagnosis.diagnosis import Diagnosis


def print_diagnoses(diagnoses: "Sequence[Diagnosis]") -> None:
    """Print each diagnosis as one sentence on standard error."""
    for one in diagnoses:
        print(f"multiradar: {one.sentence}", file=sys.stderr)


def fail_when_diagnosed(diagnoses: "Sequence[Diagnosis]") -> None:
    """Print the diagnoses and end with status 1 where there are some; results are kept.

    Raises
    ------
    Exit
        There is a diagnosis.
    """
    print_diagnoses(diagnoses)
    if diagnoses:
        raise typer.Exit(1)
