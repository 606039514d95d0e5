"""Accuracy of reported positions, 1 sigma on each axis, from items 010/500, 020/500 and 021/090.

Multilateration reports standard deviations. ADS-B reports categories, each a bound of the radius
that contains 95 % of the positions or, as integrity, all but one in 10⁷; errors of both axes are
taken as normal and equal (Rayleigh), so that 95 % are within 2.448 sigma and all but one in 10⁷
within 5.678. A category is a bound: most positions are better.

References
----------
NACp, NIC: RTCA DO-260B (EUROCAE ED-102A); NUCp: DO-260; all as in ICAO Doc 9871. PIC:
EUROCONTROL-SPEC-0149-12, item 021/090. Which of them a transponder reports depends on its version
(021/210): 0 NUCp; 1 and above NACp and NIC. The figure of merit of editions 0.23 to 0.26
(021/090/PA) has the values of NUCp.
"""

import numpy as np

from multiradar_converters.asterix.layout.columns import Columns, Integers, Numbers
from multiradar_schemas.bounds import POSITION_SIGMA_M
from multiradar_schemas.measurements.units import NAUTICAL_MILE_M as _NM

# Sigmas of a Rayleigh distribution within which are 95 %, and all but 1e-7.
_WITHIN_95 = float(np.sqrt(-2.0 * np.log(0.05)))
_WITHIN_INTEGRITY = float(np.sqrt(-2.0 * np.log(1e-7)))
_UNKNOWN = np.nan

# By category from 0 on, radii in m; categories without an entry are not assigned.
_NACP_95_M = np.array(
    [
        _UNKNOWN, 10.0 * _NM, 4.0 * _NM, 2.0 * _NM, _NM, 0.5 * _NM,
        0.3 * _NM, 0.1 * _NM, 0.05 * _NM, 30.0, 10.0, 3.0,
    ]
)  # fmt: skip
_NUCP_95_M = np.array(
    [
        _UNKNOWN, 10.0 * _NM, 5.0 * _NM, _NM, 0.5 * _NM, 0.25 * _NM,
        0.1 * _NM, 0.05 * _NM, 10.0, 3.0,
    ]
)  # fmt: skip
_NIC_M = np.array(
    [
        _UNKNOWN, 20.0 * _NM, 8.0 * _NM, 4.0 * _NM, 2.0 * _NM, _NM,
        0.6 * _NM, 0.2 * _NM, 0.1 * _NM, 75.0, 25.0, 7.5,
    ]
)  # fmt: skip
_PIC_M = np.array(
    [
        _UNKNOWN, 20.0 * _NM, 10.0 * _NM, 8.0 * _NM, 4.0 * _NM, 2.0 * _NM,
        _NM, 0.6 * _NM, 0.5 * _NM, 0.3 * _NM, 0.2 * _NM, 0.1 * _NM,
        75.0, 25.0, 7.5,
    ]
)  # fmt: skip


def sigma_of_deviations(x_m: Numbers, y_m: Numbers) -> Numbers:
    """Return the sigma of positions with a standard deviation on each axis.

    Parameters
    ----------
    x_m, y_m : float64[n]
        Standard deviations, m; NaN if absent.

    Returns
    -------
    float64[n]
        Root of the mean variance, m; NaN if absent, or zero, which is no accuracy.
    """
    return _bounded(np.sqrt(0.5 * (x_m**2 + y_m**2)))


def sigma_of_category(nacp: float, containment_m: float) -> float:
    """Return the sigma of a position by its NACp, else by its radius of containment, m.

    Parameters
    ----------
    nacp : float
        Category; NaN if unknown.
    containment_m : float
        Radius that contains all but one in 10⁷ positions, m; 0 or NaN if unknown.

    Returns
    -------
    float
        NaN if unknown.
    """
    category = -1 if np.isnan(nacp) else int(nacp)
    sigma_m = _radius(_NACP_95_M, np.array([category]))[0] / _WITHIN_95
    if np.isnan(sigma_m):
        sigma_m = containment_m / _WITHIN_INTEGRITY
    return float(_bounded(np.array([sigma_m]))[0])


def sigma_of_adsb(columns: Columns) -> Numbers:
    """Return the sigma of the positions of ADS-B reports, m; NaN if unknown.

    Parameters
    ----------
    columns : Columns
        Records of category 021.

    Returns
    -------
    float64[n]
        By accuracy (NACp, NUCp) where known, else by integrity (PIC, NIC). Without the version of
        the transponder the first subfield of the item is taken as the worse of NUCp and NIC.
    """
    if columns.has("030"):
        return _bounded(_radius(_NUCP_95_M, columns.integers("090", "PA")) / _WITHIN_95)
    first = columns.integers("090", "NUCPNIC")
    nucp = _radius(_NUCP_95_M, first) / _WITHIN_95
    nic = _radius(_NIC_M, first) / _WITHIN_INTEGRITY
    nacp = _radius(_NACP_95_M, columns.integers("090+1", "NACP")) / _WITHIN_95
    pic = _radius(_PIC_M, columns.integers("090+3", "PIC")) / _WITHIN_INTEGRITY
    version = columns.integers("210", "VN")
    # The integrity bounds the error of every position; the accuracy its distribution.
    integrity = np.where(np.isnan(pic), nic, pic)
    later = np.where(np.isnan(nacp), integrity, nacp)
    either = np.where(np.isnan(nacp), np.fmax(nucp, nic), nacp)
    return _bounded(np.select([version == 0, version > 0], [nucp, later], either))


def _radius(radii_m: Numbers, category: Integers) -> Numbers:
    known = (category >= 0) & (category < len(radii_m))
    found: Numbers = np.where(known, radii_m[np.where(known, category, 0)], np.nan)
    return found


def _bounded(sigma_m: Numbers) -> Numbers:
    least, most = POSITION_SIGMA_M
    found: Numbers = np.where(sigma_m > 0.0, np.clip(sigma_m, least, most), np.nan)
    return found
