"""Arguments checked, and settings of the tracker made of them."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from multiradar.errors import ArgumentError, ForecastError
from multiradar_schemas.documents.names import unknown

if TYPE_CHECKING:
    from multiradar.runtime.queries.parameters import Parameter
    from multiradar.settings.service import Settings
    from multiradar.toolbox.output import PathLike


#: Default maximum number of tracks with trajectories: 0.2 MB each.
TRAJECTORY_AIRCRAFT_DEFAULT = 1000


def settings_of(
    config: "PathLike | None",
    given: Mapping[str, Any],
    others: Mapping[str, Any] | None = None,
) -> "Settings":
    """Return the settings: arguments first, then the environment, the file and the defaults.

    Parameters
    ----------
    config : path, optional
        Settings in TOML.
    given : mapping of str to object
        Settings of the tracker by name; None if not given.
    others : mapping of str to object, optional
        Other settings, by section.

    Raises
    ------
    ArgumentError
        A given one cannot be used.
    ConfigurationError
        One of the file or the environment cannot be used.
    """
    from pydantic import ValidationError

    from multiradar.settings.service import TrackingSection, load_settings
    from multiradar_schemas.documents.mistakes import mistakes_in

    chosen = {name: value for name, value in given.items() if value is not None}
    try:
        TrackingSection.model_validate(chosen)
    except ValidationError as error:
        name, _, reason = mistakes_in(error, TrackingSection, chosen, {})[0].partition(": ")
        raise ArgumentError(f"`{name}`: {reason}", name) from error
    return load_settings(
        None if config is None else Path(config), {"tracking": chosen, **(others or {})}
    )


def checked_kinds(kinds: Collection[str] | None) -> frozenset[str] | None:
    """Return kinds of measurement; None means all.

    Raises
    ------
    ArgumentError
        A kind is unknown.
    """
    from multiradar_schemas.measurements.measurement import KINDS

    if kinds is None:
        return None
    if not kinds:
        msg = f"`kinds`: expected at least one of {', '.join(KINDS)}, found none"
        raise ArgumentError(msg, "kinds")
    for kind in kinds:
        if kind not in KINDS:
            raise ArgumentError(f"`kinds`: {unknown('kind', kind, KINDS)}", "kinds")
    return frozenset(kinds)


def checked_fields(hide: Collection[str] | None) -> tuple[str, ...] | None:
    """Return fields to hide, in the order of `HIDEABLE`; None means the setting.

    Raises
    ------
    ArgumentError
        A field is unknown.
    """
    from multiradar.tracking.settings import HIDEABLE

    if hide is None:
        return None
    given = set(hide)
    for name in sorted(given):
        if name not in HIDEABLE:
            raise ArgumentError(f"`hide`: {unknown('field', name, HIDEABLE)}", "hide")
    return tuple(name for name in HIDEABLE if name in given)


def require(needed: str, given: Mapping[str, object]) -> None:
    """Raise `ArgumentError` for arguments that have no effect without another."""
    for name, value in given.items():
        if value is not None:
            raise ArgumentError(f"`{name}` requires `{needed}`", name, needed)


def check_count(name: str, value: Any) -> None:
    """Check a count of at least 1; None is the default.

    Raises
    ------
    ArgumentError
        It is below 1.
    """
    if value is None or value >= 1:
        return
    msg = f"`{name}`: expected a whole number of at least 1, was {value!r}"
    raise ArgumentError(msg, name)


def within(name: str, value: float | None, bounds: "Parameter") -> float | None:
    """Return a number within its bounds, or None.

    Raises
    ------
    ArgumentError
        It is out of bounds.
    """
    if value is None:
        return None
    try:
        bounds.check(value)
    except ForecastError as error:
        raise ArgumentError(f"`{name}`: {error.reason}", name) from error
    return float(value)
