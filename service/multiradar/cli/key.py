"""`multiradar key`: a new API key of a client."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class RoleChoice(StrEnum):
    """Roles, as `Role` of the settings, which is not imported here: help must be fast."""

    FEED = "feed"
    DISPLAY = "display"
    OPERATE = "operate"


def key(
    *,
    name: Annotated[
        str,
        typer.Argument(metavar="NAME", help="Name of the client, such as radar-26-10."),
    ],
    role: Annotated[
        RoleChoice,
        typer.Option(
            help="feed: send measurements; display: read all output; operate: full access.",
            show_default=False,
        ),
    ],
    sensors: Annotated[
        str | None,
        typer.Option(
            metavar="ID,…",
            help="With role feed: sensors whose measurements the client may send.",
            show_default="all",
        ),
    ] = None,
    file: Annotated[
        Path, typer.Option(metavar="FILE", help="File of clients to which this client is added.")
    ] = Path("keys.toml"),
) -> None:
    """Create an API key: print it once, and add the client and the key's hash to keys.toml."""
    from pydantic import ValidationError

    from multiradar.access.clients import add_client, key_digest, new_key
    from multiradar.errors import ConfigurationError
    from multiradar.settings.access import ClientSettings
    from multiradar_schemas.documents.mistakes import mistakes_in

    made = new_key()
    values: dict[str, object] = {
        "name": name,
        "role": role.value,
        "key_sha256": key_digest(made),
    }
    if sensors is not None:
        values["sensors"] = [one.strip() for one in sensors.split(",")]
    try:
        client = ClientSettings.model_validate(values)
    except ValidationError as error:
        reasons = mistakes_in(error, ClientSettings, values, {})
        raise ConfigurationError("; ".join(reasons)) from error
    add_client(file, client)
    print(made)
    typer.echo(
        f"{file}: added {name} with the role {role.value}. The key above is shown only once.",
        err=True,
    )
