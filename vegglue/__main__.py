"""The entry point of the shell, and `python -m vegglue`. Ctrl-C is one sentence while libraries load, too."""

import gc
import signal
import sys

# Objects [-] after whose number the rubbish among them is looked for; Python's 700 walks through all that the libraries
# keep six times a diagnosis, for 0.45 s. With 20,000 nothing more is won; memory is the same within 3 %.
OBJECTS_BETWEEN_COLLECTIONS = 5_000


def enter() -> None:
    """Run the command of the shell."""
    gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS)
    try:
        from vegglue.cli.main import main

        main()
    except KeyboardInterrupt:
        from vegglue.wording.commands import LAST_WORDS

        print(LAST_WORDS["stopped"], file=sys.stderr)
        sys.exit(130)
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # from here on Python only takes down what it has put up


if __name__ == "__main__":
    enter()
