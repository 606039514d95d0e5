"""Types of arguments as text and back."""

import importlib
import inspect
from typing import Any

import numba
import numpy as np
import pytest

from multiradar.estimation.filters.arrays import Work
from multiradar_compiled.kernel_list import kernels_by_purpose
from multiradar_compiled.signatures import describe, parse

NUMBA: Any = numba
READ_ONLY = np.zeros(2)
READ_ONLY.flags.writeable = False


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1, "int64"),
        (1.5, "float64"),
        (True, "bool"),
        (None, "none"),
        (np.uint8(1), "uint8"),
        (np.zeros((2, 3)), "float64[2C]"),
        (np.zeros((2, 3)).T, "float64[2F]"),
        (np.zeros((4, 3), np.int32)[::2], "int32[2A]"),
        (np.zeros(2, np.bool_), "bool[1C]"),
        (READ_ONLY, "float64[1C]!"),
        ((1, 2.5), "(int64 float64)"),
        (
            Work(np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros(1, np.int64)),
            "multiradar.estimation.filters.arrays:Work{int64[1C] int64[1C] int64[1C]}",
        ),
    ],
)
def test_a_type_has_a_text_and_a_text_has_that_type(value: object, text: str) -> None:
    assert describe(NUMBA.typeof(value)) == text
    assert parse(text) == NUMBA.typeof(value)


def test_every_type_of_the_list_is_read_and_written_alike() -> None:
    texts = {text for one in kernels_by_purpose().values() for w in one for text in w.arguments}
    assert len(texts) > 20
    for text in texts:
        assert describe(parse(text)) == text


@pytest.mark.parametrize("argument", [NUMBA.typeof("text"), NUMBA.typeof(1j)])
def test_other_types_are_rejected_by_name(argument: object) -> None:
    with pytest.raises(TypeError, match=r"expected a type of numbers, arrays and tuples, was"):
        describe(argument)


def test_a_named_tuple_with_a_number_of_fields_of_the_past_is_rejected() -> None:
    name = "multiradar.estimation.filters.arrays:Work"
    with pytest.raises(ValueError, match=f"expected 3 fields of {name}, was 2"):
        parse(f"({name}{{int64[1C] int64[1C]}} int64)")


@pytest.mark.parametrize(
    "text", ["", "float128", "float64[2C", "(int64", "int64 int64", "datetime64[1C]", "nosuch:X{}"]
)
def test_an_invalid_text_is_rejected(text: str) -> None:
    with pytest.raises((ValueError, ModuleNotFoundError, AttributeError)):
        parse(text)


def test_every_listed_kernel_has_as_many_arguments_as_are_listed() -> None:
    # Otherwise each start of a command tries to compile it and fails.
    wrong = {}
    for listed in kernels_by_purpose().values():
        for one in listed:
            module, name = one.kernel.split(":")
            kernel = getattr(importlib.import_module(module), name)
            parameters = len(inspect.signature(getattr(kernel, "py_func", kernel)).parameters)
            if parameters != len(one.arguments):
                wrong[one.kernel] = parameters
    assert wrong == {}, "run make kernel-list"
