"""A certificate authority that lives as long as a test."""

from pathlib import Path

from support.processes.waiting import run_to_end


class Authority:
    """Signs certificates with a common name, for loopback, valid one day.

    Parameters
    ----------
    folder : Path
        Where its files are.
    name : str
        Its own common name.
    """

    def __init__(self, folder: Path, name: str = "test-authority") -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = folder
        self.certificate = folder / "ca.pem"
        self._key = folder / "ca.key"
        _openssl(
            *["req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1"],
            *["-nodes", "-days", "1", "-subj", f"/CN={name}"],
            *["-keyout", str(self._key), "-out", str(self.certificate)],
            *["-addext", "keyUsage=critical,keyCertSign,cRLSign"],
        )

    def issue(self, common_name: str) -> tuple[Path, Path]:
        """Return the certificate and key of a name."""
        certificate = self._folder / f"{common_name}.pem"
        key = self._folder / f"{common_name}.key"
        request = self._folder / f"{common_name}.csr"
        extensions = self._folder / "extensions.cnf"
        extensions.write_text(
            "basicConstraints=CA:FALSE\n"
            "subjectAltName=IP:127.0.0.1,DNS:localhost\n"
            "extendedKeyUsage=serverAuth,clientAuth\n"
        )
        _openssl(
            *["req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"],
            *["-subj", f"/CN={common_name}", "-keyout", str(key), "-out", str(request)],
        )
        _openssl(
            *["x509", "-req", "-in", str(request), "-days", "1", "-CAcreateserial"],
            *["-CA", str(self.certificate), "-CAkey", str(self._key)],
            *["-extfile", str(extensions), "-out", str(certificate)],
        )
        return certificate, key


def _openssl(*arguments: str) -> None:
    made = run_to_end(["openssl", *arguments])
    assert made.returncode == 0, made.stderr
