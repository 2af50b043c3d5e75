"""The entry point of the shell, and `python -m vegglue`. Ctrl-C is one sentence while libraries load, too."""

import signal
import sys


def enter() -> None:
    """Run the command of the shell."""
    try:
        from vegglue.cli.main import main

        main()
    except KeyboardInterrupt:
        print("Stopped; solved members and finished steps are kept: run the same command again.", file=sys.stderr)
        sys.exit(130)
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # from here on Python only takes down what it has put up


if __name__ == "__main__":
    enter()
