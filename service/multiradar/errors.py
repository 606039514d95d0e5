"""The exception tree.

::

    MultiradarError                 anything this project says no to
    ├── ConfigurationError          a setting, sensors file or option that cannot be used
    │   ├── UnknownFilterError      a filter name that is not in the registry
    │   ├── UnknownPresetError      a set of requirements that there is not
    │   ├── UnknownParameterError   a bias parameter that no filter knows
    │   ├── SensorPositionError     a radar without a position
    │   ├── PriorError              a prior or a noise that leaves nothing uncertain
    │   └── MotionParameterError    a motion model's parameter that is negative or no number
    ├── InputError                  a file or message that cannot be read at all
    │   ├── MissingColumnError      a table lacks a column
    │   ├── PayloadError            a Zenoh sample or query that cannot be taken as a whole
    │   └── IdempotencyConflictError  a key was used before, for another message
    ├── OutputExistsError           the place to write to is taken
    ├── OutsidePlaneError           a place too far from the centre of the system plane
    ├── UnknownAircraftError        an aircraft that has not started, or was ended
    ├── CovarianceError             a matrix that is no covariance
    ├── ShapeError                  an array of another shape than expected, or not of numbers
    ├── TimeOrderError              a time before one that was there already
    ├── RestorationError            plots of which no trajectory can be made
    ├── JournalError                the journal cannot be written or does not verify
    │   └── JournalFullError        there is no room on the disk; nothing was taken
    ├── PipelineError               the live pipeline has stopped and takes nothing more
    ├── AccountingError             measurements read are not those accounted for
    ├── QueueFullError              a bounded queue is full; try again later
    ├── ForecastError               a forecast is asked for farther or finer than is given
    ├── PlaneError                  points that determine no plane
    ├── TrajectoryError             a track that has no trajectories to tell
    ├── BearingsError               lines of sight that determine no place
    ├── RequestError                a request over HTTP that is refused, with its status and code
    └── PeerError                   another process did not answer as agreed
        └── UnavailableError        it cannot take anything now; try again
"""

from collections.abc import Mapping, Sequence


class MultiradarError(Exception):
    """Base of all errors that are the user's or the environment's, told in one sentence."""


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


class InputError(MultiradarError):
    """A file or message cannot be read at all."""


class MissingColumnError(InputError):
    """A table lacks columns that are needed."""

    def __init__(self, source: str, missing: Sequence[str], found: Sequence[str]) -> None:
        self.source = source
        self.missing = tuple(missing)
        self.found = tuple(found)
        columns = "column" if len(self.missing) == 1 else "columns"
        super().__init__(
            f"{source}: missing {columns} {', '.join(self.missing)}; "
            f"found: {', '.join(self.found) or 'none'}"
        )


class PayloadError(InputError):
    """A sample or query that cannot be taken as a whole.

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
    """An idempotency key was used before, for a message of other content; nothing was taken."""

    def __init__(self, key: str, sequence: int) -> None:
        self.key = key
        self.sequence = sequence
        super().__init__(
            f"idempotency key {key!r}: expected the message that was taken under it before "
            f"(journal entry {sequence}), was another one"
        )


class OutputExistsError(MultiradarError):
    """The place to write to is taken; nothing there was touched."""


class UnknownFilterError(ConfigurationError):
    """A filter name is not in the registry."""

    def __init__(self, name: str, known: Sequence[str]) -> None:
        self.name = name
        self.known = tuple(known)
        super().__init__(f"unknown filter {name!r}; known: {', '.join(self.known)}")


class UnknownPresetError(ConfigurationError):
    """A set of requirements that there is not."""

    def __init__(self, name: str, known: Sequence[str]) -> None:
        self.name = name
        self.known = tuple(known)
        super().__init__(f"unknown preset {name!r}; known: {', '.join(self.known)}")


class UnknownParameterError(ConfigurationError):
    """A kind of bias parameter that no filter knows."""

    def __init__(self, kind: object, names: Sequence[str]) -> None:
        self.kind = kind
        known = ", ".join(f"{number} ({name})" for number, name in enumerate(names))
        super().__init__(f"unknown kind of bias parameter {kind!r}; known: {known}")


class SensorPositionError(ConfigurationError):
    """A radar has no position, so that nothing can be told from its plots."""

    def __init__(self, sensor: str) -> None:
        self.sensor = sensor
        super().__init__(f"radar {sensor}: expected a position, has none")


class PriorError(ConfigurationError):
    """A prior variance or a noise is not positive, or a drift is negative."""


class MotionParameterError(ConfigurationError):
    """A parameter of a motion model is out of its range, or is no finite number."""

    def __init__(self, name: str, expected: str, value: float) -> None:
        self.name = name
        self.value = value
        super().__init__(f"{name}: expected {expected}, was {value}")


class OutsidePlaneError(MultiradarError):
    """A place is too far from the centre of the system plane, or is no number."""

    def __init__(
        self,
        what: str,
        place: tuple[float, float],
        centre_rad: tuple[float, float],
        angle_max_deg: float,
    ) -> None:
        self.what = what
        self.place = place
        self.centre_rad = centre_rad
        self.angle_max_deg = angle_max_deg
        super().__init__(
            f"{what}: expected a place within {angle_max_deg:g} degrees of the plane's centre "
            f"{centre_rad} rad, was {place}"
        )


class UnknownAircraftError(MultiradarError):
    """An aircraft has not started, or was ended: nothing is known of it."""

    def __init__(self, aircraft: int) -> None:
        self.aircraft = aircraft
        super().__init__(f"aircraft {aircraft}: expected one that has started, was unknown")


class CovarianceError(MultiradarError):
    """A matrix that was given as a covariance is not symmetric or not positive definite."""


class ShapeError(MultiradarError):
    """An array is not of the expected shape, or holds what is no finite number."""

    def __init__(
        self, what: str, expected: str, shape: tuple[int, ...], found: str | None = None
    ) -> None:
        self.what = what
        self.shape = shape
        super().__init__(f"{what}: expected {expected}, was {found or f'of shape {shape}'}")


class TimeOrderError(MultiradarError):
    """A time lies before one that was there already."""

    def __init__(self, what: str, time_s: float, after_s: float) -> None:
        self.what = what
        self.time_s = time_s
        self.after_s = after_s
        super().__init__(f"{what}: expected a time of {after_s} s or later, was {time_s} s")


class RestorationError(MultiradarError):
    """There are no plots of which a trajectory can be made, or not enough of them."""


class JournalError(MultiradarError):
    """The journal cannot be written or does not verify."""


class JournalFullError(JournalError):
    """There is no room on the disk; nothing was taken, and room lets the service go on."""


class PipelineError(MultiradarError):
    """The live pipeline has stopped, or was not started, and takes nothing more."""


class AccountingError(MultiradarError):
    """Measurements read are not those accepted and rejected: a mistake of ours, told loudly."""


class QueueFullError(MultiradarError):
    """A bounded queue is full; nothing was taken, the sender may try again later."""

    def __init__(self, name: str, depth: int, retry_after_s: float) -> None:
        self.name = name
        self.depth = depth
        self.retry_after_s = retry_after_s
        super().__init__(
            f"{name} holds {depth} entries and takes no more; retry in {retry_after_s} s"
        )


class ForecastError(MultiradarError):
    """A forecast is asked for farther or finer than is given; `parameter` names what is wrong."""

    def __init__(self, parameter: str, reason: str) -> None:
        self.parameter, self.reason = parameter, reason
        super().__init__(f"{parameter}: {reason}")


class PlaneError(MultiradarError):
    """Points determine no plane; `code` says why, for programs."""

    def __init__(self, code: str, reason: str) -> None:
        self.code = code
        super().__init__(reason)


class TrajectoryError(MultiradarError):
    """A track has no trajectories to tell; `code` says why, for programs."""

    def __init__(self, code: str, reason: str) -> None:
        self.code = code
        super().__init__(reason)


class BearingsError(MultiradarError):
    """Lines of sight determine no place; `code` says why, for programs."""

    def __init__(self, code: str, reason: str) -> None:
        self.code = code
        super().__init__(reason)


class RequestError(MultiradarError):
    """A request over HTTP is refused; it becomes a problem document.

    Attributes
    ----------
    status : int
        HTTP status.
    code : str
        Stable code for programs, such as ``BODY_TOO_LARGE``.
    headers : Mapping[str, str]
        Headers the answer carries beside the document, such as ``Retry-After``.
    parameters : Mapping[str, str]
        What is wrong with each named parameter, where parameters are at fault.
    members : Mapping[str, object]
        Further members of the problem document.
    """

    def __init__(
        self,
        status: int,
        code: str,
        detail: str,
        headers: Mapping[str, str] | None = None,
        parameters: Mapping[str, str] | None = None,
        *,
        members: Mapping[str, object] | None = None,
    ) -> None:
        self.status = status
        self.code = code
        self.headers = dict(headers or {})
        self.parameters = dict(parameters or {})
        self.members = dict(members or {})
        super().__init__(detail)


class PeerError(MultiradarError):
    """Another process did not answer as agreed."""


class UnavailableError(PeerError):
    """The service cannot take the batch now; the same batch may be sent again.

    Attributes
    ----------
    retry_after_s : float, optional
        When it may be, s, as the service said; None where it said nothing.
    answered : bool
        Whether the service is there: it answered that it cannot.
    """

    def __init__(
        self, reason: str, retry_after_s: float | None = None, *, answered: bool = False
    ) -> None:
        self.retry_after_s = retry_after_s
        self.answered = answered
        super().__init__(reason)
