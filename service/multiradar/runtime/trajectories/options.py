"""Options of trajectory bundles, in the service and offline."""

import math
from dataclasses import dataclass, field

from multiradar.errors import ConfigurationError
from multiradar.restoration.control_tracks.settings import BundleSettings

#: Length of the initial window of a bundle, s: an aircraft at 27 m/s flies twice 800 m in it.
INITIAL_S = 60.0


@dataclass(frozen=True, slots=True)
class TrajectoryOptions:
    """Bounds and rules of bundles.

    Attributes
    ----------
    aircraft_max : int
        Maximum number of tracks with a bundle.
    plots_waiting_max : int
        Maximum queued plots.
    bundle : BundleSettings
        Rules of each bundle.
    lag_max_s : float
        Maximum data time by which live bundles may lag behind the tracks, s: older plots are
        skipped.
    workers : int
        Threads that update live bundles.

    Raises
    ------
    ConfigurationError
        If a bound or the number of threads is below 1.
    """

    aircraft_max: int
    plots_waiting_max: int = 500_000
    bundle: BundleSettings = field(default_factory=BundleSettings)
    lag_max_s: float = math.inf
    workers: int = 1

    def __post_init__(self) -> None:
        for name in ("aircraft_max", "plots_waiting_max", "workers"):
            value = getattr(self, name)
            if value < 1:
                raise ConfigurationError(f"{name}: expected at least 1, was {value}")


def trajectory_options(
    aircraft_max: int,
    plots_waiting_max: int,
    lateral_max_mps2: float,
    longitudinal_max_mps2: float,
    *,
    lag_max_s: float = math.inf,
    workers: int = 1,
) -> TrajectoryOptions:
    """Return the options from settings of the section `trajectories`."""
    bundle = BundleSettings(
        initial_s=INITIAL_S,
        lateral_max_mps2=lateral_max_mps2,
        longitudinal_max_mps2=longitudinal_max_mps2,
    )
    return TrajectoryOptions(aircraft_max, plots_waiting_max, bundle, lag_max_s, workers)
