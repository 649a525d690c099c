"""`python -m figures`."""

import sys

try:
    from figures.cli import main
except ModuleNotFoundError as missing:
    sys.exit(f"{missing}: run `make setup` and `. .venv/bin/activate` first, or use .venv/bin/python.")

if __name__ == "__main__":
    sys.exit(main())
