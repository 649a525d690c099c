"""Harmless conventions: how engines write the same pass down.  They are settled before anything is called a mistake.

A convention is another reading of the fields, or another end of the pass that is as right.  Mistakes are then searched
for within the readings that fit best.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from types import MappingProxyType

import numpy as np

from restir_ref.audit.compare import Compute
from restir_ref.audit.engines import ASKED
from restir_ref.audit.load import Fields
from restir_ref.audit.mistakes import uncapped
from restir_ref.audit.recorded import BELOW_ONE, GIVEN, Pass, Terms
from restir_ref.batch import Array, ratio


@dataclass(frozen=True)
class Reading:
    """Names of the conventions in use, k, and the order of the inputs, if another one than in the dump."""

    names: tuple[str, ...] = ()
    k: float | None = None
    order: tuple[int, ...] = ()


@dataclass(frozen=True)
class Convention:
    """In words, whether a dump leaves it open, and what it changes: fields, or the end of the pass.

    It is tried where one of the terms that it touches is wrong without it.
    """

    about: str
    touches: frozenset[str]
    open_in: Callable[[Fields], bool]
    fields: Callable[[Fields], Fields]
    end: Callable[[Pass, Terms], Terms]


def as_it_is(found: Fields) -> Fields:
    """The same fields."""
    return found


def as_it_ends(p: Pass, terms: Terms) -> Terms:
    """The same end."""
    return terms


def capped_count(found: Fields) -> Array:
    """C = sum_j c_j with capped confidences, (N,)."""
    c = found["c"]
    canonical = found["canonical"][:, None] == 1
    return np.asarray(np.where(canonical, c, np.minimum(c, found.get("cap", np.inf))).sum(axis=0))


def divided(found: Fields) -> Fields:
    """m, w and w_sum over C."""
    C = capped_count(found)
    return {**found, **{name: ratio(found[name], C) for name in ("m", "w", "w_sum") if name in found}}


def mirrored(found: Fields) -> Fields:
    """1 - u for u."""
    names = [name for name in ("u", "u_stream") if name in found]
    return {**found, **{name: np.minimum(1 - found[name], BELOW_ONE) for name in names}}


def transposed(found: Fields) -> Fields:
    """[j][i] for [i][j]."""
    names = [name for name in ("p_hat_from", "p_hat_back", "J_back") if name in found]
    return {**found, **{name: found[name].swapaxes(0, 1) for name in names}}


def relative_cap(found: Fields) -> Fields:
    """The cap times the confidence of the canonical inputs."""
    own = found["c"][found["canonical"] == 1].sum(axis=0)
    c = np.where(found["canonical"][:, None] == 1, found["c"], np.minimum(found["c"], found["cap"] * own))
    return {**{name: values for name, values in found.items() if name != "cap"}, "c": c}


def _several(found: Fields) -> bool:
    """Neighbours whose number a dump does not give."""
    return len(found["p_hat"]) > 1


CHOSEN = frozenset(("s", "W_Y"))
DOWN = CHOSEN | {"p_hat_own", "p_hat_from", "p_hat_back", "J_back", "m", "w", "w_sum"}

CONVENTIONS: Mapping[str, Convention] = MappingProxyType(
    {
        "transposed": Convention(
            "densities are [j][i]: input j's for y_i stand in row j",
            DOWN,
            lambda found: _several(found) and bool({"p_hat_from", "p_hat_back"} & found.keys()),
            transposed,
            as_it_ends,
        ),
        "undivided": Convention(
            "m and w are not divided by C, the sum of the confidences; W_Y is",
            frozenset(("m", "w", "w_sum")),
            lambda found: bool({"m", "w", "w_sum"} & found.keys()),
            divided,
            as_it_ends,
        ),
        "mirrored": Convention(
            "the random numbers are used as 1 - u",
            CHOSEN,
            lambda found: bool({"u", "u_stream"} & found.keys()) and bool({"s", "W_Y"} & found.keys()),
            mirrored,
            as_it_ends,
        ),
        "relative cap": Convention(
            "the cap is a multiple of the canonical input's confidence",
            DOWN | {"c_Y"},
            lambda found: "cap" in found and bool((found["c"][found["canonical"] == 1] != 1).any()),
            relative_cap,
            as_it_ends,
        ),
        "c_Y capped": Convention(
            "c_Y = min(M_c, sum), as [GRIS 6.2] prints it",
            frozenset(("c_Y",)),
            lambda found: "c_Y" in found and "cap" in found,
            as_it_is,
            lambda p, terms: replace(terms, c_Y=np.minimum(terms.c_Y, p.cap)),
        ),
        "c_Y uncapped": Convention(
            "c_Y is the sum of the confidences before the cap",
            frozenset(("c_Y",)),
            lambda found: "c_Y" in found and "cap" in found,
            as_it_is,
            lambda p, terms: replace(terms, c_Y=uncapped(p)),
        ),
    }
)

MOST_ASKED = 32
"""As many neighbours asked for are tried."""


def readings(found: Fields, mis: str, wrong: Collection[str]) -> Iterator[Reading]:
    """All combinations of what the dump leaves open and what touches a wrong term, the fewest first; not the plain one.

    `wrong` are the terms that are wrong in the plain reading.
    """
    useful = {name: each for name, each in CONVENTIONS.items() if each.open_in(found) and each.touches & {*wrong}}
    names = [name for name in useful if mis != GIVEN or name in ("mirrored", "c_Y capped", "c_Y uncapped")]
    orders = [(), *_orders(found)] if "u_stream" in found and CHOSEN & {*wrong} else [()]
    for choice in sorted(product((0, 1), repeat=len(names)), key=sum):
        chosen = tuple(name for name, taken in zip(names, choice, strict=True) if taken)
        if not {"c_Y capped", "c_Y uncapped"} <= set(chosen):
            yield from (Reading(chosen, order=order) for order in orders if chosen or order)
    others = len(found["p_hat"]) - int(found["canonical"].sum())
    if mis in ASKED and "k" not in found and others and DOWN & {*wrong}:
        yield from (Reading((), float(k)) for k in range(1, MOST_ASKED + 1) if k != others)


def _orders(found: Fields) -> list[tuple[int, ...]]:
    """Canonical inputs last, and all from the last to the first."""
    ours = found["canonical"] == 1
    inputs = range(len(ours))
    last = tuple([i for i in inputs if not ours[i]] + [i for i in inputs if ours[i]])
    backwards = tuple(reversed(inputs))
    return [order for order in dict.fromkeys((last, backwards)) if order != tuple(inputs)]


def read_as(found: Fields, reading: Reading) -> Fields:
    """The fields as the pass has them."""
    for name in reading.names:
        if name in CONVENTIONS:
            found = CONVENTIONS[name].fields(found)
    if reading.k is not None:
        found = {**found, "k": np.asarray(reading.k)}
    return reordered(found, reading.order) if reading.order else found


def reordered(found: Fields, order: Sequence[int]) -> Fields:
    """The inputs in another order: the one in which they are offered."""
    at = np.asarray(order)
    new = {name: values[at] if name in BY_INPUT else values for name, values in found.items()}
    pairs = {name: found[name][at][:, at] for name in ("p_hat_from", "p_hat_back", "J_back") if name in found}
    chosen = {"s": np.argsort(at)[found["s"].astype(int)].astype(float)} if "s" in found else {}
    return {**new, **pairs, **chosen}


BY_INPUT = ("canonical", "p_hat", "W", "J", "c", "p_hat_own", "u_stream", "m", "w")


def ending(reading: Reading, compute: Compute) -> Compute:
    """A way to compute the pass, with the ends that the reading allows."""
    ends = [CONVENTIONS[name].end for name in reading.names if name in CONVENTIONS]
    if all(end is as_it_ends for end in ends):
        return compute

    def ended(p: Pass) -> Terms:
        terms = compute(p)
        for end in ends:
            terms = end(p, terms)
        return terms

    return ended


def in_words(reading: Reading) -> list[str]:
    """What the reading takes for granted."""
    said = [CONVENTIONS[name].about for name in reading.names if name in CONVENTIONS]
    asked = [f"k = {reading.k:g} neighbours were asked for, and are counted in the weights"] if reading.k else []
    order = [f"inputs are offered in the order {', '.join(map(str, reading.order))}"] if reading.order else []
    return said + asked + order
