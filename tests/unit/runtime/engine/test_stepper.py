"""Rows of excluded tracks do not contribute to the biases; all others are logged."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from multiradar.runtime.engine.stepper import Stepper

ROWS = 6


@pytest.mark.parametrize("corrects_biases", [False, True])
@pytest.mark.parametrize("excluded", [[], [1, 4], [*range(ROWS)]], ids=["none", "some", "all"])
def test_rows_that_contribute_are_logged_in_order(
    excluded: list[int], *, corrects_biases: bool
) -> None:
    stepped: list[tuple[list[int], str]] = []
    logged: list[tuple[list[float], list[int]]] = []
    steps = SimpleNamespace(
        step=lambda work, _rows, _model, result: stepped.append((work, result.sums))
    )
    pool = SimpleNamespace(
        bias_excluded=lambda slots: np.isin(slots, excluded),
        work=lambda _slots, which: (None, which.tolist()),
    )
    biases = SimpleNamespace(
        model=None,
        log=lambda log, sensors: logged.append((log[:, 0].tolist(), sensors.tolist())),
        without_bias_sums=lambda result: SimpleNamespace(log=result.log, sums="discarded"),
    )
    stepper: Any = Stepper(
        SimpleNamespace(corrects_biases=corrects_biases),  # type: ignore[arg-type]
        pool,  # type: ignore[arg-type]
        biases,  # type: ignore[arg-type]
        1,
        open_steps=lambda *_: steps,
    )
    rows = SimpleNamespace(slot=np.arange(ROWS), sensor=10 + np.arange(ROWS))
    result = SimpleNamespace(log=np.arange(float(ROWS))[:, None], sums="own")
    stepper.step(rows, result, (0, ROWS), None)
    left_out = [] if corrects_biases else excluded
    kept = [one for one in range(ROWS) if one not in left_out]
    assert logged == [([float(one) for one in kept], [10 + one for one in kept])]
    assert stepped == [one for one in [(kept, "own"), (left_out, "discarded")] if one[0]]
