"""`python -m figures`."""

import sys

from figures.cli import main

if __name__ == "__main__":
    sys.exit(main())
