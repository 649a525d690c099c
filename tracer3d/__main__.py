"""`python -m tracer3d`."""

import sys

from tracer3d.cli import main

if __name__ == "__main__":
    sys.exit(main())
