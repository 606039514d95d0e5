"""Check of what users pass to a bundle."""

from multiradar.errors import ArgumentError
from multiradar.restoration.control_tracks.settings import BundleSettings


def checked_settings(settings: object) -> BundleSettings:
    """Return the settings of a bundle.

    Parameters
    ----------
    settings : object
        What a user gave as settings; None for the default ones.

    Returns
    -------
    BundleSettings
        The settings, unchanged.

    Raises
    ------
    ArgumentError
        They are of another type.
    """
    if settings is None:
        return BundleSettings()
    if isinstance(settings, BundleSettings):
        return settings
    msg = f"`settings`: expected BundleSettings, was {type(settings).__name__}"
    raise ArgumentError(msg, "settings")
