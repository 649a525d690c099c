"""Tables of a file, read by a declaration of their keys: whatever is wrong is named with its place."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from reprlib import Repr
from typing import Any

from tracer3d.names import known

MUST = object()
"""In place of a value for a key that has to be there."""

LARGEST, SMALLEST = 1e9, 1e-30
"""No number of a file is larger, and smaller ones are 0, so that products of some of them are numbers."""

SHORT = Repr()
SHORT.maxstring = SHORT.maxother = SHORT.maxlong = 60


@dataclass(frozen=True)
class Kind:
    """What a value must be, in words, and how it is read; `read` raises what `fields` turns into those words."""

    wanted: str
    read: Callable[[Any], Any]


@dataclass(frozen=True)
class Key:
    """What a key holds, and what is taken for it where it is missing."""

    kind: Kind
    otherwise: Any = MUST


def fields(table: Any, keys: Mapping[str, Key], where: str) -> dict[str, Any]:
    """The values of all `keys`.

    Raises ValueError, naming the place, for what is no table, unknown keys (with the nearest), missing ones, and values
    of another kind.
    """
    if not isinstance(table, dict):
        raise ValueError(f"{where} must be a table of keys, but is {SHORT.repr(table)}.")
    for name in table:
        at(where, known, keys, name, "key")
    for name, key in keys.items():
        if key.otherwise is MUST and name not in table:
            raise ValueError(f"{where}: the key {name!r} is missing; it must be {key.kind.wanted}.")
    return {name: _value(table[name], key.kind, f"{where}: {name}") if name in table else key.otherwise
            for name, key in keys.items()}  # fmt: skip


def at(where: str, work: Callable[..., Any], *arguments: Any) -> Any:
    """work(*arguments), whose ValueError is told with its place."""
    try:
        return work(*arguments)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from error


def _value(value: Any, kind: Kind, what: str) -> Any:
    try:
        return kind.read(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{what} must be {kind.wanted}, but is {SHORT.repr(value)}.") from None


# ---------------------------------------------------------------- kinds


def number(wanted: str, low: float = -LARGEST, high: float = LARGEST) -> Kind:
    """A number in [low, high]; neither NaN nor a truth value."""
    return Kind(wanted, lambda value: _number(value, low, high))


def whole(wanted: str, low: int, high: int) -> Kind:
    """An integer in [low, high]."""
    return Kind(wanted, lambda value: _whole(value, low, high))


def numbers(wanted: str, count: int, each: Kind) -> Kind:
    """A tuple of so many."""
    return Kind(wanted, lambda value: _tuple(value, count, each))


def either(wanted: str, first: Kind, second: Kind) -> Kind:
    """What the first kind reads, or else what the second one does."""

    def read(value: Any) -> Any:
        try:
            return first.read(value)
        except (TypeError, ValueError, OverflowError):
            return second.read(value)

    return Kind(wanted, read)


def grey_or_colour(wanted: str, high: float) -> Kind:
    """One number in [0, high] for all three channels, or three."""
    one = number("", 0.0, high)
    grey = Kind("", lambda value: (one.read(value),) * 3)
    return either(wanted, numbers("", 3, one), grey)


def _number(value: Any, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError
    x = float(value)
    if not low <= x <= high:
        raise ValueError
    return x if abs(x) > SMALLEST else 0.0


def _whole(value: Any, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise TypeError
    if not low <= value <= high:
        raise ValueError
    return value


def _tuple(value: Any, count: int, each: Kind) -> tuple[Any, ...]:
    if not isinstance(value, list) or len(value) != count:
        raise TypeError
    return tuple(each.read(part) for part in value)


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value.isprintable():
        raise TypeError
    return value


def _table(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise TypeError
    return value


def _tables(value: Any) -> Sequence[Any]:
    if not isinstance(value, list) or not all(isinstance(part, dict) for part in value):
        raise TypeError
    return value


TEXT = Kind("words in quotes, on one line", _text)
TABLE = Kind("a table of keys", _table)
TABLES = Kind("tables, each under a line with its name in double brackets", _tables)
POINT = numbers("three numbers", 3, number(""))
