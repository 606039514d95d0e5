"""Encoding of tables: JSON, GeoJSON and Arrow, by polars and not row by row."""

import io
import json
from collections.abc import Mapping, Sequence

import polars as pl
from polars.interchange import CompatLevel

JSON = "application/json"
GEOJSON = "application/geo+json"
ARROW = "application/vnd.apache.arrow.stream"

#: Values of `format=` and their media types.
FORMATS = {"json": JSON, "geojson": GEOJSON, "arrow": ARROW}


def rows(frame: pl.DataFrame) -> bytes:
    """Return a table as a JSON array of objects; non-finite values become null."""
    return _finite(frame).write_json().encode()


def envelope(head: Mapping[str, object], name: str, array: bytes) -> bytes:
    """Return a JSON object: the members of `head`, then one member with an encoded array."""
    text = json.dumps(head, allow_nan=False)[:-1]
    separator = ", " if head else ""
    return b"".join([text.encode(), f'{separator}"{name}": '.encode(), array, b"}"])


def document(value: object) -> bytes:
    """Return a value as JSON; non-finite values become null."""
    return json.dumps(_finite_value(value), allow_nan=False, ensure_ascii=False).encode()


def feature_collection(frame: pl.DataFrame, head: Mapping[str, object]) -> bytes:
    """Return tracks as a GeoJSON feature collection (RFC 7946), points with their properties.

    The position is longitude, latitude and, if known, height in metres.
    """
    frame = _finite(frame)
    properties = [name for name in frame.columns if name not in {"latitude_deg", "longitude_deg"}]
    plane = pl.concat_list("longitude_deg", "latitude_deg")
    if "height_m" in frame.columns:
        position = (
            pl.when(pl.col("height_m").is_null())
            .then(plane)
            .otherwise(pl.concat_list("longitude_deg", "latitude_deg", "height_m"))
        )
    else:
        position = plane
    features = frame.select(
        type=pl.lit("Feature"),
        id=pl.col("track_id"),
        geometry=pl.struct(type=pl.lit("Point"), coordinates=position),
        properties=pl.struct(properties),
    )
    members = {"type": "FeatureCollection", **head}
    return envelope(members, "features", features.write_json().encode())


def arrow_stream(frame: pl.DataFrame) -> bytes:
    """Return a table as an Arrow IPC stream compatible with older readers; NaN becomes null."""
    buffer = io.BytesIO()
    _finite(frame).write_ipc_stream(buffer, compat_level=CompatLevel.oldest())
    return buffer.getvalue()


def chosen_format(wanted: str | None, accept: str, offered: Sequence[str]) -> str | None:
    """Return the name of the negotiated format, or None when no offered format is acceptable.

    Parameters
    ----------
    wanted : str or None
        Value of `format=`, which overrides the header.
    accept : str
        Value of the Accept header; empty accepts anything.
    offered : sequence of str
        Names of formats in order of preference.
    """
    if wanted is not None:
        return wanted if wanted in offered else None
    qualities = _qualities(accept)
    if not qualities:
        return offered[0]
    scored = [(_quality(FORMATS[name], qualities), name) for name in offered]
    best, name = max(scored, key=lambda pair: pair[0])
    return name if best > 0.0 else None


def _qualities(accept: str) -> dict[str, float]:
    qualities = {}
    for part in accept.split(",")[:32]:
        media_type, *parameters = (piece.strip().lower() for piece in part.split(";"))
        quality = 1.0
        for parameter in parameters:
            if parameter.startswith("q="):
                try:
                    quality = min(1.0, max(0.0, float(parameter[2:])))
                except ValueError:
                    quality = 0.0
        if media_type:
            qualities[media_type] = quality
    return qualities


def _quality(media_type: str, qualities: Mapping[str, float]) -> float:
    family = media_type.partition("/")[0] + "/*"
    for pattern in (media_type, family, "*/*"):
        if pattern in qualities:
            return qualities[pattern]
    return 0.0


def _finite(frame: pl.DataFrame) -> pl.DataFrame:
    floats = [name for name, dtype in frame.schema.items() if dtype.is_float()]
    return frame.with_columns(
        pl.when(pl.col(name).is_finite()).then(pl.col(name)).alias(name) for name in floats
    )


def _finite_value(value: object) -> object:
    if isinstance(value, float):
        return value if value - value == 0.0 else None
    if isinstance(value, Mapping):
        return {str(key): _finite_value(member) for key, member in value.items()}
    if isinstance(value, list | tuple):
        return [_finite_value(member) for member in value]
    return value
