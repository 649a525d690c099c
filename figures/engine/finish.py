"""From stored chunks to results: combine, judge, draw, and keep everything in the figure's folder."""

import traceback
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from figures.claims.criteria import Void
from figures.claims.figure import Arrays, Claim, Figure, undeclared
from figures.claims.ledger import Row
from figures.claims.verdicts import Record
from figures.engine import disk, record, store
from figures.engine.plan import Plan, arms, arrays_path, key, read_chunks

Draw = Callable[[Figure, Arrays], Mapping[str, bytes]]
"""A figure and its arrays -> files of pictures by name; drawing is nothing the engine knows."""


def finish(plan: Plan, ledger: Mapping[str, Row], draw: Draw) -> Record:
    """Make the figure from its chunks; an exception of its own functions becomes a crashed record."""
    chunks = read_chunks(plan)
    try:
        refuse_void(plan, chunks)
        arrays = store.plain(plan.figure.combine(plan.data, chunks))
        claims = judged(plan, arrays)
        pictures = draw(plan.figure, arrays)
    except Exception:
        return crash(plan, ledger, traceback.format_exc())
    store.save(arrays_path(plan), arrays, key(plan))
    for name, content in pictures.items():
        disk.write_bytes(plan.folder / name, content)
    return _kept(plan, record.record(plan, claims, ledger))


def refuse_void(plan: Plan, chunks: Sequence[Arrays]) -> None:
    """Raises Void where two arms of a comparison, given the same random numbers, found the same to the last bit."""
    for number, mine in enumerate(chunks):
        for other in (k for k in arms(plan, number) if k < number and same(mine, chunks[k])):
            one, two = (store.canonical(plan.parts[k]) for k in (other, number))
            raise Void(
                f"{plan.figure.id}: chunks {one} and {two} are bitwise equal on common random numbers, so that nothing "
                "is compared. Choose a scene or a view in which they differ, or leave the comparison out."
            )


def same(one: Arrays, other: Arrays) -> bool:
    """Whether all that both found, single numbers such as costs aside, is bitwise equal."""
    names = [name for name in one.keys() & other.keys() if one[name].size > 1]
    return bool(names) and all(np.array_equal(one[name], other[name]) for name in names)


def crash(plan: Plan, ledger: Mapping[str, Row], trouble: str) -> Record:
    """Keep the record of a figure that crashed."""
    return _kept(plan, record.record(plan, (), ledger, trouble))


def _kept(plan: Plan, found: Record) -> Record:
    record.write(found, plan.folder)
    return found


def judged(plan: Plan, arrays: Arrays) -> Sequence[Claim]:
    """The figure's claims, which must be those it declares."""
    claims = tuple(plan.figure.check(arrays))
    problem = undeclared(plan.figure, claims)
    if problem:
        raise ValueError(f"figure {plan.figure.id} {problem}")
    return claims
