"""Diagnoses as commands print them."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from multiradar.diagnosis.diagnosis import Diagnosis
    from multiradar_schemas.sensors.sensor import SensorsFile


def print_diagnoses(diagnoses: "Sequence[Diagnosis]") -> None:
    """Print each diagnosis as one sentence on standard error."""
    for one in diagnoses:
        print(f"multiradar: {one.sentence}", file=sys.stderr)


def fail_when_diagnosed(diagnoses: "Sequence[Diagnosis]") -> None:
    """Print the diagnoses and exit with status 1 if there are any; results are kept.

    Raises
    ------
    Exit
        There is a diagnosis.
    """
    print_diagnoses(diagnoses)
    if diagnoses:
        raise typer.Exit(1)


def fail_when_badly_converted(
    report: Mapping[str, Any], out: Path, sensors: "SensorsFile | None" = None
) -> None:
    """Diagnose a conversion; print errors and exit with status 1. Its output is kept.

    Parameters
    ----------
    report : mapping
        The report of the conversion.
    out : Path
        The folder that was written.
    sensors : SensorsFile, optional
        The sensors given for it.

    Raises
    ------
    Exit
        There is a diagnosis.
    """
    # Imported here: help must be fast.
    from multiradar import wire
    from multiradar.diagnosis.conversion import diagnose_conversion
    from multiradar.storage.recording import MEASUREMENTS_FILE

    table = None if sensors is None else wire.sensor_table(sensors)
    fail_when_diagnosed(diagnose_conversion(out / MEASUREMENTS_FILE, report, table))
