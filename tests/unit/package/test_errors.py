"""The exception tree is the one that is drawn."""

import importlib
import inspect
import pkgutil
import re

import multiradar
from multiradar import errors
from multiradar.errors import LiveStreamError, MultiradarError

#: Packages without which some modules cannot be imported.
_OF_EXTRAS = {"ray"}


def _drawn() -> dict[str, str]:
    """Each class of the drawing with the one above it, by how far it stands to the right."""
    above: list[tuple[int, str]] = []
    found: dict[str, str] = {}
    for line in (errors.__doc__ or "").splitlines():
        match = re.match(r"[ │├└─]*(?=\w+Error)", line)
        if match is None or not line.startswith("    "):
            continue
        depth, name = match.end(), line[match.end() :].split()[0]
        above = [one for one in above if one[0] < depth]
        found[name] = above[-1][1] if above else "Exception"
        above.append((depth, name))
    return found


def test_the_tree_in_the_docstring_is_that_of_the_classes() -> None:
    classes = inspect.getmembers(errors, inspect.isclass)
    real = {
        name: next(one.__name__ for one in found.__mro__[1:] if one.__name__[0] != "_")
        for name, found in classes
        if issubclass(found, Exception) and not issubclass(found, Warning) and name[0] != "_"
    }
    assert _drawn() == real


def test_every_error_for_users_is_in_the_tree() -> None:
    for module in pkgutil.walk_packages(multiradar.__path__, "multiradar."):
        if not module.name.endswith("__main__"):
            try:
                importlib.import_module(module.name)
            except ModuleNotFoundError as error:
                if error.name not in _OF_EXTRAS:
                    raise
    pending = [MultiradarError]
    while pending:
        found = pending.pop()
        assert found.__module__ == errors.__name__
        pending += found.__subclasses__()


def test_of_many_sensors_in_real_time_five_are_named() -> None:
    names = [f"41-{number}" for number in range(6)]
    five = "41-0, 41-1, 41-2, 41-3, 41-4"
    assert str(LiveStreamError(names[:5])).startswith(f"{five} deliver real-time data")
    assert str(LiveStreamError(names)).startswith(f"{five}, … deliver real-time data")
