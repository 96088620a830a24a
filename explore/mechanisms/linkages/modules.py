"""Modules of generated text: compiled by Numba and cached on disk in a folder of the user's own.

The text is always that of this process: a file of the cache only gives Numba the place of its own files, which hold for
a content of the text and of what it imports. A folder that others can write is not used.
"""

import hashlib
import linecache
import os
import stat
import sys
import tempfile
import threading
from functools import cache
from importlib.abc import InspectLoader
from importlib.machinery import ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from types import CodeType, ModuleType

#: Largest number of modules that are kept, on disk and in memory; the least recently used ones go.
MOST_MODULES = 256
#: The modules in memory by their texts, the least recently used one first.
_MODULES: dict[str, ModuleType] = {}
#: Held while modules come and go.
_LOCK = threading.Lock()


def load_module(text: str) -> ModuleType:
    """The module of a text, whose functions Numba finds in its cache where they were compiled before."""
    with _LOCK:
        _MODULES[text] = module = _MODULES.pop(text, None) or _load(text)
        while len(_MODULES) > MOST_MODULES:
            oldest = _MODULES.pop(next(iter(_MODULES)))
            sys.modules.pop(oldest.__name__, None)
            linecache.cache.pop(str(oldest.__file__), None)
    return module


def _load(text: str) -> ModuleType:
    name = f"linkage_{hashlib.sha256(text.encode()).hexdigest()[:32]}"
    path = _folder() / f"{name}.py"
    _write(path, text)
    loader = _TextLoader(text, str(path))
    module = module_from_spec(ModuleSpec(name, loader, origin=str(path)))
    module.__file__ = str(path)
    sys.modules[name] = module  # where Numba looks for what its cache names
    loader.exec_module(module)
    linecache.cache[str(path)] = (len(text), None, text.splitlines(keepends=True), str(path))
    return module


class _TextLoader(InspectLoader):
    """A loader of a text that was made in this process; the file has the same one."""

    def __init__(self, text: str, path: str) -> None:
        self._text, self._path = text, path

    def get_source(self, fullname: str) -> str:  # noqa: ARG002  (the signature is Python's)
        """The text."""
        return self._text

    def get_code(self, fullname: str) -> CodeType:  # noqa: ARG002  (likewise)
        """The code of the text, with the path of the file."""
        return self.source_to_code(self._text, self._path)


def _write(path: Path, text: str) -> None:
    """Write the text unless it is there, at once, so that no other process reads a part of it."""
    try:
        if path.read_text() == text:
            os.utime(path)
            return
    except (OSError, UnicodeDecodeError):
        pass
    _prune(path.parent)
    with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".part", delete=False) as file:
        file.write(text)
    Path(file.name).replace(path)


def _prune(folder: Path) -> None:
    """Remove the modules that were not used for longest, with what Numba compiled of them."""
    modules = []
    for path in folder.glob("linkage_*.py"):
        try:
            modules.append((path.stat().st_mtime, path))
        except OSError:
            continue  # another process removed it
    for _, path in sorted(modules)[: max(len(modules) - MOST_MODULES + 1, 0)]:
        for each in (path, *folder.glob(f"**/{path.stem}.*")):
            each.unlink(missing_ok=True)


@cache
def _folder() -> Path:
    """The folder of the cache; one for this process alone where none can be had."""
    home = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    folder = Path(home).expanduser() / "explore" / "linkages"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.stat()
        is_own = status.st_uid == os.getuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
        if is_own and os.access(folder, os.W_OK):
            return folder
    except (OSError, RuntimeError):
        pass
    return Path(tempfile.mkdtemp(prefix="explore-linkages-"))
