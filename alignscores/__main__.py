"""``python -m alignscores`` is the command ``alignscores``."""

import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main())
