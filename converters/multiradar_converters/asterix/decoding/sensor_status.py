"""Sensor status (063) of another SDPS: its bias estimates, unconverted."""

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.layout.columns import Flags
from multiradar_converters.asterix.layout.fields import Value, record_fields
from multiradar_converters.asterix.layout.program import Walked

#: Names of the fields of each item: ms, 1, NM, degree.
_FIELDS = {
    ("070", ""): "time_stamping_bias_ms",
    ("080", "SRG"): "ssr_range_gain",
    ("080", "SRB"): "ssr_range_bias_nm",
    ("081", ""): "ssr_azimuth_bias_deg",
    ("090", "PRG"): "psr_range_gain",
    ("090", "PRB"): "psr_range_bias_nm",
    ("091", ""): "psr_azimuth_bias_deg",
    ("092", ""): "psr_elevation_bias_deg",
}


def last_status(walked: Walked, own: Flags, data: NDArray[np.uint8]) -> dict[str, dict[str, float]]:
    """Return the last status of each sensor.

    Parameters
    ----------
    walked : Walked
        Records of category 063.
    own : bool[n]
        Selected records.
    data : uint8[b]
        Their octets.

    Returns
    -------
    dict
        Figures by sensor (`SAC-SIC` of item 050); absent figures are omitted.
    """
    status = {}
    for starts in walked.starts[own]:
        fields = record_fields(walked.program, data, starts)
        sensor = fields.get("050")
        if isinstance(sensor, dict):
            status[f"{sensor['SAC']}-{sensor['SIC']}"] = _figures(fields)
    return status


def _figures(fields: dict[str, Value]) -> dict[str, float]:
    figures = {}
    for (item, name), said in _FIELDS.items():
        value = fields.get(item)
        if isinstance(value, dict):
            value = value.get(name)
        if isinstance(value, int | float):
            figures[said] = value
    return figures
