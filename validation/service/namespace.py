"""A network namespace with the loopback interface only, for programs that start Ray."""

import os
import shutil
import subprocess
from collections.abc import Sequence

from multiradar.cluster.interfaces import addresses_of_host

#: Brings the interface up, then runs what follows.
_SCRIPT = 'ip link set lo up && exec "$@"'


def in_namespace(line: Sequence[str]) -> list[str]:
    """Return the command line that runs a command in a namespace of its own.

    Parameters
    ----------
    line : sequence of str
        The command and its arguments.

    Returns
    -------
    list of str
        As root with `unshare --net`, else in a user namespace as well.
    """
    own = [] if os.geteuid() == 0 else ["--map-root-user"]
    return ["unshare", "--net", *own, "sh", "-c", _SCRIPT, "sh", *line]


def why_no_namespace() -> str:
    """Return why this host cannot make such a namespace, empty if it can."""
    missing = [name for name in ("unshare", "ip") if shutil.which(name) is None]
    if missing:
        return f"{' and '.join(missing)} not found (util-linux, iproute2)"
    tried = subprocess.run(in_namespace(["true"]), capture_output=True, text=True, check=False)
    return tried.stderr.strip().splitlines()[-1] if tried.returncode else ""


def is_in_namespace() -> bool:
    """Return whether this process has the loopback interface only."""
    return set(addresses_of_host()) == {"lo"}
