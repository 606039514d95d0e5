"""Cache of compiled kernels: one folder for each state of their sources.

The command, `make`, and programs that import the package use the same folder, whichever checkout or
installation they run from. `NUMBA_CACHE_DIR` selects another parent folder. Functions of other
packages keep numba's own cache.
"""

import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
from llvmlite import binding
from numba.core import caching
from numba.core import config as numba_config

from multiradar_compiled.sources import package_folders, sources_digest

_VARIABLE = "NUMBA_CACHE_DIR"
_PREFIX = "kernels-"
#: Number of other states to keep: a few revisions, or versions installed side by side.
_OTHERS_KEPT_MAX = 5


def cache_folder(environment: Mapping[str, str], state: str) -> Path | None:
    """Return the folder of compiled kernels; it is created if necessary.

    Parameters
    ----------
    environment : mapping
        Environment variables: `NUMBA_CACHE_DIR`, else `XDG_CACHE_HOME`, else `HOME` give the parent
        folder.
    state : str
        State of the sources, used as folder name.

    Returns
    -------
    Path or None
        None if no folder is writable by this user alone. With a read-only home the system's
        temporary folder is used.
    """
    for place in _places(environment):
        folder = place / f"{_PREFIX}{state}"
        try:
            is_new = not folder.exists()
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            # Cached code is executed: no other user may have written it.
            ours = folder.stat().st_uid == folder.parent.stat().st_uid == os.getuid()
            if not ours or not os.access(folder, os.W_OK):
                continue
            if is_new:
                _remove_oldest(place)
            else:
                os.utime(folder)
        except OSError:
            continue
        return folder
    return None


@cache
def kernel_folder() -> Path | None:
    """Return the folder of this process; None if there is none, and kernels are not cached."""
    made_with = f"{sys.version} {numba.__version__} {llvmlite.__version__} {_processor()}"
    digest = hashlib.sha256(made_with.encode()).hexdigest()[:8]
    return cache_folder(os.environ, f"{sources_digest(package_folders())}-{digest}")


def _processor() -> str:
    config: Any = numba_config
    # As selected by numba; a home may be shared between machines.
    name = config.CPU_NAME or binding.get_host_cpu_name()
    features = config.CPU_FEATURES
    return f"{name} {binding.get_host_cpu_features().flatten() if features is None else features}"


def _places(environment: Mapping[str, str]) -> list[Path]:
    if chosen := environment.get(_VARIABLE):
        return [Path(chosen)]
    home = environment.get("HOME")
    parent = environment.get("XDG_CACHE_HOME") or (f"{home}/.cache" if home else None)
    parents = [parent] if parent else []
    return [Path(one) / f"multiradar-{os.getuid()}" for one in (*parents, tempfile.gettempdir())]


def _remove_oldest(place: Path) -> None:
    folders = [folder for folder in place.glob(f"{_PREFIX}*") if folder.is_dir()]
    folders.sort(key=lambda folder: folder.stat().st_mtime, reverse=True)
    for folder in folders[_OTHERS_KEPT_MAX + 1 :]:
        shutil.rmtree(folder, ignore_errors=True)


class _Locator(caching._CacheLocator):
    # A folder per module; stale entries are in another parent folder.
    def __init__(self, function: Callable[..., object], file: str) -> None:
        self._line = function.__code__.co_firstlineno
        self._module = function.__module__
        self._folder = kernel_folder()
        if self._module.partition(".")[0] not in package_folders():
            # Kernels of tests and scripts depend on the same packages, and on their own file.
            self._module += "-" + sources_digest(package_folders(), [Path(file)])

    def get_cache_path(self) -> str:
        assert self._folder is not None
        return str(self._folder / self._module)

    def get_source_stamp(self) -> str:
        return ""

    def get_disambiguator(self) -> str:
        return str(self._line)

    @classmethod
    def from_function(cls, py_func: Callable[..., object], py_file: str) -> "_Locator":
        return cls(py_func, py_file)


class _Entries(caching.CompileResultCacheImpl):
    _locator_classes = [_Locator]  # noqa: RUF012  # as numba declares it


class KernelCache(caching.FunctionCache):
    """Cache of a kernel in `kernel_folder`.

    Parameters
    ----------
    function : callable
        The Python function of the kernel.
    form : str
        Suffix of its entries, which distinguishes forms of one function.
    """

    _impl_class = _Entries

    def __init__(self, function: Callable[..., object], form: str) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]  # numba's
        self._cache_file = caching.IndexDataCacheFile(  # type: ignore[no-untyped-call]  # as above
            self._cache_path, self._impl.filename_base + form, self._impl.locator.get_source_stamp()
        )


def keep_in_folder(dispatcher: Any, form: str = "") -> None:
    """Cache the compiled code of a function in `kernel_folder`.

    Parameters
    ----------
    dispatcher : numba dispatcher, or a function with NUMBA_DISABLE_JIT=1
        Not yet compiled.
    form : str
        Suffix of the entries, for a function compiled in several forms.
    """
    if kernel_folder() is not None and hasattr(dispatcher, "py_func"):
        dispatcher._cache = KernelCache(dispatcher.py_func, form)
