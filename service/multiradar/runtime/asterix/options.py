"""Channel options from the settings of a user of system tracks."""

import numpy as np

from multiradar.geodesy.stereographic import StereographicPlane
from multiradar.runtime.asterix.channel import ChannelOptions
from multiradar.settings.asterix_output import AsterixOutputSettings
from multiradar_converters.asterix.writing.senders import Sender


def channel_options(settings: AsterixOutputSettings) -> ChannelOptions:
    """Return the options of a user's channel."""
    plane = None
    if settings.plane_centre_deg is not None:
        plane = StereographicPlane(*np.radians(settings.plane_centre_deg).tolist())
    return ChannelOptions(
        sender=Sender(settings.sac, settings.sic, settings.service),
        period_s=settings.period_s,
        status_period_s=settings.status_period_s,
        area_deg=settings.area_deg,
        tentative=settings.tentative,
        plane=plane,
        block_octets_max=settings.block_octets_max,
    )
