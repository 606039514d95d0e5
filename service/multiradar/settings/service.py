"""Typed settings; precedence: explicit values, environment, TOML file, defaults.

The key `epoch_s` of the section `tracking` is `[tracking] epoch_s = 4.0` in the file and
`MULTIRADAR_TRACKING__EPOCH_S=4.0` in the environment. All limits of the service are settings.
"""

import os
import re
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationError, create_model
from pydantic_settings import (
    BaseSettings,
    InitSettingsSource,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
    SettingsError,
)

from multiradar.errors import ConfigurationError
from multiradar.settings.access import AccessSettings
from multiradar.settings.asterix import AsterixSettings
from multiradar.settings.cluster import ClusterSettings
from multiradar.settings.feeds import FeedsSettings
from multiradar.settings.history import HistorySettings
from multiradar.settings.limits import HttpLimits, RuntimeLimits
from multiradar.settings.region import RegionSettings
from multiradar.settings.retention import RetentionSettings
from multiradar.settings.traces import TracesSettings
from multiradar.settings.types import (
    Count,
    Endpoint,
    NotNegative,
    Port,
    Seconds,
    Section,
    plain_number,
)
from multiradar.settings.variables import KEY_VARIABLE, TRACEBACK_VARIABLE
from multiradar.tracking.settings import IMM_MODES_MAX, IMM_MODES_MIN, TrackingSettings
from multiradar_schemas.documents.contents import SETTINGS, toml_content
from multiradar_schemas.documents.files import Document, read_toml
from multiradar_schemas.documents.mistakes import mistakes_in
from multiradar_schemas.documents.names import nearest, shown, unknown
from multiradar_schemas.errors import DocumentError

ENVIRONMENT_PREFIX = "MULTIRADAR_"
ENVIRONMENT_DELIMITER = "__"
# Variables of Kubernetes for a service named "multiradar" or "multiradar-…".
_LINKS = re.compile(r"(\w+_)?(service_(host|port(_\w+)?)|port_\d+_(tcp|udp|sctp)(_\w+)?)")

_MIB = 1024 * 1024
_UNKNOWN = re.compile(r"unknown setting '(\w+)'")


class ServerSettings(Section):
    """Address of the HTTP server."""

    host: Annotated[str, Field(min_length=1, description="Address to listen on")] = "127.0.0.1"
    port: Annotated[Port, Field(description="TCP port; 0: pick a free port")] = 8321
    names: Annotated[
        tuple[Annotated[str, Field(pattern=r"^[A-Za-z0-9.:-]{1,253}$")], ...],
        Field(
            description="Host names by which clients reach the service; requests for other names "
            "are rejected. Default: loopback names if listening on loopback, else any name"
        ),
    ] = ()


class TrajectorySettings(Section):
    """Trajectory reconstruction: number of tracks at a time (0: none), maximum accelerations."""

    aircraft_max: Annotated[int, BeforeValidator(plain_number), Field(ge=0, le=10_000)] = 0
    plots_waiting_max: Count = 500_000
    lateral_max_mps2: Annotated[float, Field(ge=0.5, le=20.0)] = 14.0
    longitudinal_max_mps2: Annotated[float, Field(ge=0.5, le=20.0)] = 4.0
    lag_max_s: Annotated[float, Field(ge=1.0, le=3600.0)] = 600.0
    workers: Annotated[int, BeforeValidator(plain_number), Field(ge=1, le=16)] = 1


class ZenohSettings(Section):
    """Zenoh interface; by default on loopback only and without multicast."""

    enabled: bool = True
    mode: Literal["peer", "client", "router"] = "peer"
    listen: tuple[Endpoint, ...] = ("tcp/127.0.0.1:7447",)
    connect: tuple[Endpoint, ...] = ()
    multicast: bool = False
    config_file: Path | None = None


class JournalSettings(Section):
    """Location of the journal, which holds acknowledged measurements on disk; its snapshots."""

    path: Path = Path("multiradar-data/journal.sqlite")
    snapshot_interval_s: Annotated[
        NotNegative,
        Field(description="Interval between snapshots of the state, s; 0: no periodic snapshots"),
    ] = 300.0
    snapshot_rows: Annotated[
        Count, Field(description="Number of measurements between snapshots of the state")
    ] = 1_000_000
    standby: Annotated[
        bool,
        Field(
            description="Run as the standby of the service that uses this journal, and take over "
            "when that service stops"
        ),
    ] = False


class PageSettings(Section):
    """The page of the air picture."""

    overlays: Annotated[
        Path | None, Field(description="Folder of GeoJSON files to show on the page")
    ] = None


class LogSettings(Section):
    """Level and format of the log."""

    level: Literal["debug", "info", "warning", "error"] = "info"
    form: Literal["text", "json"] = "text"


# Minimum and maximum of each numeric setting of the tracker.
_TRACKING_BOUNDS: dict[str, tuple[float, float]] = {
    "epoch_s": (0.001, 3600.0),
    "reorder_horizon_s": (0.0, 600.0),
    "acceleration_density": (1e-9, 1e6),
    "longitudinal_acceleration_mps2": (1e-6, 1000.0),
    "turn_rate_rad_per_s": (1e-9, 10.0),
    "speed_sigma_mps": (1.0, 10_000.0),
    "downweight_nis": (1.0, 1e12),
    "refuse_nis": (1.0, 1e12),
    "refusals_max": (1, 1000),
    "cone_ratio": (0.0, 10.0),
    "assumed_height_m": (-1000.0, 40_000.0),
    "assumed_height_sigma_m": (1.0, 40_000.0),
    "ci_scale_time_s": (1e-3, 1e6),
    "surprise_gain": (0.0, 1.0),
    "surprise_floor": (0.1, 1000.0),
    "manoeuvre_factor_max": (1.0, 1e6),
    "imm_modes": (IMM_MODES_MIN, IMM_MODES_MAX),
    "imm_bank_deg": (1.0, 80.0),
    "imm_straight_density": (1e-9, 1e6),
    "imm_turn_density": (1e-9, 1e6),
    "imm_speeding_density": (1e-9, 1e6),
    "imm_straight_s": (0.1, 1e6),
    "imm_manoeuvre_s": (0.1, 1e6),
    "imm_speeding_share": (0.001, 0.999),
    "imm_surprise_floor": (0.1, 1000.0),
    "imm_surprise_density": (0.0, 1e6),
    "range_resolution_m": (0.0, 10_000.0),
    "azimuth_resolution_deg": (0.0, 30.0),
    "clutter_density_per_km2": (1e-9, 1e3),
    "speed_max_mps": (10.0, 10_000.0),
    "manoeuvre_sigma_mps2": (0.0, 100.0),
    "confirm_score": (-1e3, 1e3),
    "confirm_updates": (1, 1000),
    "coast_after_s": (0.1, 3600.0),
    "drop_after_s": (0.1, 86_400.0),
}


# Types of the settings of the tracker with named values.
_TRACKING_CHOICES: dict[str, Any] = {
    "motion": Literal["white-acceleration", "velocity-frame"],
    "association": Literal["nearest", "probabilistic", "identity"],
    "joint_events": Literal["likeliest", "all"],
    "exact_heights": bool,
    "hidden_fields": tuple[Literal["track_number", "mode_3a", "mode_s_address", "callsign"], ...],
}


# Settings of the tracker that a filter does not use. Settings named after a filter need no entry.
_UNUSED = {
    "imm": frozenset(
        ("acceleration_density", "motion", "longitudinal_acceleration_mps2", "turn_rate_rad_per_s")
    )
}


def _tracking_fields() -> dict[str, Any]:
    fields: dict[str, Any] = {}
    for name, value in asdict(TrackingSettings()).items():
        if name in _TRACKING_CHOICES:
            fields[name] = (_TRACKING_CHOICES[name], value)
            continue
        if isinstance(value, str):
            fields[name] = (str, value)
            continue
        least, largest = _TRACKING_BOUNDS[name]
        kind: Any = Annotated[
            type(value),
            BeforeValidator(plain_number),
            Field(ge=least, le=largest, allow_inf_nan=False),
        ]
        fields[name] = (kind, value)
    return fields


def _limit_fields(limits: type) -> dict[str, Any]:
    kinds: dict[Any, Any] = {int: Count, float: Seconds}
    return {one.name: (kinds[one.type], one.default) for one in fields(limits)}


if TYPE_CHECKING:

    class TrackingSection(Section):
        """A model created below; its fields are known at run time only."""

    class HttpSettings(TrackingSection):
        """Likewise."""

    class RuntimeSettings(TrackingSection):
        """Likewise."""

else:
    # Fields and defaults are those of the dataclasses.
    TrackingSection = create_model("TrackingSection", __base__=Section, **_tracking_fields())
    HttpSettings = create_model("HttpSettings", __base__=Section, **_limit_fields(HttpLimits))
    RuntimeSettings = create_model(
        "RuntimeSettings", __base__=Section, **_limit_fields(RuntimeLimits)
    )


class Settings(BaseSettings):
    """All settings of the service."""

    model_config = SettingsConfigDict(
        env_prefix=ENVIRONMENT_PREFIX,
        env_nested_delimiter=ENVIRONMENT_DELIMITER,
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
    )

    sensors: Path = Path("sensors.toml")
    workers: Count = 1
    engine: Annotated[
        Literal["threads", "ray"],
        Field(description="Engine that updates the tracks: threads of this process, or Ray actors"),
    ] = "threads"
    rows_per_message_max: Count = 100_000
    server: ServerSettings = ServerSettings()
    access: AccessSettings = AccessSettings()
    http: HttpSettings = HttpSettings()
    runtime: RuntimeSettings = RuntimeSettings()
    trajectories: TrajectorySettings = TrajectorySettings()
    zenoh: ZenohSettings = ZenohSettings()
    journal: JournalSettings = JournalSettings()
    retention: RetentionSettings = RetentionSettings()
    history: HistorySettings = HistorySettings()
    log: LogSettings = LogSettings()
    traces: TracesSettings = TracesSettings()
    page: PageSettings = PageSettings()
    asterix: AsterixSettings = AsterixSettings()
    feeds: FeedsSettings = FeedsSettings()
    cluster: ClusterSettings = ClusterSettings()
    region: RegionSettings = RegionSettings()
    tracking: TrackingSection = TrackingSection()

    def tracking_settings(self) -> TrackingSettings:
        """Return the section `tracking` as settings of the tracker.

        Raises
        ------
        ConfigurationError
            If a setting is given that the filter does not use.
        """
        settings = TrackingSettings(**self.tracking.model_dump())
        name = settings.filter_name
        unused = sorted(_UNUSED.get(name, frozenset()) & self.tracking.model_fields_set)
        if unused:
            them = "it" if len(unused) == 1 else "them"
            raise ConfigurationError(
                f"{' and '.join(unused)}: not used by the filter {name}, whose modes have their "
                f"own settings (imm_…); remove {them} or choose another filter, such as two-stage"
            )
        return settings

    def http_limits(self) -> HttpLimits:
        """Return the section `http` as limits."""
        return HttpLimits(**self.http.model_dump())

    def runtime_limits(self) -> RuntimeLimits:
        """Return the section `runtime` as limits."""
        return RuntimeLimits(**self.runtime.model_dump())


def load_settings(path: Path | None = None, overrides: Mapping[str, Any] | None = None) -> Settings:
    """Read the settings.

    Parameters
    ----------
    path : Path, optional
        A TOML file.
    overrides : mapping, optional
        Explicit values by section, such as `{"server": {"port": 0}}`; they override the
        environment, which overrides the file, which overrides the defaults.

    Returns
    -------
    Settings
        All settings, validated.

    Raises
    ------
    ConfigurationError
        When the file cannot be read, a key is unknown or a value is invalid; the message names the
        key, the expected and the actual value.
    """
    document = _document(path)
    _check_environment(os.environ)

    class _Loaded(Settings):
        @classmethod
        def settings_customise_sources(
            cls,
            settings_cls: type[BaseSettings],
            init_settings: PydanticBaseSettingsSource,
            env_settings: PydanticBaseSettingsSource,
            dotenv_settings: PydanticBaseSettingsSource,
            file_secret_settings: PydanticBaseSettingsSource,
        ) -> tuple[PydanticBaseSettingsSource, ...]:
            return init_settings, env_settings, InitSettingsSource(settings_cls, document.values)

    try:
        loaded = _Loaded(**dict(overrides or {}))
    except ValidationError as error:
        raise _wrong(error, document, dict(overrides or {})) from error
    except SettingsError as error:
        raise ConfigurationError(f"settings: expected JSON for a list: {error}") from error
    return Settings.model_construct(
        **{name: getattr(loaded, name) for name in Settings.model_fields}
    )


def _document(path: Path | None) -> Document:
    if path is None:
        return Document("settings", {}, {})
    try:
        return read_toml(path)
    except DocumentError as error:
        raise ConfigurationError(str(error)) from error


def _wrong(
    error: ValidationError, document: Document, overrides: dict[str, Any]
) -> ConfigurationError:
    # A value of an option or a variable has no line in the file, even if the file has the key.
    lines = {path: line for path, line in document.lines.items() if _of_file(path, overrides)}
    values = document.values
    found = toml_content(values)
    if found not in (None, SETTINGS):
        return ConfigurationError(f"{document.source}: expected {SETTINGS}, was {found}")
    mistakes = mistakes_in(error, Settings, values, lines, key="setting")
    source = document.source if any(one.startswith("line ") for one in mistakes) else "settings"
    located = DocumentError(source, *(_placed(one) for one in mistakes))
    return ConfigurationError(str(located), source, located.reasons)


def _of_file(path: tuple[int | str, ...], overrides: dict[str, Any]) -> bool:
    names = [part for part in path if isinstance(part, str)]
    variable = ENVIRONMENT_PREFIX + ENVIRONMENT_DELIMITER.join(names).upper()
    found: Any = overrides
    for name in names:
        found = found.get(name) if isinstance(found, dict) else None
    return found is None and variable not in os.environ


# The most common error is a setting outside its section.
def _placed(mistake: str) -> str:
    found = _UNKNOWN.search(mistake)
    if found is None:
        return mistake
    homes = [name for name, section in _sections().items() if found[1] in section.model_fields]
    if not homes:
        return mistake
    return f"{mistake[: found.end()]}; this setting belongs in [{'] or ['.join(homes)}]"


def _check_environment(environment: Mapping[str, str]) -> None:
    sections = _sections()
    for name, value in environment.items():
        key = name.upper().removeprefix(ENVIRONMENT_PREFIX)
        section, delimiter, _ = key.partition(ENVIRONMENT_DELIMITER)
        if name.upper() == key:
            continue
        if not delimiter:
            _check_variable(name, key.lower(), value)
            continue
        if section.lower() in sections:
            continue
        reason = unknown("section", section.lower(), sections)
        raise ConfigurationError(f"environment: {name} (= {shown(value)}): {reason}")


def _check_variable(name: str, key: str, value: str) -> None:
    linked = _LINKS.fullmatch(key) or (key.endswith("port") and "://" in value)
    if key in Settings.model_fields or name in (KEY_VARIABLE, TRACEBACK_VARIABLE) or linked:
        return
    sections = _sections()
    known = [one for one in Settings.model_fields if one not in sections]
    known += [
        f"{section}__{field}" for section, kind in sections.items() for field in kind.model_fields
    ]
    # The section is omitted more often than a name is misspelt.
    bare = [one for one in known if one.partition(ENVIRONMENT_DELIMITER)[2] == key]
    meant = bare[0] if bare else nearest(key, known)
    hint = f" (did you mean {ENVIRONMENT_PREFIX}{meant.upper()}?)" if meant else ""
    raise ConfigurationError(
        f"environment: unknown variable {name}{hint}; settings are "
        f"{ENVIRONMENT_PREFIX}SECTION{ENVIRONMENT_DELIMITER}SETTING"
    )


def _sections() -> dict[str, type[Section]]:
    kinds = {name: field.annotation for name, field in Settings.model_fields.items()}
    return {
        name: kind
        for name, kind in kinds.items()
        if isinstance(kind, type) and issubclass(kind, Section)
    }
