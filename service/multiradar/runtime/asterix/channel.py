"""One user of system tracks: the tracks it receives, and which of them it has received before."""

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from multiradar.geodesy.stereographic import StereographicPlane
from multiradar.runtime.asterix.numbers import NUMBERS
from multiradar.tracking.roster import MISSING
from multiradar_converters.asterix.writing import status_reports, track_reports
from multiradar_converters.asterix.writing.encoding import BLOCK_OCTETS_MAX, Records, blocks
from multiradar_converters.asterix.writing.senders import Sender
from multiradar_converters.asterix.writing.status_reports import (
    SensorReports,
    batch_record,
    sensor_records,
    service_record,
    status_record,
)
from multiradar_converters.asterix.writing.track_reports import TrackReports, track_records


@dataclass(frozen=True, slots=True)
class ChannelOptions:
    """Output of one user.

    Attributes
    ----------
    sender : Sender
        SAC/SIC of the service, and the service identification for this user.
    period_s : float
        Data time between two reports of a track.
    status_period_s : float
        Data time between two reports of the sensors and of the service.
    area_deg : tuple of float, optional
        West, south, east and north of the area; all tracks without it. An area with west greater
        than east crosses the antimeridian.
    tentative : bool
        Whether tentative tracks are reported.
    plane : StereographicPlane, optional
        The user's Cartesian plane.
    block_octets_max : int
        Maximum octets of a block, and so of a datagram.
    """

    sender: Sender
    period_s: float = 4.0
    status_period_s: float = 8.0
    area_deg: tuple[float, float, float, float] | None = None
    tentative: bool = True
    plane: StereographicPlane | None = None
    block_octets_max: int = BLOCK_OCTETS_MAX


class Channel:
    """Encodes reports into blocks for one user, and keeps which tracks it has received; one owner.

    Parameters
    ----------
    options : ChannelOptions
        Output of the user.
    """

    def __init__(self, options: ChannelOptions) -> None:
        self.options = options
        #: Records written by category, and items omitted because a value does not fit, by
        #: category and item.
        self.counts: Counter[str] = Counter()
        self._known = np.zeros(NUMBERS, np.bool_)
        self._code = np.full(NUMBERS, MISSING, np.int64)

    def tracks(self, reports: TrackReports) -> list[bytes]:
        """Return blocks of category 062, and one of 065 with the end of batch."""
        chosen = self.choose(reports)
        sender, time_s = self.options.sender, reports.time_s
        return [
            *self._blocks(track_reports.CATEGORY, track_records(chosen, sender)),
            *self._blocks(status_reports.SERVICE_CATEGORY, batch_record(time_s, sender)),
        ]

    def choose(self, reports: TrackReports) -> TrackReports:
        """Return the reports for the user, and record that it has received them."""
        wanted = self._within(reports) & ~reports.last
        if not self.options.tentative:
            wanted &= ~reports.tentative
        known = self._known[reports.number]
        # A track known to the user is reported once more when it is dropped or filtered out.
        rows = wanted | known
        chosen = reports.select(rows)
        number, last = chosen.number, ~wanted[rows]
        before = self._code[number]
        changed = known[rows] & (before != MISSING) & (before != chosen.mode_3a)
        self._known[number] = ~last
        self._code[number] = np.where(last, MISSING, chosen.mode_3a)
        chosen = replace(chosen, first=~known[rows], last=last, code_changed=changed)
        return chosen if self.options.plane is None else _on_plane(chosen, self.options.plane)

    def status(self, reports: SensorReports, *, overload: bool = False) -> list[bytes]:
        """Return blocks of category 063, and one of 065 with the state of the service.

        Overload: reports to the user were lost since the last such block.
        """
        sender = self.options.sender
        state = status_record(reports.time_s, sender, overload=overload)
        return [
            *self._blocks(status_reports.SENSOR_CATEGORY, sensor_records(reports, sender)),
            *self._blocks(status_reports.SERVICE_CATEGORY, state),
        ]

    def service(self, time_s: float, report: int) -> list[bytes]:
        """Return a block of category 065 with a service status report."""
        record = service_record(time_s, self.options.sender, report)
        return self._blocks(status_reports.SERVICE_CATEGORY, record)

    # ---------------------------------------------------------------- inside

    def _within(self, reports: TrackReports) -> NDArray[np.bool_]:
        if self.options.area_deg is None:
            return np.ones(len(reports), np.bool_)
        west, south, east, north = self.options.area_deg
        longitude, latitude = reports.longitude_deg, reports.latitude_deg
        inside = (longitude >= west) & (longitude <= east)
        if west > east:
            inside = (longitude >= west) | (longitude <= east)
        return np.asarray(inside & (latitude >= south) & (latitude <= north))

    def _blocks(self, category: int, records: Records) -> list[bytes]:
        self.counts[f"{category:03d}"] += records.count
        for item, count in records.left_out.items():
            self.counts[f"{category:03d}/{item}"] += count
        return blocks(category, records.written(), self.options.block_octets_max)


def _on_plane(reports: TrackReports, plane: StereographicPlane) -> TrackReports:
    latitude, longitude = np.radians(reports.latitude_deg), np.radians(reports.longitude_deg)
    x_m, y_m = plane.to_plane(latitude, longitude)
    matrix = plane.matrix(latitude, longitude)
    true = np.empty((len(reports), 2, 2))
    true[:, 0, 0], true[:, 1, 1] = reports.variance_east_m2, reports.variance_north_m2
    true[:, 0, 1] = true[:, 1, 0] = reports.covariance_m2
    on_plane = matrix @ true @ matrix.swapaxes(-1, -2)
    return replace(
        reports,
        x_m=x_m,
        y_m=y_m,
        variance_x_m2=on_plane[:, 0, 0],
        variance_y_m2=on_plane[:, 1, 1],
        covariance_xy_m2=on_plane[:, 0, 1],
    )
