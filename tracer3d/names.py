"""Names that are not there, and the nearest one that is."""

from collections.abc import Mapping
from difflib import get_close_matches
from typing import TypeVar

Member = TypeVar("Member")


def known(family: Mapping[str, Member], name: str, what: str) -> Member:
    """family[name].  Raises ValueError with the nearest name, or else with all of them."""
    if name in family:
        return family[name]
    near = get_close_matches(name, family, n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(family) or 'none'}."
    raise ValueError(f"there is no {what} {name[:80]!r}: {hint}")
