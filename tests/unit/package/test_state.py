"""State of objects: every declared type comes back as it was, and nothing else is stored."""

from collections import Counter, OrderedDict, deque
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import StateError
from multiradar.state import (
    EncodedState,
    Fields,
    copied_state,
    encoded_state,
    layout_of,
    restore_state,
)

ROWS = np.array([(1, 2.5), (3, np.nan)], [("number", np.int64), ("time_s", np.float64)])


class Pair(NamedTuple):
    """A named tuple with an array."""

    values: NDArray[np.float64]
    number: int


@dataclass(frozen=True, slots=True)
class Table:
    """A dataclass with an optional field."""

    name: str
    other: Pair | None = None


class Part:
    """Part of a holder."""

    STATE: ClassVar[Fields] = {"seen": dict[int, np.ndarray]}

    def __init__(self) -> None:
        self.seen: dict[int, Any] = {}


class Holder:
    """An object with a field of each type."""

    STATE: ClassVar[Fields] = {
        "part": Part,
        "numbers": tuple[int, float, bool],
        "octets": bytes,
        "rows": np.ndarray,
        "tables": list[Table],
        "last": deque[tuple[float, np.ndarray]],
        "names": set[str],
        "counts": Counter[str],
        "waiting": OrderedDict[tuple[int, int], list[Pair]],
        "nothing": float | None,
        "parts": dict[str, Part],
    }

    def __init__(self) -> None:
        self.part = Part()
        self.numbers = (0, 0.0, False)
        self.octets = b""
        self.rows = ROWS[:0]
        self.tables: list[Table] = []
        self.last: deque[tuple[float, Any]] = deque(maxlen=2)
        self.names: set[str] = set()
        self.counts: Counter[str] = Counter()
        self.waiting: OrderedDict[tuple[int, int], list[Pair]] = OrderedDict()
        self.nothing: float | None = 1.0
        self.parts: dict[str, Part] = {}
        self.given = "by its parameters"
        self.times_restored = 0

    def restored(self) -> None:
        """Count."""
        self.times_restored += 1


def filled() -> Holder:
    """Return a holder with content."""
    holder = Holder()
    holder.part.seen = {7: np.arange(6.0).reshape(2, 3).T, 3: np.array([True])}
    holder.numbers = (2**62, float("-inf"), True)
    holder.octets, holder.rows = b"\x00\xff", ROWS.copy()
    holder.tables = [Table("ä", Pair(np.array([0.1]), 4)), Table("b")]
    holder.last.extend([(1.0, np.zeros(1)), (2.0, np.ones(2)), (3.0, np.ones(3))])
    holder.names, holder.counts = {"z", "a"}, Counter(x=2)
    holder.waiting[2, 1] = [Pair(np.empty((0, 2)), 1)]
    holder.waiting[1, 1] = []
    holder.nothing = None
    holder.parts["east"] = Part()
    holder.parts["east"].seen[1] = np.ones(2)
    return holder


def shown(holder: Holder) -> tuple[Any, list[tuple[str, bytes]]]:
    """Return a state in a form that can be compared."""
    document, arrays = encoded_state(copied_state(holder))
    return document, [(f"{one.dtype}{one.shape}", one.tobytes()) for one in arrays]


def test_each_type_comes_back_as_it_was() -> None:
    holder, again = filled(), Holder()
    restore_state(again, encoded_state(copied_state(holder)))
    assert shown(again) == shown(holder)
    assert again.last.maxlen == 2
    assert (list(again.waiting), again.counts, again.names) == (
        [(2, 1), (1, 1)], holder.counts, {"a", "z"},
    )  # fmt: skip
    assert type(again.tables[0].other) is Pair
    assert again.times_restored == 1


def test_a_copy_does_not_see_later_changes() -> None:
    holder = filled()
    before = shown(holder)
    copy = copied_state(holder)
    holder.part.seen[7][:] = -1.0
    holder.rows["number"] = 0
    holder.last.clear()
    holder.tables.append(Table("c"))
    holder.counts["x"] = 9
    document, arrays = encoded_state(copy)
    assert (document, [one.tobytes() for one in arrays]) == (
        before[0], [octets for _, octets in before[1]],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "value"),
    [("numbers", (1.5, 0.0, False)), ("octets", "text"), ("rows", np.array([object()]))],
)
def test_a_value_of_another_type_is_not_stored(name: str, value: object) -> None:
    holder = filled()
    setattr(holder, name, value)
    with pytest.raises(StateError, match=rf"Holder\.{name}: expected"):
        encoded_state(copied_state(holder))


def test_a_state_of_another_class_is_not_restored() -> None:
    state = encoded_state(copied_state(filled()))
    with pytest.raises(StateError, match="Part: the state does not match"):
        restore_state(Part(), state)
    with pytest.raises(StateError, match="Holder: the state does not match"):
        restore_state(Holder(), EncodedState(state.document, state.arrays[:-1]))


def test_the_layout_names_all_fields_and_their_types() -> None:
    layout = layout_of(Holder)
    assert "nothing=float | None" in layout
    assert "Part: seen=" in layout
    assert "Pair: values=" in layout
