"""The command ``alignscores``, also as ``python -m alignscores``."""

import sys

try:
    import signal
except KeyboardInterrupt:
    sys.exit(130)


def command() -> int:
    """Run the command line of this process; Ctrl-C ends it as the shell expects, at any moment."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not ignored
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from .cli import main  # only now, since an interrupted import shows a traceback

    return main()


if __name__ == "__main__":
    sys.exit(command())
