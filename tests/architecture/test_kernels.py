"""Functions compiled without reference counting create no arrays, which would be freed."""

import ast
import re
import tomllib
from typing import Any

import pytest

from architecture.test_sources import modules, nodes, text, tree, walk
from multiradar.estimation.filters._step_kernels import step
from support.paths import ROOT

UNCOUNTED = {"loop", "inner_loop", "in_loop"}
ARRAY_MAKERS = re.compile(
    r"(empty|zeros|ones|full)(_like)?|eye|identity|array|arange|linspace|diag|outer|dot|copy"
    r"|concatenate|\w*stack|where|cumsum|(arg)?sort|flatnonzero|nonzero|astype|reshape|ravel"
)
#: Numbers, and tuples of them.
SCALARS = {
    "int",
    "float",
    "bool",
    "None",
    "np.int64",
    "np.uint64",
    "Triple",
    "Packed",
    "Gain",
    "Slope",
    "Noise",
    "Density",
    "Mixture",
    "Lanes",
    "State",
    "Covariances",
    "Seen",
}


def uncounted(module: ast.Module) -> list[ast.FunctionDef]:
    return [
        node
        for node in walk(module)
        if isinstance(node, ast.FunctionDef)
        and any(ast.unparse(decorator) in UNCOUNTED for decorator in node.decorator_list)
    ]


def offences(function: ast.FunctionDef) -> list[str]:
    found = []
    for node in walk(function):
        called = node.func if isinstance(node, ast.Call) else None
        if isinstance(called, ast.Attribute) and ARRAY_MAKERS.fullmatch(called.attr):
            found.append(f"{function.name}:{called.lineno} {ast.unparse(called)}")
        if isinstance(node, ast.List | ast.Dict | ast.Set | ast.ListComp | ast.MatMult):
            found.append(f"{function.name} {type(node).__name__}")
    returned = ast.unparse(function.returns) if function.returns else "nothing said"
    if not set(returned.replace("tuple", "").strip("[]").split(", ")) <= SCALARS:
        found.append(f"{function.name} returns {returned}")
    return found


def sources() -> list[str]:
    return modules("service/", "converters/", "compiled/")


def kernels() -> dict[str, list[ast.FunctionDef]]:
    return {
        name: uncounted(tree(name)) for name in sources() if "multiradar_compiled" in text(name)
    }


def test_no_uncounted_function_makes_or_returns_an_array() -> None:
    found = kernels()
    assert sum(len(functions) for functions in found.values()) > 20
    assert {
        name: bad
        for name, functions in found.items()
        if (bad := [one for function in functions for one in offences(function)])
    } == {}


@pytest.mark.parametrize(
    "body",
    [
        "def f() -> None:\n    x = np.empty(3)",
        "def f(a: Floats) -> None:\n    b = a.copy()",
        "def f(a: Floats) -> Floats:\n    return a",
        "def f(a: Floats) -> tuple[float, Floats]:\n    return 1.0, a",
        "def f(a: Floats) -> None:\n    b = [1.0]",
        "def f(a: Floats) -> None:\n    b = a @ a",
    ],
)
def test_the_rule_meets_what_it_forbids(body: str) -> None:
    (function,) = uncounted(ast.parse(f"@in_loop\n{body}"))
    assert offences(function)


def test_no_function_is_compiled_with_fast_math() -> None:
    # With `fastmath`, the last bits of a filter depended on which others were compiled before it.
    found = {
        f"{name}: {ast.unparse(node)}"
        for name in sources()
        if "fastmath" in text(name)
        for node in nodes(name)
        if (isinstance(node, ast.keyword) and node.arg == "fastmath")
        or (isinstance(node, ast.Constant) and node.value == "fastmath")
    }
    assert found == set()
    compiled: Any = step
    assert not compiled.targetoptions.get("fastmath")


def test_numba_stays_below_the_version_whose_private_option_was_not_tried() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (bound,) = [one for one in project["dependencies"] if one.startswith("numba")]
    pinned = [
        line
        for name in ("requirements/dev.txt", "requirements/run.txt", "requirements/bench.txt")
        for line in (ROOT / name).read_text(encoding="utf-8").splitlines()
        if line.startswith("numba==")
    ]
    assert bound == "numba>=0.61,<0.69"
    assert {line.split("==")[1].rsplit(".", 1)[0] for line in pinned if "==" in line} == {"0.68"}
