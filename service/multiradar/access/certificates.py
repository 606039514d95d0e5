"""Expiry of the certificates that the service presents: an alarm while they can be renewed.

A certificate is read once, as the interfaces do, which use it until the service is started again.
"""

from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from cryptography import x509

from multiradar.access.security_log import SECURITY_LOG
from multiradar.clock import Clock

#: Alarm of the whole service, in `alarms` of the status.
CERTIFICATE_EXPIRING = "certificate_expiring"
#: The alarm is raised so long before, s: 30 days, in which an authority answers.
REMAINING_MIN_S = 30 * 86_400.0

_DAY_S = 86_400.0


class Certificates:
    """When the certificates of the interfaces expire; any thread reads.

    Parameters
    ----------
    files : mapping
        Files of certificates (PEM) by the name of the interface; each may be a chain.
    clock : Clock
        The clock of the machine.
    """

    def __init__(self, files: Mapping[str, Iterable[Path]], clock: Clock) -> None:
        self._clock = clock
        found = {
            name: [end_s for path in paths for end_s in _ends_s(path)]
            for name, paths in files.items()
        }
        self._expires_s = {name: min(ends_s) for name, ends_s in found.items() if ends_s}
        self._logged: set[str] = set()

    def document(self) -> dict[str, Any]:
        """Return by interface when its certificate expires, Unix time, s, and in how many s."""
        now_s = self._clock.now_s()
        return {
            name: {"expires_s": end_s, "remaining_s": round(end_s - now_s, 1)}
            for name, end_s in self._expires_s.items()
        }

    def alarms(self) -> tuple[list[str], list[str]]:
        """Return the alarm of certificates that expire soon, and a warning for each in words."""
        soon = {
            name: one
            for name, one in self.document().items()
            if one["remaining_s"] < REMAINING_MIN_S
        }
        warnings = [_sentence(name, **one) for name, one in soon.items()]
        for name, warning in zip(soon, warnings, strict=True):
            if name not in self._logged:
                self._logged.add(name)
                SECURITY_LOG.warning(CERTIFICATE_EXPIRING, interface=name, reason=warning)
        return [CERTIFICATE_EXPIRING] if soon else [], warnings


def _sentence(name: str, expires_s: float, remaining_s: float) -> str:
    date = f"{datetime.fromtimestamp(expires_s, UTC):%Y-%m-%d}"
    when = (
        f"expired on {date}"
        if remaining_s <= 0.0
        else f"expires on {date}, in {remaining_s // _DAY_S:.0f} days"
    )
    return f"the TLS certificate of {name} {when}: renew it, and restart the service"


# An interface that needs a file reports one that it cannot use.
def _ends_s(path: Path) -> list[float]:
    try:
        found = x509.load_pem_x509_certificates(path.read_bytes())
    except (OSError, ValueError) as error:
        SECURITY_LOG.warning("file_not_read", file=str(path), reason=str(error))
        return []
    return [one.not_valid_after_utc.timestamp() for one in found]
