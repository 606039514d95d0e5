"""Table of the delays of transponders of a run."""

from typing import Any

import polars as pl

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking.outputs import EngineOutput
from multiradar_schemas.products.aircraft_delay import AIRCRAFT_DELAY_SCHEMA

#: A delay is observed while the ratio of its sigma to the prior is below this.
OBSERVED_RATIO_MAX = 0.5


class DelayTable:
    """A row for each confirmed track, when it is terminated or at the end of the run."""

    def __init__(self, sensors: SensorTable) -> None:
        self._sensors = sensors
        self._all = pl.DataFrame(schema=AIRCRAFT_DELAY_SCHEMA)

    def update(self, output: EngineOutput) -> pl.DataFrame:
        """Return the rows of an output of the engine."""
        rows = wire.delays_frame(output.delays, self._sensors)
        self._all.extend(rows)
        return rows

    def finish(self) -> pl.DataFrame:
        """Return the remaining rows: none, since the end of the stream has all tracks."""
        return pl.DataFrame(schema=AIRCRAFT_DELAY_SCHEMA)

    def figures(self) -> dict[str, Any]:
        """Return how many delays there are and how many are observed, and the scatter of these."""
        observed = self._all.filter(pl.col("prior_ratio") < OBSERVED_RATIO_MAX)
        delay, sigma = observed["delay_m"], observed["sigma_m"]
        return {
            "tracks": len(self._all),
            "observed": len(observed),
            "mean_m": delay.mean(),
            "scatter_m": delay.std(),
            "median_sigma_m": sigma.median(),
        }
