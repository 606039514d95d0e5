"""Simulated scenarios: measurements, and their truth."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from multiradar.errors import ArgumentError, ConfigurationError, FindingsError
from multiradar.toolbox.arguments import typed
from multiradar.toolbox.inputs import read_sensors
from multiradar.toolbox.messages.progress import progress_bar
from multiradar.toolbox.output import Output, PathLike, new_output, remove_with
from multiradar_schemas.documents.names import unknown

if TYPE_CHECKING:
    import polars as pl

    from multiradar.simulation.observation.observe import Observation
    from multiradar.simulation.scenario.model import Scenario
    from multiradar.simulation.scenario.tables import ScenarioTable
    from multiradar_schemas.report import Report
    from multiradar_schemas.sensors.sensor import SensorsFile

_MEASUREMENTS_FILE = "measurements.parquet"
_TRUTH_FILE = "truth.parquet"
_TRUE_BIASES_FILE = "truth_biases.parquet"
_TRUE_DELAYS_FILE = "truth_delays.parquet"
_SENSORS_FILE = "sensors.toml"
_SCENE_FILE = "scene.toml"


class Simulation(Output):
    """Simulated measurements with their truth.

    Parameters
    ----------
    folder : str or Path
        A folder that `simulate` or ``multiradar simulate`` made.

    Raises
    ------
    InputError
        There is no such folder.
    """

    _wanted = "the output of `simulate`"

    def __repr__(self) -> str:
        """Return what was simulated."""
        figures, settings = self.report["figures"], self.report["settings"]
        return (
            f"Simulation({settings['scene']}, seed {settings['seed']}: {figures['measurements']} "
            f"measurements of {figures['aircraft']} aircraft, {self.folder})"
        )

    @property
    def measurements(self) -> "pl.DataFrame":
        """The simulated measurements; columns as in docs/reference/fields.md."""
        return self.table("measurements")

    @property
    def truth(self) -> "pl.DataFrame":
        """The true state of the aircraft of each measurement."""
        return self.table("truth")

    @property
    def true_biases(self) -> "pl.DataFrame":
        """The true biases over time, measured − true."""
        return self.table("truth_biases")

    @property
    def sensors(self) -> "SensorsFile":
        """The sensors for the tracker, without the true biases."""
        return read_sensors(self.folder / _SENSORS_FILE)


@typed
def simulate(
    scenario: "PathLike | Mapping[str, Any]",
    *,
    out: PathLike | None = None,
    seed: int | None = None,
    duration_s: float | None = None,
) -> Simulation:
    """Simulate a scenario: measurements, sensors and truth.

    Parameters
    ----------
    scenario : str, path or mapping
        A built-in scenario (``multiradar simulate --list``), a TOML file, or its contents.
    out : path, optional
        Folder to make; by default a temporary one, removed with the result.
    seed : int, optional
        Random seed, by default that of the scenario; the same seed gives the same bytes.
    duration_s : float, optional
        Duration, s; by default that of the scenario.

    Returns
    -------
    Simulation
        `.measurements`, `.sensors`, `.truth`, `.true_biases`.

    Raises
    ------
    ArgumentError
        There is no such scenario, or an argument is out of range.
    ConfigurationError
        The scenario cannot be used.
    OutputExistsError
        `out` exists.
    FindingsError
        A sensor has no aircraft in its coverage; the simulation is in `.output`.
    """
    from multiradar.simulation.observation.observe import observe
    from multiradar.simulation.scenario.file import changed, scenario_of
    from multiradar.simulation.traffic import all_aircraft, run_generator
    from multiradar.storage.output_folder import check_new, new_folder

    _check(seed, duration_s)
    name = "scenario" if isinstance(scenario, Mapping) else str(scenario)
    made = new_output(out)
    check_new(made)
    table = changed(_table(scenario), seed=seed, duration_s=duration_s)
    with new_folder(made) as folder:
        with _with_path(name):
            described = scenario_of(table)
            with progress_bar("simulating", len(all_aircraft(described))) as on_progress:
                seen = observe(described, run_generator(described.seed), on_progress)
        _write(folder, name, table, described, seen)
    done = Simulation(made)
    if out is None:
        remove_with(done, made)
    blind = [
        f"{name}: sensor {sensor.identifier}: no aircraft enters its coverage; check "
        "latitude_deg and longitude_deg (or east_m and north_m) of its site and of the plane, "
        "and range_max_m"
        for sensor, opportunities in zip(described.sensors, seen.opportunities, strict=True)
        if not opportunities
    ]
    if blind:
        raise FindingsError(blind, done)
    return done


#: Bounds of the arguments.
SEED_MAX = 2**63 - 1
DURATION_MIN_S, DURATION_MAX_S = 0.1, 604_800.0


def _check(seed: int | None, duration_s: float | None) -> None:
    if seed is not None and not 0 <= seed <= SEED_MAX:
        raise ArgumentError(f"`seed`: expected 0 to {SEED_MAX}, was {seed}", "seed")
    if duration_s is not None and not DURATION_MIN_S <= duration_s <= DURATION_MAX_S:
        bounds = f"{DURATION_MIN_S:g} to {DURATION_MAX_S:g} s"
        msg = f"`duration_s`: expected {bounds}, was {duration_s}"
        raise ArgumentError(msg, "duration_s")


@contextmanager
def _with_path(scene: str) -> Iterator[None]:
    # Errors of a scenario as a whole do not contain its name.
    try:
        yield
    except ConfigurationError as error:
        raise ConfigurationError(f"{scene}: {error}") from error


def _table(given: object) -> "ScenarioTable":
    from multiradar.simulation.scenario.file import (
        builtin_names,
        builtin_table,
        load_table,
        scenario_table,
    )

    if isinstance(given, Mapping):
        return scenario_table(dict(given), source="scenario")
    if not isinstance(given, str | Path):
        msg = (
            "`scenario`: expected a name, the path of a TOML file, or its contents, was "
            f"{type(given).__name__}"
        )
        raise ArgumentError(msg, "scenario")
    if given in builtin_names():
        return builtin_table(str(given))
    path = Path(given)
    if path.suffix == ".toml" or path.exists():
        return load_table(path)
    raise ArgumentError(unknown("scenario or TOML file", str(given), builtin_names()))


def _write(
    folder: Path, named: str, table: "ScenarioTable", scene: "Scenario", seen: "Observation"
) -> "Report":
    from multiradar.simulation.output import (
        measurements_frame,
        true_biases_frame,
        true_delays_frame,
        truth_frame,
    )
    from multiradar.simulation.scenario.file import table_text
    from multiradar.simulation.scenario.sensors_text import sensors_text

    frames = {
        _MEASUREMENTS_FILE: measurements_frame(scene, seen),
        _TRUTH_FILE: truth_frame(scene, seen),
        _TRUE_BIASES_FILE: true_biases_frame(scene, seen),
    }
    delays = true_delays_frame(seen)
    if len(delays):
        frames[_TRUE_DELAYS_FILE] = delays
    for name, frame in frames.items():
        frame.write_parquet(folder / name, compression="zstd")
    (folder / _SENSORS_FILE).write_text(sensors_text(scene), encoding="utf-8")
    (folder / _SCENE_FILE).write_text(table_text(table), encoding="utf-8")
    report = _report(named, scene, seen, {name: len(frame) for name, frame in frames.items()})
    text = report.model_dump_json(indent=2)
    (folder / "report.json").write_text(text + "\n", encoding="utf-8")
    return report


def _report(named: str, scene: "Scenario", seen: "Observation", rows: dict[str, int]) -> "Report":
    from importlib.metadata import version

    from multiradar.simulation.observation.counts import counts_by_sensor
    from multiradar.simulation.output import reported_data
    from multiradar_schemas.report import Counts, OutputFile, Report

    made = len(seen.measurements)
    data: dict[str, Any] = {
        scene.sensors[index].identifier: document
        for index, document in sorted(reported_data(scene, seen).documents.items())
    }
    return Report(
        command="simulate",
        version=version("multiradar"),
        counts=Counts(read=made, accepted=made, rejected=0),
        rejected_by_code={},
        inputs=[],
        outputs=[OutputFile(file=name, rows=count) for name, count in rows.items()],
        settings={"scene": named, "seed": scene.seed, "duration_s": scene.duration_s},
        figures={
            "aircraft": len(seen.aircraft),
            "sensors": len(scene.sensors),
            "measurements": made,
            "by_sensor": {name: dict(one) for name, one in counts_by_sensor(scene, seen).items()},
            **({"aircraft_data": data} if data else {}),
        },
    )
