"""Diagnoses as warnings and findings."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from multiradar.errors import DataWarning
from multiradar.toolbox.warning import warn

if TYPE_CHECKING:
    from multiradar.diagnosis.diagnosis import Diagnosis


def findings_of(diagnoses: "Iterable[Diagnosis]") -> list[str]:
    """Warn of what leaves the output usable, and return the sentences of errors.

    Parameters
    ----------
    diagnoses : iterable of Diagnosis
        All of them.

    Returns
    -------
    list of str
        For a `FindingsError`.
    """
    errors = []
    for one in diagnoses:
        if one.severity == "error":
            errors.append(one.sentence)
        else:
            warn(one.sentence, DataWarning)
    return errors
