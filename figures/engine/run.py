"""One run: compute the chunks that are missing, finish the figures that are complete, report.

Every chunk is stored once it is done: whatever ends a run early, the same command goes on from there.  The report is
written at once, and again while figures finish, as far as that takes little of the time.
"""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from figures.claims.figure import Entry
from figures.claims.ledger import Row
from figures.claims.verdicts import Judged
from figures.engine import audit, jobs, outdir, plan, session, store
from figures.engine.finish import crash, finish
from figures.engine.progress import Progress, Sparing
from figures.engine.session import Request, Session

RESUME = "What was computed is stored: the same command goes on from there"


@dataclass(frozen=True)
class Ending:
    """How the work ended: in words, and the exit status if it ended early (0 if not)."""

    words: str = "finished"
    status: int = 0


def run(
    request: Request, ledger: Mapping[str, Row], registry: Mapping[str, Entry], paper: Path, progress: Progress
) -> tuple[int, list[Judged]]:
    """Run the request; return the exit status and the verdicts of everything stored in the folder.

    `paper` is the file of the kept runs of the paper preset, with which all is compared.
    """
    with outdir.opened(request.out, registry, progress.say):
        mine = session.begin(request, ledger, progress.say)
        ending = _work(mine, progress)
        session.note(mine, ending.words)
        judged = request.press.report(request.out)
    if ending.status:
        progress.say(f"{ending.words}. {RESUME}")
    unfit = any(audit.misfits(request.out, ledger, registry, paper))
    return ending.status or _status(mine, judged) or int(unfit), judged


def _work(mine: Session, progress: Progress) -> Ending:
    """Compute and finish."""
    total = sum(len(numbers) for numbers in mine.missing.values())
    news = Sparing(partial(_report, mine))
    try:
        _report(mine)
        with progress.bar(total):
            for id_ in mine.plans:
                if _finish_if_complete(mine, id_, progress):
                    news()
            if total:
                _compute(mine, progress, news)
    except KeyboardInterrupt:
        return Ending("interrupted", 130)
    except jobs.Lost as lost:
        return Ending(str(lost), 1)
    return Ending()


def _report(mine: Session) -> None:
    """The report of what is there so far."""
    session.note(mine, "running")
    mine.request.press.report(mine.request.out)


def _compute(mine: Session, progress: Progress, news: Callable[[], object]) -> None:
    crew = mine.request.crew
    with crew.pool() as pool:
        for result in jobs.completed(pool, _queue(mine), window=1 if crew.size == 1 else 2 * crew.size):
            _take(mine, result, progress)
            if _finish_if_complete(mine, result.job.figure, progress):
                news()


def _queue(mine: Session) -> Iterator[jobs.Job]:
    """The missing chunks, figure by figure; a figure that has crashed by then is passed over."""
    for id_, numbers in mine.missing.items():
        for number in sorted(numbers):
            if id_ not in mine.records:
                yield plan.job(mine.plans[id_], number)


def _take(mine: Session, result: jobs.Result, progress: Progress) -> None:
    """Store a chunk, or note that its figure crashed."""
    id_, number = result.job.figure, result.job.number
    here = mine.plans[id_]
    mine.seconds[id_] += result.seconds
    if result.traceback:
        trouble = f"chunk {number}, {store.canonical(result.job.chunk)}:\n{result.traceback}"
        mine.records[id_] = crash(here, mine.ledger, trouble)
        progress.say(f"{id_} crashed in chunk {number + 1} of {len(here.parts)}")
    else:
        store.save(plan.chunk_path(here, number), result.arrays, plan.chunk_key(here, number))
        mine.missing[id_].discard(number)
        progress.step(f"{id_} chunk {number + 1} of {len(here.parts)}")


def _finish_if_complete(mine: Session, id_: str, progress: Progress) -> bool:
    """Whether the figure has become complete, and so was finished."""
    here, start = mine.plans[id_], time.perf_counter()
    if id_ in mine.records or mine.missing[id_]:
        return False
    draw = mine.request.press.draw
    found = crash(here, mine.ledger, here.trouble) if here.trouble else finish(here, mine.ledger, draw)
    mine.records[id_] = found
    mine.seconds[id_] += time.perf_counter() - start
    progress.say(f"{id_} {found.status} ({mine.reused[id_]} of {len(here.parts)} chunks reused)")
    return True


def _status(mine: Session, judged: list[Judged]) -> int:
    """1 if a figure of this run crashed or one of its verdicts is not the expected one, else 0."""
    crashed = any(found.status == "crashed" for found in mine.records.values())
    differs = any(row.agrees is False and set(row.figures) & set(mine.plans) for row in judged)
    return int(crashed or differs)
