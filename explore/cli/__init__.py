"""The command line. Heavy packages are imported by the commands that use them, so that help comes at once."""

import io
import sys

from explore.cli.application import app
from explore.cli.output import complain
from explore.errors import ConfigError, ExploreError, RequestError


def _prepare_streams() -> None:
    """Let any text be printed: names of files need not be text, and not every terminal knows every letter."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed by whoever started us
            setattr(sys, name, io.StringIO())
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def main() -> None:
    """Run the command line; whatever goes wrong on purpose is one clear line, never a traceback."""
    _prepare_streams()
    try:
        app()
    except (ConfigError, RequestError) as error:
        complain(str(error))
        sys.exit(2)
    except ExploreError as error:
        complain(str(error))
        sys.exit(1)
    except OSError as error:
        complain(f"{error.filename}: {error.strerror}" if error.filename else error.strerror or str(error))
        sys.exit(1)
    except Exception as error:
        complain(f"this should not have happened: {type(error).__name__}: {error}; please report it")
        sys.exit(1)
