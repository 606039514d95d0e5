"""The base class of all models, and described fields."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class Record(BaseModel):
    """A frozen record with strict types, without unknown fields, NaN and infinities."""

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
    """Return field information: description, unit, source, and when the field is absent.

    Parameters
    ----------
    description : str
        Meaning of the field.
    unit : str
        Unit, or the format of a text.
    source : str
        Origin of the value.
    absent : str
        When the field is null or missing.
    **more : str
        Further keywords for the JSON Schema.

    Returns
    -------
    FieldInfo
        For use inside `Annotated`; the four texts are also in the JSON Schema.
    """
    return Field(
        description=description,
        json_schema_extra={"unit": unit, "source": source, "absent": absent, **more},
    )
