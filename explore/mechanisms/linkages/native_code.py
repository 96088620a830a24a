"""Functions in LLVM's language as arguments of compiled functions; their machine code is kept on disk.

A file of the cache has a checksum before the code, and its name is a digest of the text and of the processor that it
was translated for. The cache is a folder of the user's own; one that others can write is not used.
"""

import atexit
import os
import shutil
import stat
import tempfile
from collections.abc import Callable, Mapping
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from llvmlite import binding
from numba import config
from numba.core.compiler_lock import global_compiler_lock

from explore.base.compiling import FunctionArgument

#: Largest number of files that are kept; the least recently used ones go.
MOST_FILES = 768
#: Length of a checksum, bytes.
_CHECKSUM = 32
#: Effort of LLVM, from 0 to 3.
_EFFORT = 2
#: Largest number of lines of a text that is translated with effort: the time of longer ones grows faster than they do.
_MOST_LINES = 3000


class NativeFunction(FunctionArgument):
    """A function that compiled functions take as an argument, translated when one of them gets it first.

    Parameters
    ----------
    name, signature
        Its name in the text, and its signature.
    write
        Writes the text: all that the function depends on, but for what it calls.
    outer
        Gives the addresses of functions that it calls, by their names in the text.
    javascript
        Writes the function in JavaScript, for a page that needs it; see `explore.figures.reporting.javascript`.
    """

    def __init__(
        self, name: str, signature: str, write: Callable[[], str],
        outer: Callable[[str], Mapping[str, int]] = lambda _: {},
        javascript: Callable[[str, Callable[[Any], str]], str] | None = None,
    ) -> None:  # fmt: skip
        self.name, self.write, self.javascript = name, write, javascript
        super().__init__(signature)
        self._outer = outer
        self._engine: Any = None

    @global_compiler_lock  # type: ignore[untyped-decorator]  # likewise
    def __wrapper_address__(self) -> int:
        """The address of the machine code."""
        if self._engine is None:
            text = self.write()
            for name, place in self._outer(text).items():
                binding.add_symbol(name, place)
            self._engine = _load(_code_of(text))
        address: int = self._engine.get_function_address(self.name)
        return address


def _load(code: bytes) -> Any:
    """An owner of machine code that can be called."""
    engine = binding.create_mcjit_compiler(binding.parse_assembly(""), _machine(_EFFORT))
    engine.add_object_file(binding.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine


def _processor() -> tuple[str, str]:
    """Name and features of the processor to translate for, which Numba's environment variables may set."""
    if config.CPU_NAME is not None:
        return config.CPU_NAME, config.CPU_FEATURES or ""
    features = config.CPU_FEATURES
    return binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten() if features is None else features


def _machine(effort: int) -> Any:
    name, features = _processor()
    return binding.Target.from_default_triple().create_target_machine(name, features, opt=effort, jit=True)


def _code_of(text: str) -> bytes:
    """The machine code of a text: that of the cache, if it is there and whole."""
    effort = 0 if text.count("\n") > _MOST_LINES else _EFFORT
    version = repr((binding.llvm_version_info, binding.get_process_triple(), effort, *_processor()))
    path = _folder() / f"linkage_{sha256(f'{version}{text}'.encode()).hexdigest()[:32]}.o"
    try:
        content = path.read_bytes()
        if content[:_CHECKSUM] == sha256(content[_CHECKSUM:]).digest():
            os.utime(path)
            return content[_CHECKSUM:]
    except OSError:
        pass
    code: bytes = _machine(effort).emit_object(binding.parse_assembly(text))
    _write(path, sha256(code).digest() + code)
    return code


def _write(path: Path, content: bytes) -> None:
    """Write a file at once, so that no other process reads a part of it; where there is no room, there is none."""
    try:
        _prune(path.parent)
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as file:
            file.write(content)
        Path(file.name).replace(path)
    except OSError:
        pass


def _prune(folder: Path) -> None:
    """Remove the files that were not used for longest."""
    files = []
    for path in folder.iterdir():
        try:
            files.append((path.stat().st_mtime, path))
        except OSError:
            continue  # another process removed it
    for _, path in sorted(files)[: max(len(files) - MOST_FILES + 1, 0)]:
        path.unlink(missing_ok=True)


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
    folder = Path(tempfile.mkdtemp(prefix="explore-linkages-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
