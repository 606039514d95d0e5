"""Handover messages of neighbours: validation, and their tracks as rows."""

import zlib

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from multiradar.errors import InputError
from multiradar.runtime.memory.regions.areas import Areas
from multiradar.runtime.memory.regions.rows import OTHER_DTYPE
from multiradar_schemas.products.handover import OCTETS_MAX, Handover

#: A message of another time than that of the data here is not used, s. Responsibility that begins
#: later than so long after it is as if it began then: it can be exceeded.
TIME_APART_MAX_S = 60.0
#: Centres in the settings of two services are the same, degrees.
_CENTRE_DEG = 1e-6
#: Places of the covariances of a message in the matrix.
TRIANGLE = np.triu_indices(4)


def packed(payload: bytes) -> bytes:
    """Return a message as it is journalled: compressed, to a sixth or less."""
    return zlib.compress(payload)


def unpacked(packed_payload: bytes) -> bytes:
    """Return a message of the journal.

    Raises
    ------
    InputError
        If it is damaged or too long.
    """
    reader = zlib.decompressobj()
    try:
        payload = reader.decompress(packed_payload, OCTETS_MAX)
    except zlib.error as error:
        raise InputError(f"expected a compressed handover message: {error}") from error
    if not reader.eof:
        raise InputError(f"expected a handover message of at most {OCTETS_MAX} octets")
    return payload


def read_handover(payload: bytes, areas: Areas) -> Handover:
    """Return a message of a neighbour.

    Parameters
    ----------
    payload : bytes
        JSON.
    areas : Areas
        The regions in the settings.

    Raises
    ------
    InputError
        If it is too long, not valid, of an unknown region, of one with another centre, or if a
        track is later than the message.
    """
    if len(payload) > OCTETS_MAX:
        raise InputError(f"expected at most {OCTETS_MAX} octets, found {len(payload)}")
    try:
        found = Handover.model_validate_json(payload)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        place = ".".join(map(str, first["loc"]))
        raise InputError(f"not a handover message: {place}: {first['msg']}"[:300]) from error
    centre = areas.neighbours.get(found.region)
    if centre is None:
        names = ", ".join(areas.neighbours)
        raise InputError(f"expected a message from {names}, was from {found.region!r}")
    apart = abs(found.latitude_deg - centre.latitude_deg)
    apart += abs((found.longitude_deg - centre.longitude_deg + 180.0) % 360.0 - 180.0)
    if apart > _CENTRE_DEG:
        raise InputError(
            f"{found.region} has its centre at {found.latitude_deg}, {found.longitude_deg}, but "
            f"at {centre.latitude_deg}, {centre.longitude_deg} in the settings of this service: "
            "the areas would overlap"
        )
    ids = [one.track_id for one in found.tracks]
    if len(set(ids)) != len(ids):
        raise InputError("expected each track number once")
    later = next((one for one in found.tracks if one.time_s > found.time_s), None)
    if later is not None:
        raise InputError(
            f"track {later.track_id}: expected a time up to that of the message "
            f"({found.time_s:.3f} s), was {later.time_s:.3f} s"
        )
    wrong = ~are_positive_definite(_triangles(found))
    if wrong.any():
        number = ids[int(np.argmax(wrong))]
        raise InputError(f"track {number}: expected a positive definite covariance")
    return found


def are_positive_definite(triangles: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether covariances are positive definite, (n,) bool, from (n, 10) triangles."""
    return np.asarray(np.all(np.linalg.eigvalsh(_covariances(triangles)) > 0.0, axis=-1))


def other_rows(message: Handover) -> NDArray[np.void]:
    """Return the tracks of a message, rows of `OTHER_DTYPE`."""
    rows, tracks = np.zeros(len(message.tracks), OTHER_DTYPE), message.tracks
    covariance = _covariances(_triangles(message))
    rows["position_m2"] = covariance[:, [0, 0, 1], [0, 1, 1]]
    rows["velocity_m2ps2"] = (covariance[:, 2, 2] + covariance[:, 3, 3]) / 2.0
    for name in ("track_id", "time_s", "responsible", "since_s", "aircraft"):
        rows[name] = [getattr(one, name) for one in tracks]
    rows["since_s"] = np.minimum(rows["since_s"], message.time_s + TIME_APART_MAX_S)
    rows["latitude_rad"] = np.radians([one.latitude_deg for one in tracks])
    rows["longitude_rad"] = np.radians([one.longitude_deg for one in tracks])
    rows["east_mps"] = [one.velocity_east_mps for one in tracks]
    rows["north_mps"] = [one.velocity_north_mps for one in tracks]
    rows["height_m"] = [np.nan if one.height_m is None else one.height_m for one in tracks]
    rows["mode_s_address"] = [int(one.mode_s_address or "-1", 16) for one in tracks]
    rows["mode_3a"] = [int(one.mode_3a or "-1", 8) for one in tracks]
    rows["tentative"] = [one.state == "tentative" for one in tracks]
    return rows


def _triangles(message: Handover) -> NDArray[np.float64]:
    return np.array([one.covariance for one in message.tracks]).reshape(-1, len(TRIANGLE[0]))


def _covariances(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    upper = np.zeros((len(triangles), 4, 4))
    upper[:, *TRIANGLE] = triangles
    upper[:, TRIANGLE[1], TRIANGLE[0]] = triangles
    return upper
