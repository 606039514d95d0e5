"""Multi-radar tracking for air traffic control: aircraft tracks and radar biases estimated jointly.

Five lines track a recording and draw the biases of its radars::

    import multiradar as mr

    recording = mr.convert("examples/vid-sample", date="2018-08-01")
    run = mr.track(recording.folder, "examples/sensors-vid-sample.toml", kinds=["radar"])
    print(run.biases)
    run.plot().savefig("run.png")

docs/guide/python.md introduces all names. Each is imported when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from multiradar.research.sequential.filter import SequentialFilter
    from multiradar.restoration.bundle.trajectory_bundle import Bundle
    from multiradar.toolbox import adapters
    from multiradar.toolbox.conversion.convert import convert
    from multiradar.toolbox.evaluation.evaluate import evaluate
    from multiradar.toolbox.inputs import read_sensors as load_sensors
    from multiradar.toolbox.run import Run
    from multiradar.toolbox.simulation import simulate
    from multiradar.toolbox.studies import study
    from multiradar.toolbox.tracking.custom_filters import register_filter
    from multiradar.toolbox.tracking.track import track
    from multiradar.toolbox.tracking.tracker import Tracker

__all__ = [
    "Bundle",
    "Run",
    "SequentialFilter",
    "Tracker",
    "adapters",
    "convert",
    "evaluate",
    "load_sensors",
    "register_filter",
    "simulate",
    "study",
    "track",
]

_PLACES = {
    "Bundle": ("restoration.bundle.trajectory_bundle", "Bundle"),
    "Run": ("toolbox.run", "Run"),
    "SequentialFilter": ("research.sequential.filter", "SequentialFilter"),
    "Tracker": ("toolbox.tracking.tracker", "Tracker"),
    "adapters": ("toolbox.adapters", None),
    "convert": ("toolbox.conversion.convert", "convert"),
    "evaluate": ("toolbox.evaluation.evaluate", "evaluate"),
    "load_sensors": ("toolbox.inputs", "read_sensors"),
    "register_filter": ("toolbox.tracking.custom_filters", "register_filter"),
    "simulate": ("toolbox.simulation", "simulate"),
    "study": ("toolbox.studies", "study"),
    "track": ("toolbox.tracking.track", "track"),
}


#: Commands without a function of the same name.
_COMMANDS = (
    "align",
    "archive",
    "backup",
    "demo",
    "doctor",
    "export",
    "inspect",
    "migrate",
    "replay",
    "reprocess",
    "restore",
    "serve",
    "shorten",
    "verify",
    "view",
)


def __getattr__(name: str) -> object:
    if name not in _PLACES:
        from multiradar_schemas.documents.names import did_you_mean

        msg = f"module {__name__!r} has no attribute {name!r}"
        if name in _COMMANDS:
            msg += f": it is a command; run `multiradar {name}`"
        elif not name.startswith("_"):
            msg += f"{did_you_mean(name, __all__)}; known: {', '.join(__all__)}"
        raise AttributeError(msg)
    module, member = _PLACES[name]
    found = import_module(f"{__name__}.{module}")
    value = found if member is None else getattr(found, member)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
