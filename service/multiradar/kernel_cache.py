"""Where compiled kernels are kept: a folder for each state of their sources.

numba tells stale code by the file of the outermost function alone and does not see a change in a
file that function calls into. A folder named after the content of all kernel files cannot be
stale, whether the change came from an upgrade or from an editor.
"""

import hashlib
import os
import tempfile
from collections.abc import MutableMapping
from importlib.util import find_spec
from pathlib import Path

_VARIABLE = "NUMBA_CACHE_DIR"
_PACKAGES = ("multiradar", "multiradar_converters")


def choose_kernel_cache(environment: MutableMapping[str, str] = os.environ) -> None:
    """Set the cache folder in the environment, unless somebody chose one; before numba is loaded.

    Parameters
    ----------
    environment : mutable mapping
        Variables to set it in; `XDG_CACHE_HOME` and `HOME` say where caches go. Without a place
        that can be written, as in a read-only installation, the system's temporary folder is used.
    """
    if environment.get(_VARIABLE):
        return
    home = environment.get("HOME")
    cache = environment.get("XDG_CACHE_HOME") or (f"{home}/.cache" if home else None)
    places = [Path(cache)] if cache else []
    for place in [*places, Path(tempfile.gettempdir())]:
        folder = place / f"multiradar-{os.getuid()}" / f"kernels-{_state()}"
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            # Cached code is code: nobody else may have put it there.
            ours = folder.stat().st_uid == folder.parent.stat().st_uid == os.getuid()
        except OSError:
            continue
        if ours and os.access(folder, os.W_OK):
            environment[_VARIABLE] = str(folder)
            return


def _state() -> str:
    digest = hashlib.sha256()
    for package in _PACKAGES:
        spec = find_spec(package)
        for root in (spec.submodule_search_locations or []) if spec else []:
            for path in sorted(Path(root).rglob("*kernels.py")):
                digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
