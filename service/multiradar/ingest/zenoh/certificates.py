"""The certificates that the service presents: that of HTTP, and those of a Zenoh file."""

import json
from pathlib import Path

from multiradar.access.certificates import Certificates
from multiradar.clock import SystemClock
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.session import zenoh_config
from multiradar.runtime.live.service import Service
from multiradar.settings.service import Settings

# In a Zenoh configuration file: for those who connect, and to connect.
_ZENOH_KEYS = ("listen_certificate", "connect_certificate")


def watch_certificates(service: Service, settings: Settings, options: ZenohOptions) -> None:
    """Report when the certificates expire in the status of a service, with an alarm before.

    To be called before the start.

    Parameters
    ----------
    service : Service
        The service.
    settings : Settings
        All settings; Zenoh, too, uses the certificate of HTTP unless it has a file.
    options : ZenohOptions
        The Zenoh session.

    Raises
    ------
    ConfigurationError
        If the Zenoh configuration file is not valid.
    """
    files: dict[str, list[Path]] = {}
    if settings.access.certificate is not None:
        files["http"] = [settings.access.certificate]
    if settings.zenoh.enabled and options.config_file is not None:
        link = json.loads(zenoh_config(options).get_json("transport/link/tls"))
        files["zenoh"] = [Path(link[key]) for key in _ZENOH_KEYS if link[key]]
    if files:
        certificates = Certificates(files, SystemClock())
        service.publication.count_edge("certificates", certificates.document)
        service.view.further_alarms.append(certificates.alarms)
