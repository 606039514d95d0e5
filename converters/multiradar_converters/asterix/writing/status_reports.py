"""Status records: sensors (063, edition 1.7) and service (065, edition 1.6).

The standard corrects with 063: range = (measured - SRB) / (1 + SRG), azimuth = measured - 081. So a
bias is *measured minus true*, and the gain is the relative increase of range. For the time stamping
bias (070) it has no formula; the same rule is used: time stamp minus true time.
"""

from dataclasses import dataclass

from multiradar_converters.asterix.layout.catalogue import layout_of
from multiradar_converters.asterix.layout.columns import Flags, Integers, Numbers
from multiradar_converters.asterix.writing.encoding import Records
from multiradar_converters.asterix.writing.senders import Sender, ticks_of_day
from multiradar_schemas.measurements.units import NAUTICAL_MILE_M

SENSOR_CATEGORY, SENSOR_EDITION = 63, "1.7"
SERVICE_CATEGORY, SERVICE_EDITION = 65, "1.6"

#: Values of item 063/060/CON; the first two are those of 065/040/NOGO as well.
OPERATIONAL, DEGRADED, INITIALISING, NOT_CONNECTED = range(4)
#: Values of item 065/000.
SDPS_STATUS, END_OF_BATCH, SERVICE_STATUS = 1, 2, 3
#: Values of item 065/050.
SERVICE_ENDED = 7


@dataclass(frozen=True)
class SensorReports:
    """Status of sensors at one time, a row per sensor.

    Attributes
    ----------
    time_s : float
        The time.
    sensor : int64[n]
        256 × SAC + SIC.
    condition : int64[n]
        Part CON of item 060.
    silent : bool[n]
        Whether there are no plots.
    time_offset_s : float64[n]
        Time stamping bias, NaN for none.
    range_gain, range_offset_m, azimuth_offset_deg : float64[n]
        Biases of the radar; NaN for none, range gain and offset together.
    secondary, primary : bool[n]
        Whether it provides secondary and primary plots, to which the biases apply.
    """

    time_s: float
    sensor: Integers
    condition: Integers
    silent: Flags
    time_offset_s: Numbers
    range_gain: Numbers
    range_offset_m: Numbers
    azimuth_offset_deg: Numbers
    secondary: Flags
    primary: Flags

    def __len__(self) -> int:
        return len(self.sensor)


def sensor_records(reports: SensorReports, sender: Sender) -> Records:
    """Return the sensor status: records of category 063, one per sensor."""
    records = Records(layout_of(SENSOR_CATEGORY, SENSOR_EDITION), len(reports))
    sender.sign(records)
    records.put("030", ticks_of_day(reports.time_s))
    records.put("050", {"SAC": reports.sensor >> 8, "SIC": reports.sensor & 255})
    records.put("060", {"CON": reports.condition})
    records.put("060+1", {"NPW": 1}, reports.silent)
    records.measure("070", 1000.0 * reports.time_offset_s)
    miles = reports.range_offset_m / NAUTICAL_MILE_M
    for node, names, where in (
        ("080", ("SRG", "SRB"), reports.secondary),
        ("090", ("PRG", "PRB"), reports.primary),
    ):
        values = dict(zip(names, (reports.range_gain, miles), strict=True))
        records.measure(node, values, where)
    records.measure("081", reports.azimuth_offset_deg, reports.secondary)
    records.measure("091", reports.azimuth_offset_deg, reports.primary)
    return records


def status_record(time_s: float, sender: Sender, *, overload: bool) -> Records:
    """Return the SDPS status: a record of category 065, message type 1.

    An overload is reported as degraded, too.
    """
    records = _service_record(time_s, sender, SDPS_STATUS)
    records.put("040", {"NOGO": DEGRADED if overload else OPERATIONAL, "OVL": overload})
    return records


def batch_record(time_s: float, sender: Sender) -> Records:
    """Return an end of batch, after all tracks of a period: a record of 065, message type 2."""
    records = _service_record(time_s, sender, END_OF_BATCH)
    records.put("020", 0)
    return records


def service_record(time_s: float, sender: Sender, report: int) -> Records:
    """Return a service status (`SERVICE_ENDED` …): a record of 065, message type 3."""
    records = _service_record(time_s, sender, SERVICE_STATUS)
    records.put("050", report)
    return records


def _service_record(time_s: float, sender: Sender, message: int) -> Records:
    records = Records(layout_of(SERVICE_CATEGORY, SERVICE_EDITION), 1)
    sender.sign(records)
    records.put("000", message)
    records.put("030", ticks_of_day(time_s))
    return records
