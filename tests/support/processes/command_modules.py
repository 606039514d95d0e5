"""The modules that commands load when they start; importing this one loads them."""

from importlib import import_module

for module in (
    "multiradar.app",
    "multiradar.evaluation.scorecard",
    "multiradar.runtime.offline.offline_run",
    "multiradar.simulation.observation.observe",
    "multiradar.simulation.output",
    "multiradar.simulation.scenario.sensors_text",
    "multiradar.toolbox.tracking.track",
    "multiradar_converters.vid.conversion",
    "support.processes.live_process",
):
    import_module(module)
