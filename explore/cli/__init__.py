"""The command line. Heavy packages are imported by the commands that use them, so that help comes at once."""

import sys

from explore.cli.application import app
from explore.cli.output import complain
from explore.errors import ConfigError, ExploreError, RequestError

#: Exit codes, as the help of the program states them.
DONE, FAILED, BAD_USAGE, INCOMPLETE, INTERRUPTED = 0, 1, 2, 3, 130


def main() -> None:
    """Run the command line; whatever goes wrong on purpose is one clear line, never a traceback."""
    try:
        app(standalone_mode=True)
    except (ConfigError, RequestError) as error:
        complain(str(error))
        sys.exit(BAD_USAGE)
    except ExploreError as error:
        complain(str(error))
        sys.exit(FAILED)
    except BrokenPipeError:
        # The reader of our output has gone, as `head` does; nothing is wrong.
        sys.stderr.close()
        sys.exit(DONE)
    except OSError as error:
        complain(f"{error.filename or 'the system'}: {error.strerror or error}")
        sys.exit(FAILED)
