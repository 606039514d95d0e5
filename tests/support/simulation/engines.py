"""An engine that fails on request: once, or always with a certain measurement."""

from collections.abc import Callable
from typing import Any, ClassVar

from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.state import Fields
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import EngineOutput

#: Height of a measurement with which a poisoned engine fails, m.
POISON_HEIGHT_M = 7777.25


class Tampering:
    """What goes wrong in the engines of a run."""

    def __init__(self) -> None:
        #: The next call raises this once.
        self.error: Exception | None = None
        #: Whether a call has raised it, since the process was started.
        self.raised = False
        #: Called then.
        self.on_error: Callable[[], None] = lambda: None
        #: Measurements of the poison height raise always.
        self.poisoned = False
        #: Called when they do.
        self.on_poison: Callable[[], None] = lambda: None


class Tampered:
    """An engine and its faults."""

    STATE: ClassVar[Fields] = {"_engine": Engine}

    def __init__(self, engine: Engine, tampering: Tampering) -> None:
        self._engine = engine
        self._tampering = tampering

    def push(self, batch: MeasurementBatch, clock_s: float | None = None) -> EngineOutput:
        """Process measurements, or fail."""
        error, self._tampering.error = self._tampering.error, None
        if error is not None:
            self._tampering.raised = True
            self._tampering.on_error()
            raise error
        if self._tampering.poisoned and (batch.height_m == POISON_HEIGHT_M).any():
            self._tampering.on_poison()
            raise ArithmeticError("poison")
        return self._engine.push(batch, clock_s)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._engine, name)
