"""Tests wait for conditions within one common time-out: no sleeps, no own time-outs."""

import ast
from collections.abc import Iterator

import pytest

from architecture.test_sources import modules, tree, walk

#: Functions that wait, and functions that only measure.
HELPER = "tests/support/processes/waiting.py"
CLIENTS = "tests/support/processes/clients.py"
FREE = (HELPER, CLIENTS, "tests/benchmark/")
BOUND = "WAIT_TIMEOUT_S"
#: Calls whose arguments are time-outs; calls with another meaning have no number (`str.join`).
WAITS = {"wait", "join", "result", "settle", "communicate", "settimeout"}
#: Calls with a time-out of their own by default, and the modules that set the common one.
BY_DEFAULT = {
    f"httpx.{name}": "support.processes.clients"
    for name in ("get", "post", "put", "patch", "delete", "head", "options", "request", "stream",
                 "Client", "AsyncClient")
} | {
    "connect": "support.processes.clients.event_socket",
    "subprocess.run": "support.processes.waiting.run_to_end",
    "subprocess.check_output": "support.processes.waiting.run_to_end",
    "subprocess.check_call": "support.processes.waiting.run_to_end",
    "urlopen": "support.processes.clients",
    "session.get": "timeout=WAIT_TIMEOUT_S",
}  # fmt: skip
#: Last names of all these.
NAMES = WAITS | {"sleep"} | {name.rpartition(".")[2] for name in BY_DEFAULT}


def is_number(node: ast.expr) -> bool:
    # Zero does not wait.
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float) and node.value > 0


def is_constant(node: ast.expr) -> bool:
    return is_number(node) or (
        isinstance(node, ast.Name) and node.id.isupper() and node.id != BOUND
    )


def faults(found: ast.Module) -> Iterator[str]:
    for node in walk(found):
        if not isinstance(node, ast.Call):
            continue
        function, words = node.func, {word.arg for word in node.keywords}
        last = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
        if last not in NAMES and not any(word and "timeout" in word for word in words):
            continue
        called = ast.unparse(function)
        place = f"{node.lineno}: {called}"
        arguments = [*node.args, *(word.value for word in node.keywords)]
        if last == "sleep" and not (arguments and ast.unparse(arguments[0]) in ("0", "0.0")):
            yield f"{place}: wait_until(...), or pause(...) where time itself is the matter"
        # `join` of text has names as arguments.
        bound = is_number if last == "join" else is_constant
        method = isinstance(node.func, ast.Attribute)
        if method and last in WAITS and any(bound(one) for one in node.args):
            yield f"{place}: {BOUND}"
        bounds = [word.value for word in node.keywords if word.arg and "timeout" in word.arg]
        if any(is_constant(one) for one in bounds):
            yield f"{place}: {BOUND}"
        if called in BY_DEFAULT and not words & {"timeout", "transport", "open_timeout"}:
            yield f"{place}: {BY_DEFAULT[called]}"


def test_sources_are_found() -> None:
    assert len([name for name in modules("tests/") if not name.startswith(FREE)]) > 200


def test_tests_wait_for_conditions_within_the_one_bound() -> None:
    assert [
        f"{name}:{fault}"
        for name in modules("tests/")
        if not name.startswith(FREE)
        for fault in faults(tree(name))
    ] == []


def test_the_bound_has_one_place() -> None:
    places = [
        name
        for name in modules("tests/")
        for node in tree(name).body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == BOUND
    ]
    assert places == [HELPER]


@pytest.mark.parametrize(
    "line",
    [
        "time.sleep(0.1)", "sleep(SHORT_S)", "asyncio.sleep(0.01)", "event.wait(10)",
        "thread.join(20.0)", "future.result(60)", "process.communicate(timeout=120)",
        "stream.recv(timeout=10)", "feed.settle(PATIENCE_S)", "httpx.get(url)",
        "httpx.Client(base_url=url)", "connect(url)", "session.get(selector)",
        "subprocess.run(line)", "subprocess.run(line, timeout=50)", "queue.get(timeout=1)",
        "socket.settimeout(5)",
    ],
)  # fmt: skip
def test_a_bound_of_its_own_is_seen(line: str) -> None:
    assert len(list(faults(ast.parse(line)))) == 1


@pytest.mark.parametrize(
    "line",
    [
        "asyncio.sleep(0)", "', '.join(parts)", "event.wait(WAIT_TIMEOUT_S)", "future.result(0)",
        "rows.get(KEY_OF(name))", "httpx.AsyncClient(transport=transport)", "a.join(b, on=K)",
        "session.get(selector, timeout=WAIT_TIMEOUT_S)", "wait_until(done, 'the end')",
    ],
)  # fmt: skip
def test_what_waits_within_the_bound_is_not(line: str) -> None:
    assert list(faults(ast.parse(line))) == []
