"""Functions take at most 15 parameters: arrays that belong together travel as named tuples."""

import ast

from architecture.test_sources import modules, tree, walk

PARAMETERS_MAX = 15
PRODUCT = ("service/", "converters/", "schemas/", "compiled/")
#: The options of a command are the parameters of its function, which is named like its module.
COMMANDS = "service/multiradar/cli/"


def parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Count the parameters of a function."""
    given = function.args
    return len(given.posonlyargs) + len(given.args) + len(given.kwonlyargs)


def long(name: str, module: ast.Module) -> list[str]:
    """Return the functions of a module that take too many parameters, commands excepted."""
    command = name.rpartition("/")[2].removesuffix(".py") if name.startswith(COMMANDS) else ""
    return [
        node.name
        for node in walk(module)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and parameters(node) > PARAMETERS_MAX
        and node.name != command
    ]


def test_no_function_but_commands_takes_more_than_the_limit() -> None:
    files = modules(*PRODUCT)
    assert len(files) > 300
    found = {f"{name} {function}" for name in files for function in long(name, tree(name))}
    assert found == set()


def test_the_rule_meets_what_it_forbids() -> None:
    names = ", ".join(f"p{i}" for i in range(PARAMETERS_MAX))
    assert long("service/multiradar/x.py", ast.parse(f"def track({names}): ...")) == []
    wide = ast.parse(f"def track({names}, *, last): ...")
    assert long("service/multiradar/x.py", wide) == ["track"]
    assert long("service/multiradar/cli/tracking/track.py", wide) == []
