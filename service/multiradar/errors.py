"""The exception tree.

::

    MultiradarError                 base class of all errors of this project
    ├── ConfigurationError          a setting, sensors file or option that cannot be used
    │   ├── ArgumentError           an argument of a function, or an option of a command
    │   ├── UnknownFilterError      a filter name that is not in the registry
    │   ├── UnknownPresetError      an unknown set of requirements
    │   ├── UnknownParameterError   a bias parameter that no filter knows
    │   ├── SensorPositionError     a radar without a position
    │   ├── PriorError              a prior variance or noise that is not positive
    │   └── MotionParameterError    a parameter of a motion model out of range
    ├── InputError                  a file or message that cannot be read at all
    │   ├── MissingColumnError      a table lacks a column
    │   ├── PayloadError            a Zenoh sample or query that is rejected as a whole
    │   └── IdempotencyConflictError  a key was already used for another message
    ├── FindingsError               output was written, but what it was made from is at fault
    │   └── DamageError             a state or backup is damaged; nothing was written
    ├── OutputExistsError           the output file or folder already exists
    ├── OutsidePlaneError           a position too far from the centre of the system plane
    ├── UnknownAircraftError        an aircraft that was not initiated, or was dropped
    ├── CovarianceError             a matrix that is not a covariance
    ├── ShapeError                  an array of another shape than expected, or not finite
    ├── TimeOrderError              a time before the latest one
    ├── RestorationError            plots from which no trajectory can be reconstructed
    ├── JournalError                the journal cannot be written or does not verify
    │   ├── RemovedEntriesError     entries are needed that are in the archive only
    │   └── JournalFullError        the disk is full; nothing was ingested
    ├── SnapshotError               a snapshot that cannot be written or used
    ├── StateError                  a state that an object cannot have
    ├── PipelineError               the live pipeline is not running
    │   └── JournalBusyError        another process has locked the journal; try again later
    ├── LiveStreamError             the end of a stream whose sensors deliver in real time
    ├── AccountingError             counts of measurements do not add up
    ├── QueueFullError              a bounded queue is full; try again later
    │   └── QuarantineError         the source sent mostly rejected rows; try again later
    ├── DeadlineError               a query took longer than it may
    ├── ForecastError               a forecast horizon or step out of range
    ├── PlaneError                  points that do not determine a plane
    ├── TrajectoryError             a track without trajectories
    ├── BearingsError               lines of sight that do not determine a position
    ├── RequestError                an HTTP request that is rejected, with its status and code
    └── PeerError                   another process did not answer as agreed
        ├── StreamGoesOnError       it has not ended a stream in real time
        └── UnavailableError        it cannot accept data now; try again

    DataWarning                     a warning about data or settings; the output is complete
"""

from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches


class MultiradarError(Exception):
    """Base of all errors of input or environment; the message is one sentence."""

    @property
    def for_clients(self) -> str:
        """The message for clients elsewhere, who must not learn a path of this host."""
        return str(self)


class ConfigurationError(MultiradarError):
    """A setting, sensors file or option cannot be used.

    Attributes
    ----------
    source : str
        The file, where it is one with several mistakes.
    mistakes : tuple of str
        A sentence for each of them.
    """

    def __init__(self, sentence: str, source: str = "", mistakes: Sequence[str] = ()) -> None:
        self.source = source
        self.mistakes = tuple(mistakes)
        super().__init__(sentence)


class ArgumentError(ConfigurationError):
    """An argument of a function, or an option of a command, cannot be used.

    Attributes
    ----------
    arguments : tuple of str
        Names of the arguments, as they stand in the sentence between backquotes.
    """

    def __init__(self, sentence: str, *arguments: str) -> None:
        self.arguments = arguments
        super().__init__(sentence)

    def sentence_of(self, called: Callable[[str], str]) -> str:
        """Return the sentence with other names of the arguments, such as those of options."""
        sentence = str(self)
        for name in self.arguments:
            sentence = sentence.replace(f"`{name}`", called(name))
        return sentence


class InputError(MultiradarError):
    """A file or message cannot be read at all."""


class MissingColumnError(InputError):
    """A table lacks columns that are needed; `content` is what it has instead, if that is known."""

    def __init__(
        self, source: str, missing: Sequence[str], found: Sequence[str], content: str | None = None
    ) -> None:
        self.source = source
        self.missing = tuple(missing)
        self.found = tuple(found)
        columns = "column" if len(self.missing) == 1 else "columns"
        super().__init__(
            f"{source}: missing {columns} {', '.join(self.missing)}{self._meant()}; "
            f"found{f' columns of {content}' if content else ''}: {', '.join(self.found) or 'none'}"
        )

    def _meant(self) -> str:
        # Latitude is no misspelt longitude: names must be closer than these two.
        renamed: list[str] = []
        for name in self.missing:
            near = _nearest(name, self.found, 0.8)
            near += [one for one in self.found if len(one) > 2 and name.startswith(one)]
            renamed += [f"{one} to {name}" for one in near[:1]]
        return f" (rename {', '.join(renamed)}?)" if renamed else ""


class PayloadError(InputError):
    """A sample or query that is rejected as a whole.

    Attributes
    ----------
    code : str
        Stable code of the reject.
    reason : str
        One sentence.
    """

    def __init__(self, code: str, reason: str) -> None:
        self.code = code
        self.reason = reason
        super().__init__(f"{code}: {reason}")


class IdempotencyConflictError(InputError):
    """An idempotency key was already used for a different message; nothing was ingested."""

    def __init__(self, key: str, sequence: int) -> None:
        self.key = key
        self.sequence = sequence
        super().__init__(
            f"idempotency key {key!r} was already used for a different message (journal entry "
            f"{sequence}); use a new key"
        )


class FindingsError(MultiradarError):
    """Output was written, but its input or settings are at fault, or it is incomplete.

    Attributes
    ----------
    findings : tuple of str
        A sentence for each.
    output : object
        What the function returns otherwise, such as a `multiradar.Run`.
    """

    def __init__(self, findings: Sequence[str], output: object) -> None:
        self.findings = tuple(findings)
        self.output = output
        super().__init__("; ".join(self.findings))


class DamageError(FindingsError):
    """A state or backup is damaged, nothing was written; `findings` name each file or entry."""

    def __init__(self, findings: Sequence[str]) -> None:
        super().__init__(findings, None)


class DataWarning(UserWarning):
    """A warning about data or settings; the output is complete."""


class OutputExistsError(MultiradarError):
    """The output file or folder already exists; it was not touched."""


class _UnknownNameError(ConfigurationError):
    what = ""

    def __init__(self, name: str, known: Sequence[str]) -> None:
        self.name = name
        self.known = tuple(known)
        meant = "".join(f" (did you mean {one!r}?)" for one in _nearest(name, known, 0.6))
        super().__init__(f"unknown {self.what} {name!r}{meant}; known: {', '.join(self.known)}")


class UnknownFilterError(_UnknownNameError):
    """A filter name is not in the registry."""

    what = "filter"


class UnknownPresetError(_UnknownNameError):
    """A set of requirements is unknown."""

    what = "preset"


class UnknownParameterError(ConfigurationError):
    """A kind of bias parameter is unknown."""

    def __init__(self, kind: object, names: Sequence[str]) -> None:
        self.kind = kind
        known = ", ".join(f"{number} ({name})" for number, name in enumerate(names))
        super().__init__(f"unknown kind of bias parameter {kind!r}; known: {known}")


class SensorPositionError(ConfigurationError):
    """A radar has no position."""

    def __init__(self, sensor: str) -> None:
        self.sensor = sensor
        super().__init__(f"radar {sensor}: missing position")


class PriorError(ConfigurationError):
    """A prior variance or a noise is not positive, or a drift is negative."""


class MotionParameterError(ConfigurationError):
    """A parameter of a motion model is out of range or not finite."""

    def __init__(self, name: str, expected: str, value: float) -> None:
        self.name = name
        self.value = value
        super().__init__(f"{name}: expected {expected}, was {value}")


class OutsidePlaneError(MultiradarError):
    """A position is too far from the centre of the system plane, or not finite."""

    def __init__(
        self,
        what: str,
        position: tuple[float, float],
        centre_rad: tuple[float, float],
        angle_max_deg: float,
    ) -> None:
        self.what, self.position = what, position
        self.centre_rad, self.angle_max_deg = centre_rad, angle_max_deg
        super().__init__(
            f"{what}: expected a position within {angle_max_deg:g} degrees of the plane's centre "
            f"{centre_rad} rad, was {position}"
        )


class UnknownAircraftError(MultiradarError):
    """An aircraft was not initiated, or was dropped."""

    def __init__(self, aircraft: int) -> None:
        self.aircraft = aircraft
        super().__init__(f"aircraft {aircraft} is unknown; initiate its track first")


class CovarianceError(MultiradarError):
    """A covariance matrix is not symmetric or not positive definite."""


class ShapeError(MultiradarError):
    """An array does not have the expected shape, or has values that are not finite."""

    def __init__(
        self, what: str, expected: str, shape: tuple[int, ...], found: str | None = None
    ) -> None:
        self.what, self.shape = what, shape
        super().__init__(f"{what}: expected {expected}, was {found or f'of shape {shape}'}")


class TimeOrderError(MultiradarError):
    """A time lies before the latest one."""

    def __init__(self, what: str, time_s: float, after_s: float) -> None:
        self.what, self.time_s, self.after_s = what, time_s, after_s
        super().__init__(f"{what}: expected a time of {after_s} s or later, was {time_s} s")


class RestorationError(MultiradarError):
    """There are not enough plots to reconstruct a trajectory."""


class JournalError(MultiradarError):
    """The journal cannot be written or does not verify."""

    @property
    def for_clients(self) -> str:
        """The message without the path of the journal."""
        return "the journal failed; see the log of the service"


class RemovedEntriesError(JournalError):
    """Entries that were removed from the journal are needed; they are in the archive."""


class JournalFullError(JournalError):
    """The disk is full; nothing was ingested. The service continues when space is available."""

    @property
    def for_clients(self) -> str:
        """The message without the path of the journal."""
        return "the journal disk is full; nothing was ingested"


class SnapshotError(MultiradarError):
    """A snapshot cannot be written or used; the journal holds the same."""


class StateError(MultiradarError):
    """A state does not fit the object that is to have it."""


class PipelineError(MultiradarError):
    """The live pipeline has stopped, or was not started."""


class JournalBusyError(PipelineError):
    """Another process has locked the journal; nothing was ingested, the service continues."""


class AccountingError(MultiradarError):
    """Measurements read differ from those accepted and rejected: a bug in multiradar."""


class LiveStreamError(MultiradarError):
    """The end of a stream would make measurements of sensors in real time late."""

    def __init__(self, sensors: Sequence[str]) -> None:
        self.sensors = sensors
        named = ", ".join(sensors[:5]) + (", …" if len(sensors) > 5 else "")
        super().__init__(
            f"{named} deliver real-time data; ending the stream would make measurements in "
            "transit late; use force to end the stream anyway"
        )


class QueueFullError(MultiradarError):
    """A bounded queue is full; nothing was ingested, the sender may retry later."""

    def __init__(self, name: str, depth: int, retry_after_s: float) -> None:
        self.name, self.depth = name, depth
        self.retry_after_s = retry_after_s
        super().__init__(f"{name} queue is full ({depth} entries); retry in {retry_after_s} s")


class QuarantineError(QueueFullError):
    """The source is in quarantine, and has sent what it then may; nothing was ingested."""

    def __init__(self, source: str, retry_after_s: float) -> None:
        super().__init__(source, 0, retry_after_s)
        self.args = (
            f"{source} is in quarantine because most of its rows were rejected (see "
            f"/v1/rejects); correct the rows, and retry in {retry_after_s:.1f} s",
        )


class DeadlineError(MultiradarError):
    """A query took longer than it may."""

    def __init__(self) -> None:
        super().__init__("the query exceeded its deadline; narrow the query")


class ForecastError(MultiradarError):
    """A forecast horizon or step is out of range; `parameter` names it."""

    def __init__(self, parameter: str, reason: str) -> None:
        self.parameter, self.reason = parameter, reason
        super().__init__(f"{parameter}: {reason}")


class _CodedError(MultiradarError):
    def __init__(self, code: str, reason: str) -> None:
        self.code = code
        super().__init__(reason)


class PlaneError(_CodedError):
    """Points do not determine a plane; `code` gives the reason, for programs."""


class TrajectoryError(_CodedError):
    """A track has no trajectories; `code` gives the reason, for programs."""


class BearingsError(_CodedError):
    """Lines of sight do not determine a position; `code` gives the reason, for programs."""


class RequestError(MultiradarError):
    """An HTTP request is rejected; it becomes a problem document.

    Attributes
    ----------
    status : int
        HTTP status.
    code : str
        Stable code for programs, such as ``BODY_TOO_LARGE``.
    headers : Mapping[str, str]
        Further headers of the response, such as ``Retry-After``.
    parameters : Mapping[str, str]
        The error of each wrong parameter.
    members : bytes
        Further members of the problem document, as JSON.
    """

    def __init__(
        self,
        status: int,
        code: str,
        detail: str,
        headers: Mapping[str, str] | None = None,
        parameters: Mapping[str, str] | None = None,
        *,
        members: bytes = b"",
    ) -> None:
        self.status = status
        self.code = code
        self.headers = dict(headers or {})
        self.parameters = dict(parameters or {})
        self.members = members
        super().__init__(detail)


class PeerError(MultiradarError):
    """Another process did not answer as agreed."""


class StreamGoesOnError(PeerError):
    """The service has not ended the stream: its sensors deliver in real time."""


class UnavailableError(PeerError):
    """The service cannot accept the batch now; the same batch may be sent again.

    Attributes
    ----------
    retry_after_s : float, optional
        Delay given by the service, s; None without one.
    answered : bool
        Whether the service answered.
    """

    def __init__(
        self, reason: str, retry_after_s: float | None = None, *, answered: bool = False
    ) -> None:
        self.retry_after_s = retry_after_s
        self.answered = answered
        super().__init__(reason)


# As `multiradar_schemas.documents.names`, which the core may not import.
def _nearest(name: str, known: Sequence[str], likeness_min: float) -> list[str]:
    plain = {one.casefold().replace("_", ""): one for one in known}
    wanted = name.casefold().replace("_", "")
    return [plain[one] for one in get_close_matches(wanted, plain, 1, likeness_min)]
