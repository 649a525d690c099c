"""Where the pages lie that reports and help texts name: `docs/` of a checkout, inside the package after a wheel."""

from pathlib import Path

INSIDE = Path(__file__).parents[1] / "docs"
"""What pyproject.toml copies into the wheel."""

BESIDE = Path(__file__).parents[2] / "docs"
"""The checkout's, where the package is installed as it stands."""


def page(name: str) -> Path:
    """The file of a page such as `audit.md`, whether or not there is one."""
    return (INSIDE if INSIDE.is_dir() else BESIDE) / name
