"""The output of a tracking run."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from multiradar.toolbox.arguments import typed
from multiradar.toolbox.inputs import SENSORS_FILE, read_sensors
from multiradar.toolbox.output import Output, PathLike

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure

    from multiradar_schemas.sensors.sensor import SensorsFile


class Run(Output):
    """The output of `track`: tracks, biases, report.

    Parameters
    ----------
    folder : str or Path
        A folder that `track` or ``multiradar track`` made.
    seconds : mapping of str to float
        Time of each stage of the run, s.
    span_s : (float, float), optional
        First and last time of the measurements, s.
    beside_seconds : mapping of str to float
        Time of each stage of a thread that worked at the same time, s.

    Raises
    ------
    InputError
        There is no such folder.
    """

    _wanted = "the output of `track`"

    @typed
    def __init__(
        self,
        folder: PathLike,
        seconds: Mapping[str, float] | None = None,
        span_s: tuple[float, float] | None = None,
        beside_seconds: Mapping[str, float] | None = None,
    ) -> None:
        super().__init__(folder)
        self.seconds = dict(seconds or {})
        self.span_s = span_s
        self.beside_seconds = dict(beside_seconds or {})

    def __repr__(self) -> str:
        """Return the filter and the number of tracks and measurements."""
        counts, figures = self.report["counts"], self.report["figures"]
        return (
            f"Run({self.report['settings']['filter_name']}: {figures['tracks_confirmed']} "
            f"confirmed tracks from {counts['read']} measurements, {self.folder})"
        )

    @property
    def tracks(self) -> "pl.DataFrame":
        """Updates of tracks, a row each: time, position (degrees, WGS 84), speed, sigma, state."""
        return self.table("tracks")

    @property
    def biases(self) -> "pl.DataFrame":
        """Biases, a row for each sensor, parameter and epoch: estimate (measured − true), sigma."""
        return self.table("biases")

    @property
    def sensors(self) -> "SensorsFile":
        """The sensors of the run."""
        return read_sensors(self.folder / SENSORS_FILE)

    @typed
    def plot(self, *names: str) -> "Figure":
        """Draw a map of the confirmed tracks, and the biases over time with ± 2 sigma.

        Parameters
        ----------
        *names : str
            Only these: ``map``, or the name of a bias such as ``bias-26-10-range_offset``; all by
            default.

        Returns
        -------
        Figure
            Of matplotlib; save it with `Figure.savefig`.

        Raises
        ------
        ArgumentError
            There is no plot of this name.
        """
        from multiradar.toolbox.pages.pictures import picture
        from multiradar.toolbox.pages.run_plots import run_plots

        return picture(run_plots(self.tracks, self.biases, self.sensors), names)
