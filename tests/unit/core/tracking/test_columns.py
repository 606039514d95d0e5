"""Types of the columns of a table."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from typing_extensions import TypeAliasType, TypeVar

from multiradar.tracking import columns

Scalar = TypeVar("Scalar", bound=np.generic)
_PARAMETERS: Any = (Scalar,)
#: The form that `NDArray` has from numpy 2.5 on.
Alias: Any = TypeAliasType("Alias", np.ndarray[Any, np.dtype[Scalar]], type_params=_PARAMETERS)


@pytest.mark.parametrize("array", [NDArray, Alias])
def test_columns_have_the_declared_types_in_every_form_of_numpy(
    array: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(columns, "NDArray", array)

    @dataclass
    class Table:
        time_s: array[np.float64]
        sensor: array[np.int32]
        name: str
        accuracy_m: array[np.float64] | None

    expected: dict[str, type[Any]] = {"time_s": np.float64, "sensor": np.int32}
    assert columns.column_types(Table) == expected
