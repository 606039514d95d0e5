"""Heights of a sensor against those reported by others for the same aircraft."""

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import Agreement
from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN, Comparison
from multiradar.diagnosis.cross_sensor.references import RECORDING, Pairs
from multiradar.diagnosis.diagnosis import Diagnosis
from multiradar.geodesy.wgs84 import ecef_to_geodetic

#: What a height of 1 m is in other units, with their names.
_UNITS = {"feet": 1.0 / 0.3048, "flight levels": 1.0 / 30.48, "hundreds of metres": 0.01,
          "kilometres": 0.001}  # fmt: skip
_WITHIN = 0.05


def check_heights(
    comparison: Comparison, number: int, name: str, agreement: Agreement, pairs: Pairs
) -> Diagnosis | None:
    """Diagnose heights in another unit than those of other sensors.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    number, name : int, str
        The sensor.
    agreement, pairs : Agreement, Pairs
        Its agreement with the others.
    """
    chosen = pairs.select(
        np.isin(np.arange(pairs.size), agreement.matched) & (pairs.source != RECORDING)
    )
    own = comparison.tested(number).height_m[chosen.plot]
    _, _, other = ecef_to_geodetic(chosen.position_m)
    known = np.isfinite(own) & (other > 1000.0)
    if np.count_nonzero(known) < TESTED_MIN:
        return None
    ratio = float(np.median(own[known] / other[known]))
    for unit, factor in _UNITS.items():
        if abs(ratio / factor - 1.0) <= _WITHIN:
            return Diagnosis(
                name,
                "height_unit",
                f"{name}: its heights are probably in {unit}: they are {ratio:.3g} times those "
                "reported by other sensors for the same aircraft; convert them to metres",
            )
    return None
