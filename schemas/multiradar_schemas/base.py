"""The base of all models, and how a field says what it is."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class Record(BaseModel):
    """A frozen record: types as they are, no unknown fields, no NaN and no infinities."""

    model_config = ConfigDict(
        strict=True,
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        ser_json_inf_nan="null",
    )


def described(
    description: str, *, unit: str, source: str, absent: str = "never", **more: str
) -> Any:
    """Return field information: what it is, its unit, who says it, and when it is absent.

    Parameters
    ----------
    description : str
        What the field is.
    unit : str
        Unit, or the form of a text.
    source : str
        Where the value comes from.
    absent : str
        When the field is null or missing.
    **more : str
        Further keywords for the JSON Schema.

    Returns
    -------
    FieldInfo
        For use inside `Annotated`; the four texts also stand in the JSON Schema.
    """
    return Field(
        description=description,
        json_schema_extra={"unit": unit, "source": source, "absent": absent, **more},
    )
