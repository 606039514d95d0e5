"""Translation between the published formats and the arrays of the core."""

from multiradar.wire.bias_states import (
    bias_correlations_frame,
    final_biases,
    parameter_columns,
    units,
)
from multiradar.wire.measurements import (
    Rejected,
    measurement_batch,
    measurement_rows,
    require_columns,
)
from multiradar.wire.sensors import in_order_of_ids, sensor_table
from multiradar.wire.tables import (
    alarm_names,
    biases_frame,
    delays_frame,
    health_frame,
    tracks_frame,
    transitions_frame,
)

__all__ = [
    "Rejected",
    "alarm_names",
    "bias_correlations_frame",
    "biases_frame",
    "delays_frame",
    "final_biases",
    "health_frame",
    "in_order_of_ids",
    "measurement_batch",
    "measurement_rows",
    "parameter_columns",
    "require_columns",
    "sensor_table",
    "tracks_frame",
    "transitions_frame",
    "units",
]
