"""The service warns 30 days before a certificate that it presents expires."""

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding
from structlog.testing import capture_logs

from multiradar.access.certificates import Certificates
from multiradar.app import Application
from multiradar.clock import FixedClock
from multiradar.observability.pipeline_metrics import PipelineCollector
from multiradar.settings.service import load_settings
from support.processes.certificates import Authority
from support.scenarios import live_scene

DAY_S = 86_400.0
EXPIRES = datetime(2027, 3, 1, tzinfo=UTC)
EXPIRES_S = EXPIRES.timestamp()


def _certificate(*ends: datetime) -> bytes:
    """Return a chain of certificates that expire then."""
    key, name = ec.generate_private_key(ec.SECP256R1()), x509.Name([])
    chain = b""
    for end in ends:
        builder = x509.CertificateBuilder(name, name, key.public_key(), serial_number=1)
        dated = builder.not_valid_before(end - timedelta(days=365)).not_valid_after(end)
        chain += dated.sign(key, hashes.SHA256()).public_bytes(Encoding.PEM)
    return chain


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "service.pem"
    path.write_bytes(_certificate(EXPIRES))
    return path


@pytest.mark.parametrize(
    ("left_s", "words"),
    [
        (30 * DAY_S, None),
        (30 * DAY_S - 1.0, "expires on 2027-03-01, in 29 days"),
        (DAY_S - 1.0, "expires on 2027-03-01, in 0 days"),
        (0.0, "expired on 2027-03-01"),
        (-DAY_S, "expired on 2027-03-01"),
    ],
)
@pytest.mark.fault(42)
def test_the_alarm_is_raised_30_days_before(file: Path, left_s: float, words: str | None) -> None:
    certificates = Certificates({"http": [file]}, FixedClock(EXPIRES_S - left_s))
    assert certificates.document() == {"http": {"expires_s": EXPIRES_S, "remaining_s": left_s}}
    sentence = f"the TLS certificate of http {words}: renew it, and restart the service"
    expected: Any = ([], []) if words is None else (["certificate_expiring"], [sentence])
    assert certificates.alarms() == expected


def test_it_is_logged_once_for_each_interface(file: Path, tmp_path: Path) -> None:
    later = tmp_path / "later.pem"
    later.write_bytes(_certificate(EXPIRES + timedelta(days=10)))
    clock = FixedClock(EXPIRES_S - 31 * DAY_S)
    certificates = Certificates({"http": [file], "zenoh": [later]}, clock)
    logged = []
    for _ in range(40):
        clock.advance(DAY_S)
        with capture_logs() as logs:
            certificates.alarms()
        logged += [(one["event"], one["interface"]) for one in logs]
    assert logged == [("certificate_expiring", "http"), ("certificate_expiring", "zenoh")]


def test_the_first_certificate_of_a_chain_or_of_several_files_to_expire_counts(
    file: Path, tmp_path: Path
) -> None:
    chain = tmp_path / "chain.pem"
    chain.write_bytes(_certificate(EXPIRES, EXPIRES - timedelta(days=2)))
    certificates = Certificates({"zenoh": [file, chain]}, FixedClock(EXPIRES_S))
    assert certificates.document()["zenoh"]["remaining_s"] == -2 * DAY_S


@pytest.mark.parametrize("content", [b"no certificate", None])
def test_a_file_that_cannot_be_read_is_logged(content: bytes | None, tmp_path: Path) -> None:
    path = tmp_path / "service.pem"
    if content is not None:
        path.write_bytes(content)
    with capture_logs() as logs:
        certificates = Certificates({"zenoh": [path]}, FixedClock())
    assert [(one["event"], one["file"]) for one in logs] == [("file_not_read", str(path))]
    assert certificates.document() == {}
    assert certificates.alarms() == ([], [])


def test_status_and_metrics_name_the_certificates_of_http_and_of_a_zenoh_file(
    tmp_path: Path,
) -> None:
    # They are valid for a day.
    certificate, key = Authority(tmp_path / "http").issue("multiradar")
    listening, listening_key = Authority(tmp_path / "zenoh").issue("multiradar")
    config = tmp_path / "zenoh.json5"
    config.write_text(
        f"""{{ mode: "peer", listen: {{ endpoints: ["tls/127.0.0.1:0"] }}, transport: {{ link: {{
        tls: {{ listen_certificate: "{listening}", listen_private_key: "{listening_key}" }} }} }} }}
        """
    )
    access = {"certificate": certificate, "private_key": key}
    found = _status(tmp_path, access=access, zenoh={"config_file": config})
    assert set(found["certificates"]) == {"http", "zenoh"}
    assert found["alarms"] == ["certificate_expiring"]
    assert [one for one in found["warnings"] if "TLS certificate of http expires" in one]
    metrics = {
        (sample.name, *sample.labels.values()): sample.value
        for metric in PipelineCollector(lambda: found).collect()
        for sample in metric.samples
    }
    assert metrics["multiradar_certificate_expiring",] == 1.0
    for name in ("http", "zenoh"):
        left_s = metrics["multiradar_certificate_remaining_seconds", name]
        assert 0.0 < left_s <= DAY_S


def test_a_service_without_certificates_has_no_alarm(tmp_path: Path) -> None:
    found = _status(tmp_path, zenoh={"enabled": False})
    assert "certificates" not in found
    assert found["alarms"] == []


def _status(folder: Path, **sections: Any) -> dict[str, Any]:
    """Return the status of a service with these settings, which was not started."""
    given = {"journal": {"path": folder / "journal.sqlite"}, "server": {"port": 0}, **sections}
    application = Application(load_settings(None, given), live_scene.sensors(), lambda: None)
    status = application.service.view.status()
    application.stop()
    return status
