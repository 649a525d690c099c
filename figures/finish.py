"""From stored chunks to results: combine, judge, draw, and keep everything in the figure's folder."""

import traceback
from collections.abc import Mapping, Sequence

from figures import disk, record, store, style
from figures.figure import Arrays, Claim, undeclared, verdict_line
from figures.ledger import Row
from figures.plan import Plan, arrays_path, key, read_chunks
from figures.record import Record


def finish(plan: Plan, ledger: Mapping[str, Row]) -> Record:
    """Make the figure from its chunks; an exception of its own functions becomes a crashed record."""
    chunks = read_chunks(plan)
    try:
        arrays = store.plain(plan.figure.combine(plan.data, chunks))
        claims = judged(plan, arrays)
        pictures = drawn(plan, arrays, claims)
    except Exception:
        return crash(plan, ledger, traceback.format_exc())
    store.save(arrays_path(plan), arrays, key(plan))
    for name, content in pictures.items():
        disk.write_bytes(plan.folder / name, content)
    return _kept(plan, record.record(plan, claims, ledger))


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


def drawn(plan: Plan, arrays: Arrays, claims: Sequence[Claim]) -> dict[str, bytes]:
    """The picture as PNG and PDF, each with the verdicts at its foot."""
    lines = [verdict_line(claim) for claim in claims]
    with style.context():
        picture = plan.figure.draw(arrays)
        return {f"figure.{kind}": style.render(picture, lines, kind) for kind in style.METADATA}
