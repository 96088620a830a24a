"""`explore init`."""

import shlex
from pathlib import Path

from explore.cli.output import compiled_kernels, say
from explore.errors import RequestError


def write_starter(path: Path, mechanism: str) -> None:
    """Write the starter config of a mechanism; an existing file is kept."""
    with compiled_kernels():
        from explore.config.study_file import starter
        from explore.request.requests import find_mechanism
    text = starter(find_mechanism(mechanism))
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise RequestError(f"{path} exists; name another file") from None
    say(f"wrote {path}; now run: {shlex.join(['explore', 'sweep', str(path)])}")
