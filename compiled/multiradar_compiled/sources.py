"""Source files compiled into kernels: modules of kernels and all modules they import.

numba checks only the file of the outermost function for changes. Functions and constants of other
files are compiled in as well, so the cache is named by all of them.
"""

import hashlib
import os
import re
from collections.abc import Iterable
from functools import cache
from importlib.util import find_spec
from pathlib import Path

#: The packages whose functions are compiled.
PACKAGES = ("multiradar", "multiradar_converters", "multiradar_compiled")

_KERNEL_FILES = "*kernels.py"
_FROM = re.compile(r"^\s*from\s+([\w.]+)\s+import\s+(\([^)]*\)|[^\n]*)", re.MULTILINE)
_IMPORT = re.compile(r"^\s*import\s+([\w.]+)", re.MULTILINE)
_NAME = re.compile(r"(\w+)(?:\s+as\s+\w+)?\s*(?:,|$|\))", re.MULTILINE)


@cache
def package_folders(packages: tuple[str, ...] = PACKAGES) -> dict[str, Path]:
    """Return the folder of each package; packages that are not installed are absent."""
    folders = {}
    for package in packages:
        spec = find_spec(package)
        if spec is not None and spec.submodule_search_locations:
            folders[package] = Path(spec.submodule_search_locations[0])
    return folders


def compiled_sources(folders: dict[str, Path], more: Iterable[Path] = ()) -> list[Path]:
    """Return the files whose content may be part of compiled code.

    Parameters
    ----------
    folders : dict of str to Path
        The packages, by name.
    more : iterable of Path
        Further files with kernels.

    Returns
    -------
    list of Path
        All modules of kernels of the packages, `more`, and what these import from the packages,
        directly or indirectly; sorted.
    """
    waiting = [path for folder in folders.values() for path in folder.rglob(_KERNEL_FILES)]
    waiting += more
    found, known = set(waiting), set[str]()
    while waiting:
        modules = _imported(waiting.pop().read_text(encoding="utf-8")) - known
        known |= modules
        for module in modules:
            for path in _files(module, folders):
                if path not in found:
                    found.add(path)
                    waiting.append(path)
    return sorted(found)


def sources_digest(folders: dict[str, Path], more: Iterable[Path] = ()) -> str:
    """Return a digest of the names and contents of `compiled_sources`, 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for path in compiled_sources(folders, more):
        digest.update(f"{path.name}\0{path.stat().st_size}\0".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _imported(text: str) -> set[str]:
    modules = set(_IMPORT.findall(text))
    for package, names in _FROM.findall(text):
        modules.add(package)
        modules.update(f"{package}.{name}" for name in _NAME.findall(names))
    return modules


# Each process looks for a thousand: texts take a fifth of the time that paths take.
def _files(module: str, folders: dict[str, Path]) -> Iterable[Path]:
    package, *parts = module.split(".")
    if package not in folders:
        return
    place = os.path.join(folders[package], *parts)
    for file in (f"{place}.py", os.path.join(place, "__init__.py")):
        if os.path.isfile(file):
            yield Path(file)
