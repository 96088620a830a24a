"""The command line. Commands import heavy packages when they run, so that help comes at once."""

import atexit
import contextlib
import gc
import io
import sys
import warnings
from collections.abc import Iterator
from functools import cache
from typing import Any

from typer.main import get_command

from explore.base.errors import ConfigError, DoubtfulInputWarning, ExploreError, RequestError
from explore.cli.application import app
from explore.cli.options import name_options
from explore.cli.output import complain, say
from explore.cli.termination import keep_interrupts

#: Numbers of new objects, and of searches of younger ones, after which garbage is searched for.
_GARBAGE_THRESHOLDS = (100_000, 20, 10)


def _spare_garbage_collection() -> None:
    """Search rarely for garbage, and not at the end: imports leave 200,000 objects, hardly any of them garbage.

    Searching took a fifth of the time of a short command.
    """
    gc.set_threshold(*_GARBAGE_THRESHOLDS)
    atexit.register(gc.freeze)


def _prepare_streams() -> None:
    """Escape what a stream cannot encode: file names may hold any bytes, and a terminal may lack a letter."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed by the parent process
            setattr(sys, name, io.StringIO())
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


@contextlib.contextmanager
def _saying_doubts() -> Iterator[None]:
    """Print what may not be meant in a study or task as one line on stderr each, once."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", DoubtfulInputWarning)
        said: set[str] = set()
        show = warnings.showwarning

        def say_once(message: Warning | str, category: type[Warning], *place: Any, **options: Any) -> None:
            if not issubclass(category, DoubtfulInputWarning):
                show(message, category, *place, **options)
            elif str(message) not in said:
                said.add(str(message))
                say(f"warning: {message}", "yellow")

        warnings.showwarning = say_once
        yield


@cache
def command() -> Any:
    """The command `explore`; made once in a process, in 30 ms; tests call it thousands of times."""
    return get_command(app)


def main() -> None:
    """Run the command line; an error is one line on stderr, never a traceback."""
    _spare_garbage_collection()
    _prepare_streams()
    keep_interrupts()
    try:
        with _saying_doubts():
            command()()
    except (ConfigError, RequestError) as error:
        complain(name_options(str(error)))
        sys.exit(2)
    except ExploreError as error:
        complain(name_options(str(error)))
        sys.exit(1)
    except OSError as error:
        complain(f"{error.filename}: {error.strerror}" if error.filename else error.strerror or str(error))
        sys.exit(1)
    except MemoryError:
        complain("not enough memory")
        sys.exit(1)
    except Exception as error:
        complain(f"internal error: {type(error).__name__}: {error}; please report it")
        sys.exit(1)
