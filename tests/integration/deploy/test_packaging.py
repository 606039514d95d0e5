"""Container, compose and systemd files: hardened, pinned, on loopback, and valid."""

import json
import re
import shutil
import sys
import tomllib
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest
import yaml

from multiradar.api.connections.server import TlsFiles
from multiradar.api.factory import create_api
from multiradar.settings.limits import HttpLimits, RuntimeLimits
from multiradar.settings.service import load_settings
from support.fakes.fake_service import FakeService
from support.paths import ROOT
from support.processes.certificates import Authority
from support.processes.live_server import serving
from support.processes.waiting import run_to_end

DEPLOY = ROOT / "deploy"
SYSTEMD_ANALYZE = shutil.which("systemd-analyze")


@pytest.fixture(scope="module")
def services() -> dict[str, dict[str, Any]]:
    with (DEPLOY / "compose.yaml").open(encoding="utf-8") as file:
        found: dict[str, dict[str, Any]] = yaml.safe_load(file)["services"]
    return found


def unit_settings() -> dict[str, list[str]]:
    settings: dict[str, list[str]] = {}
    for line in (DEPLOY / "multiradar.service").read_text(encoding="utf-8").splitlines():
        name, mark, value = line.partition("=")
        if mark and not line.startswith("#"):
            settings.setdefault(name, []).append(value)
    return settings


def instructions() -> list[tuple[str, str]]:
    text = (DEPLOY / "Containerfile").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    joined = re.sub(r"\\\n\s*", " ", "\n".join(lines))
    found = [line.partition(" ") for line in joined.splitlines() if line]
    return [(name, rest) for name, _, rest in found]


@pytest.mark.parametrize("name", ["router", "multiradar"])
def test_a_container_has_no_rights_and_writes_nothing_but_volumes(
    services: dict[str, dict[str, Any]], name: str
) -> None:
    service = services[name]
    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert "no-new-privileges:true" in service["security_opt"]
    assert int(service["user"].partition(":")[0]) > 0
    assert service["tmpfs"]
    assert service["mem_limit"]
    assert service["pids_limit"]
    assert "privileged" not in service
    assert service.get("network_mode") is None


def test_everything_is_published_on_loopback_only(services: dict[str, dict[str, Any]]) -> None:
    ports = [port for service in services.values() for port in service.get("ports", [])]
    assert ports
    assert all(port.startswith("127.0.0.1:") for port in ports)


def test_what_compose_mounts_is_in_the_tree_and_read_only(
    services: dict[str, dict[str, Any]],
) -> None:
    mounts = [mount for one in services.values() for mount in one["volumes"] if mount[0] == "."]
    assert {mount.split(":")[0] for mount in mounts} == {
        "./zenoh/router.json5",
        "./sensors.toml",
        "./zenoh/service.json5",
        "./access",
    }
    assert all(mount.endswith(":ro") for mount in mounts)
    for mount in mounts:
        place, inside, _ = mount.split(":")
        if place.startswith("./zenoh/"):
            assert (DEPLOY / place).is_file()
        # `multiradar key` replaces keys.toml, and a mounted file would remain the old one.
        assert not inside.endswith("keys.toml")


def test_the_service_understands_the_environment_of_compose(
    services: dict[str, dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in services["multiradar"]["environment"].items():
        monkeypatch.setenv(name, value)
    # It listens beyond its loopback, so it needs clients with keys.
    keys_file, config_file = load_settings().access.keys_file, load_settings().zenoh.config_file
    assert keys_file == Path("/etc/multiradar/access/keys.toml")
    assert config_file == Path("/etc/multiradar/zenoh.json5")
    mounted = [mount.split(":")[1] for mount in services["multiradar"]["volumes"]]
    assert str(keys_file.parent) in mounted
    assert str(config_file) in mounted


@pytest.mark.fault(41)
def test_the_image_runs_unprivileged_and_is_installed_by_hash() -> None:
    found = instructions()
    stages = [rest for name, rest in found if name == "FROM"]
    assert len(stages) == 2
    assert all(re.search(r":\d+\.\d+-slim\b", stage) for stage in stages)
    after = found[max(place for place, (name, _) in enumerate(found) if name == "FROM") :]
    user = [rest for name, rest in after if name == "USER"]
    assert user == ["10001:10001"]
    # No command runs as root after the change of user.
    last_run = max(place for place, (name, _) in enumerate(after) if name == "RUN")
    assert last_run < [name for name, _ in after].index("USER")
    installs = " ".join(rest for name, rest in found if name == "RUN")
    assert "multiradar/bin/pip install --no-cache-dir --require-hashes --requirement" in installs
    environment = " ".join(rest for name, rest in after if name == "ENV")
    cache = re.search(r"XDG_CACHE_HOME=(\S+)", environment)
    volumes = " ".join(rest for name, rest in after if name == "VOLUME")
    assert cache is not None
    assert cache[1] in volumes
    assert not any(name == "ADD" for name, _ in found)


def test_the_service_runs_with_the_versions_that_were_tested() -> None:
    def pins(name: str) -> set[str]:
        return set(re.findall(r"^\S+==\S+", (ROOT / name).read_text(), re.MULTILINE))

    running, tested = pins("requirements/run.txt"), pins("requirements/dev.txt")
    assert running
    assert running <= tested
    assert not any(pin.startswith("pytest==") for pin in running)


def test_all_extras_are_pinned() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    pinned = {path.stem for path in (ROOT / "requirements").iterdir()}
    assert pinned == {"run", *project["optional-dependencies"]}
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    locked = re.search(r"^\tfor use in (.*); do", makefile, re.MULTILINE)
    assert locked is not None
    assert set(locked[1].split()) == pinned


@pytest.mark.parametrize("vulnerable", ["dev", None])
@pytest.mark.fault(41)
def test_all_pins_are_audited_one_file_after_the_other(
    vulnerable: str | None, tmp_path: Path
) -> None:
    files = sorted(f"requirements/{path.name}" for path in (ROOT / "requirements").iterdir())
    # A program that reports one of the files, in an environment that needs no installation.
    program = tmp_path / "bin" / "pip-audit"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\necho "asked $*"\n! echo "$*" | grep -q "/{vulnerable}.txt"\n')
    program.chmod(0o755)
    line = ["make", "audit", f"VENV={tmp_path}", "--assume-old", f"{tmp_path}/.audit"]
    (tmp_path / ".audit").touch()
    done = run_to_end(line, cwd=ROOT)
    # With `--strict`, a package that cannot be looked up is an error.
    options = "--strict --disable-pip --require-hashes"
    asked = [one for one in done.stdout.splitlines() if one.startswith("asked")]
    assert asked == [f"asked {options} --requirement {one}" for one in files]
    assert (done.returncode != 0) == (vulnerable is not None), done.stderr


def test_vulnerabilities_are_looked_up_each_week_without_a_change() -> None:
    text = (ROOT / ".github/workflows/audit.yml").read_text(encoding="utf-8")
    # YAML 1.1 reads the key `on` as true.
    workflow = yaml.safe_load(text)
    assert workflow[True]["schedule"]
    steps = [step for job in workflow["jobs"].values() for step in job["steps"]]
    assert [step["run"] for step in steps if "run" in step] == ["make audit"]


def test_what_the_image_copies_is_in_the_tree() -> None:
    copied = [rest.split()[:-1] for name, rest in instructions() if name == "COPY"]
    sources = [source for group in copied for source in group if not source.startswith("--from")]
    missing = [
        source for source in sources if not source.startswith("/") and not (ROOT / source).exists()
    ]
    assert missing == []


def test_the_image_has_every_package_of_the_wheel() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wheel = project["tool"]["hatch"]["build"]["targets"]["wheel"]
    copied = {source for name, rest in instructions() if name == "COPY" for source in rest.split()}
    assert {package.partition("/")[0] for package in wheel["packages"]} <= copied
    assert set(wheel["force-include"]) <= copied


def test_a_distribution_has_the_same_bytes_each_time(tmp_path: Path) -> None:
    found = []
    for folder in (tmp_path / "one", tmp_path / "two"):
        built = run_to_end([sys.executable, "-m", "hatchling", "build", "-d", folder], cwd=ROOT)
        assert built.returncode == 0, built.stderr
        found.append({one.name: one.read_bytes() for one in folder.iterdir()})
    assert len(found[0]) == 2
    assert found[0] == found[1]
    (wheel,) = (tmp_path / "one").glob("*.whl")
    # `multiradar demo` works without the repository.
    assert "multiradar_examples/vid-sample/plots.txt" in ZipFile(wheel).namelist()


def test_supervisors_ask_for_liveness(services: dict[str, dict[str, Any]]) -> None:
    assert "/healthz" in " ".join(services["multiradar"]["healthcheck"]["test"])
    settings = unit_settings()
    assert (settings["Type"], settings["Restart"]) == (["notify"], ["on-failure"])
    # A call of the engine may take so long before the service is not alive.
    assert int(settings["WatchdogSec"][0].removesuffix("s")) < RuntimeLimits().stall_max_s
    assert settings["StartLimitIntervalSec"] == ["0"]


@pytest.mark.parametrize("tls", [False, True])
def test_the_health_check_of_the_containers_finds_a_service_with_and_without_tls(
    tmp_path: Path, services: dict[str, dict[str, Any]], tls: bool
) -> None:
    """With a certificate a container was unhealthy for ever."""
    _, python, option, check = services["multiradar"]["healthcheck"]["test"]
    assert (python, option) == ("python", "-c")
    (of_image,) = (rest for name, rest in instructions() if name == "HEALTHCHECK")
    found = json.loads(of_image[of_image.index("CMD") + len("CMD") :])
    assert [one.strip() for one in found] == [python, option, check.strip()]
    files = TlsFiles(*Authority(tmp_path).issue("multiradar")) if tls else None
    limits = HttpLimits()
    with serving(create_api(FakeService(), limits), limits, files) as port:
        healthy = run_to_end([sys.executable, "-c", check.replace("8321", str(port))])
        assert healthy.returncode == 0, healthy.stderr
    # Nothing listens there any more.
    assert run_to_end([sys.executable, "-c", check.replace("8321", str(port))]).returncode != 0


def test_the_unit_is_hardened() -> None:
    settings = unit_settings()
    for name in (
        "DynamicUser",
        "NoNewPrivileges",
        "PrivateTmp",
        "PrivateDevices",
        "ProtectHome",
        "ProtectKernelModules",
        "ProtectKernelTunables",
        "ProtectControlGroups",
        "RestrictNamespaces",
        "RestrictSUIDSGID",
        "LockPersonality",
    ):
        assert settings[name] == ["yes"], name
    assert settings["ProtectSystem"] == ["strict"]
    assert settings["CapabilityBoundingSet"] == [""]
    assert settings["StateDirectory"] == ["multiradar"]
    assert settings["IPAddressDeny"] == ["any"]
    state = settings["ExecStart"][0].partition("--state ")[2]
    assert state == f"/var/lib/{settings['StateDirectory'][0]}"
    cache = f"XDG_CACHE_HOME=/var/cache/{settings['CacheDirectory'][0]}"
    assert any(cache in line.split() for line in settings["Environment"])


@pytest.mark.skipif(SYSTEMD_ANALYZE is None, reason="systemd-analyze is not installed")
def test_systemd_understands_the_unit_and_finds_little_exposed(tmp_path: Path) -> None:
    text = (DEPLOY / "multiradar.service").read_text(encoding="utf-8")
    unit = tmp_path / "multiradar.service"
    # The program is not installed at the path of the unit; everything else is used unchanged.
    unit.write_text(text.replace("/opt/multiradar/bin/multiradar", "/bin/true"), encoding="utf-8")
    assert SYSTEMD_ANALYZE is not None
    verified = run_to_end([SYSTEMD_ANALYZE, "verify", str(unit)])
    assert (verified.returncode, verified.stderr) == (0, "")
    rated = run_to_end([SYSTEMD_ANALYZE, "security", "--offline=true", "--threshold=20", str(unit)])
    assert rated.returncode == 0, rated.stdout[-500:]
