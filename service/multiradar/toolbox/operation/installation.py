"""Checks of an installation: Python, packages, kernels, limits and ports."""

import os
import platform
import resource
import socket
from contextlib import closing
from importlib.metadata import PackageNotFoundError, metadata, requires, version
from typing import TYPE_CHECKING, NamedTuple

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from multiradar.toolbox.operation.findings import Finding, error, ok, warning

if TYPE_CHECKING:
    from multiradar.estimation.measurement.sensors import SensorTable
    from multiradar.settings.service import Settings

_PACKAGE = "multiradar"
#: Packages that the first line names: those that change results, or are needed to start.
_NAMED = ("numba", "numpy", "polars", "eclipse-zenoh")
#: Open files beside the connections: journal, kernels, threads, Zenoh.
_FILES = 256
#: Filters whose kernels `multiradar warm-up` compiles with --all only.
_RARE = frozenset(("joint", "blom", "blom-macro", "ci"))
_PROTOCOLS = {"tcp": socket.SOCK_STREAM, "tls": socket.SOCK_STREAM, "ws": socket.SOCK_STREAM,
              "udp": socket.SOCK_DGRAM, "quic": socket.SOCK_DGRAM}  # fmt: skip


def check_python() -> Finding:
    """Check the version of Python."""
    here = platform.python_version()
    wanted = metadata(_PACKAGE)["Requires-Python"] or ""
    if here not in SpecifierSet(wanted, prereleases=True):
        return error(
            "python", f"{here}, expected {wanted}", "install multiradar with a supported Python"
        )
    return ok("python", f"{here} ({platform.machine()}), multiradar {version(_PACKAGE)}")


def check_packages() -> Finding:
    """Check that the packages it needs are there, in supported versions."""
    wanted = [
        one
        for one in map(Requirement, requires(_PACKAGE) or ())
        if one.marker is None or one.marker.evaluate({"extra": ""})
    ]
    present = {one.name: _version(one.name) for one in wanted}
    absent = [name for name, here in present.items() if here is None]
    if absent:
        return error(
            "packages", f"missing: {', '.join(absent)}",
            "reinstall multiradar with its dependencies",
        )  # fmt: skip
    other = [
        f"{one.name} {present[one.name]} (expected {one.specifier})"
        for one in wanted
        if not one.specifier.contains(present[one.name] or "", prereleases=True)
    ]
    if other:
        return warning(
            "packages", f"not supported: {', '.join(other)}",
            "install the versions of requirements/run.txt",
        )  # fmt: skip
    named = ", ".join(f"{name} {present[name]}" for name in _NAMED if name in present)
    return ok("packages", f"{len(wanted)} packages in supported versions, including {named}")


def check_kernels(settings: "Settings", sensors: "SensorTable") -> Finding:
    """Check that the kernels of the service are compiled, and may be kept."""
    from multiradar.runtime.kernel_purposes import serve_purposes
    from multiradar_compiled.ahead import missing_kernels
    from multiradar_compiled.cache import kernel_folder
    from multiradar_compiled.kernel_list import kernels_for

    if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
        return warning(
            "kernels", "NUMBA_DISABLE_JIT is set: nothing is compiled", "unset this variable; the "
            "service needs compiled kernels to keep up with live data",
        )  # fmt: skip
    folder = kernel_folder()
    if folder is None:
        return warning(
            "kernels",
            "no folder for compiled kernels is writable by this user alone, so the kernels are "
            "recompiled at each start, which takes minutes",
            "set XDG_CACHE_HOME to a folder that only this user can write to",
        )  # fmt: skip
    tracking = settings.tracking_settings()
    needed = kernels_for(
        serve_purposes(
            tracking,
            sensors,
            trajectories=bool(settings.trajectories.aircraft_max),
            asterix=bool(settings.asterix.listen or settings.asterix.connect),
            feeds=bool(settings.feeds.source),
        )
    )
    missing = len(missing_kernels(needed))
    if missing:
        everything = " --all" if tracking.filter_name in _RARE else ""
        return warning(
            "kernels", f"{missing} of {len(needed)} kernels are not compiled in {folder}: the "
            "first start will take minutes",
            f"run `multiradar warm-up{everything}` as the user of the service",
        )  # fmt: skip
    return ok("kernels", f"all {len(needed)} kernels are compiled, in {folder}")


def check_open_files(settings: "Settings") -> Finding:
    """Check the limit on open files against the connections that are allowed."""
    http = settings.http_limits()
    needed = http.connections_max + _FILES
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft != resource.RLIM_INFINITY and soft < needed:
        return warning(
            "open files", f"the limit is {soft}, but {needed} are needed for "
            f"{http.connections_max} connections", f"set `ulimit -n` or LimitNOFILE to {needed} or "
            f"more (hard limit {hard}), or lower http.connections_max",
        )  # fmt: skip
    return ok("open files", f"limit {soft}, {needed} needed")


def check_ports(settings: "Settings", user: int | None) -> Finding:
    """Check that the service can listen on the configured addresses.

    Parameters
    ----------
    settings : Settings
        All settings.
    user : int or None
        The process of a service that runs with this state. Its ports are not tried: they may be
        those of its command line.
    """
    wanted = _addresses(settings)
    named = ", ".join(one.name for one in wanted)
    if user is not None:
        return ok("ports", f"not checked because the service is running (process {user}): {named}")
    taken = [f"{one.name}: {why}" for one in wanted if (why := _obstacle(one))]
    if taken:
        return error(
            "ports", "; ".join(taken), "stop the other program, or choose another port or address"
        )
    return ok("ports", f"free: {named}" if wanted else "none needed")


class _Address(NamedTuple):
    # What it listens on.
    name: str
    kind: socket.SocketKind
    host: str
    port: int


def _addresses(settings: "Settings") -> list[_Address]:
    from multiradar.access.exposure import locator

    host, port = settings.server.host, settings.server.port
    found = [_Address(f"HTTP {host}:{port}", socket.SOCK_STREAM, host, port)]
    for endpoint in settings.zenoh.listen if settings.zenoh.enabled else ():
        known = locator(endpoint)
        protocol, _, address = known.partition("/")
        place, _, number = address.rpartition(":")
        if protocol in _PROTOCOLS and number.isdecimal():
            kind = _PROTOCOLS[protocol]
            found.append(_Address(f"Zenoh {known}", kind, place.strip("[]"), int(number)))
    found += [
        _Address(f"ASTERIX {one.address}:{one.port}", socket.SOCK_DGRAM, one.address, one.port)
        for one in settings.asterix.listen
    ]
    return found


# Why an address cannot be bound; empty if it can.
def _obstacle(one: _Address) -> str:
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(one.host, one.port, type=one.kind)[
            0
        ]
        with closing(socket.socket(family, kind, protocol)) as probe:
            if kind == socket.SOCK_STREAM:
                # As servers do: connections that have just been closed do not count.
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except OSError as failure:
        return failure.strerror or str(failure)
    return ""


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
