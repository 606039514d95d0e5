"""The studies by name, with their options; a study's code is imported only when it runs."""

import dataclasses
import importlib
import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol, cast

from multiradar.errors import ArgumentError, UnknownFilterError

if TYPE_CHECKING:
    # Help must be fast: the types bring NumPy with them.
    from multiradar.research.studies.result import Progress, StudyOptions, StudyResult


#: Command-line options, by the field of `StudyOptions` that each sets.
FLAGS = MappingProxyType({"runs": "--runs", "filters": "--filters", "duration_s": "--duration"})


@dataclass(frozen=True, slots=True)
class StudyEntry:
    """A study in the catalogue.

    Attributes
    ----------
    name : str
        Name on the command line.
    title : str
        Heading of its report.
    purpose : str
        Purpose in one sentence.
    module : str
        Module of its `run`, imported only when it runs.
    runs : int, optional
        Default number of realisations; None: not repeatable.
    duration_s : float, optional
        Default duration of its scenario, s; None: fixed.
    duration_bounds_s : tuple of two floats
        Minimum and maximum duration of its scenario, s.
    filters : tuple of str
        Filters it compares; empty: no choice.
    """

    name: str
    title: str
    purpose: str
    module: str
    runs: int | None = None
    duration_s: float | None = None
    duration_bounds_s: tuple[float, float] = (0.0, math.inf)
    filters: tuple[str, ...] = ()

    @property
    def supported_options(self) -> tuple[str, ...]:
        """Names of the fields of `StudyOptions` that the study supports."""
        chosen = {"runs": self.runs, "filters": self.filters, "duration_s": self.duration_s}
        return ("seed", *(name for name, default in chosen.items() if default))

    def complete(self, options: "StudyOptions") -> "StudyOptions":
        """Return options with this study's defaults in place of None.

        Unsupported options become None.

        Raises
        ------
        UnknownFilterError
            A filter that the study does not compare.
        ArgumentError
            A duration outside the bounds of the study.
        """
        for name in options.filters or () if self.filters else ():
            if name not in self.filters:
                raise UnknownFilterError(name, self.filters)
        if self.duration_s is not None and options.duration_s is not None:
            self._require_duration(options.duration_s)
        return dataclasses.replace(
            options,
            runs=None if self.runs is None else options.runs or self.runs,
            duration_s=None if self.duration_s is None else options.duration_s or self.duration_s,
            filters=(options.filters or self.filters) if self.filters else None,
        )

    def run(self, options: "StudyOptions", progress: "Progress") -> "StudyResult":
        """Import the study and run it, with its defaults in place of None.

        Raises
        ------
        UnknownFilterError
            A filter that the study does not compare.
        ArgumentError
            A duration outside the bounds of the study.
        """
        completed = self.complete(options)
        study = cast("_Study", importlib.import_module(self.module))
        return study.run(completed, progress)

    def _require_duration(self, duration_s: float) -> None:
        least, most = self.duration_bounds_s
        if not least <= duration_s <= most:
            bounds = f"expected {least:g} to {most:g} s, was {duration_s:g} s"
            raise ArgumentError(f"`duration_s` of {self.name}: {bounds}", "duration_s")


class _Study(Protocol):
    # Interface of a study's module.
    def run(self, options: "StudyOptions", progress: "Progress") -> "StudyResult": ...


BIAS_ESTIMATION = StudyEntry(
    name="bias-estimation",
    title="Joint estimation of motion and radar biases",
    purpose="Compare the filters in the scenario of section 1.6 of the report, with and without "
    "bias drift: position, velocity and bias errors, with their theoretical and reported values.",
    module="multiradar.research.studies.bias_estimation.study",
    runs=20,
    duration_s=1000.0,
    duration_bounds_s=(0.5, 10_000.0),
    filters=("joint", "two-stage", "blom", "blom-macro", "ci"),
)
POLYNOMIAL_FORECAST = StudyEntry(
    name="polynomial-forecast",
    title="Filtering and forecasting a polynomial trajectory",
    purpose="Reproduce the variance tables of Koptev, Rozov and Romanovsky: exact values, Monte "
    "Carlo results with confidence bands, and the published values.",
    module="multiradar.research.studies.polynomial_forecast.study",
    runs=10_000,
)
COUPLED_MOTION = StudyEntry(
    name="coupled-motion",
    title="Motion models in the velocity frame",
    purpose="Plot figures 1 and 3 of Vasiliev and Mattis, show that accelerations in the velocity "
    "frame do not depend on the heading, and compare filters based on the motion models.",
    module="multiradar.research.studies.coupled_motion.study",
    runs=100,
    duration_s=300.0,
    duration_bounds_s=(10.0, 3600.0),
    filters=(
        "cartesian-acceleration",
        "relative-speed",
        "velocity-frame-noise",
        "velocity-frame",
        "white-acceleration",
    ),
)

MANOEUVRE_PLANE = StudyEntry(
    name="manoeuvre-plane",
    title="Manoeuvre plane",
    purpose="Reproduce Korobochkin's example: errors of the plane fitted to a circle, rejection "
    "rate of planar motion, and detection rate of a helix.",
    module="multiradar.research.studies.manoeuvre_plane.study",
    runs=100,
)
BEARING_ONLY = StudyEntry(
    name="bearing-only",
    title="Angles-only trajectory estimation",
    purpose="Compare the filter of Nenartovich and Isakov, which updates the track with each "
    "angle, with the conventional scheme, which first computes positions from the angles.",
    module="multiradar.research.studies.bearing_only.study",
    runs=200,
)
TRAJECTORY_BUNDLE = StudyEntry(
    name="trajectory-bundle",
    title="Trajectory bundle, step by step",
    purpose="Plot figures 2.2 to 2.4 of the report for an S-shaped flight: the bundle before and "
    "after each step, and the ends of its tracks near the last plot.",
    module="multiradar.research.studies.trajectory_bundle.study",
    runs=20,
)

#: All studies by name, in the order of help.
STUDIES = MappingProxyType(
    {
        entry.name: entry
        for entry in (
            BIAS_ESTIMATION,
            POLYNOMIAL_FORECAST,
            COUPLED_MOTION,
            MANOEUVRE_PLANE,
            BEARING_ONLY,
            TRAJECTORY_BUNDLE,
        )
    }
)
