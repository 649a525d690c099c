"""The same chunks on a Dask cluster that is already there: `python -m figures run --dask ADDRESS`.

Nothing is computed before every worker has shown that it would compute what this process would (`preflight`).
Every job asks again, for workers that join later.
"""
# ruff: noqa: PLC0415

import asyncio
import logging
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, InvalidStateError
from contextlib import closing, contextmanager, suppress
from functools import partial
from typing import Any, ParamSpec, TypeVar

from figures.claims.errors import FigureError
from figures.claims.figure import Entry
from figures.engine import preflight
from figures.engine.jobs import Crew, Lost
from figures.engine.preflight import Identity, Work

P = ParamSpec("P")
T = TypeVar("T")
Say = Callable[[str], object]

TIMEOUT = 10.0  # seconds until a scheduler that does not answer, or has no worker, is an error
PATIENCE = 60.0  # seconds to wait for new workers when all are gone
GLANCE = 1.0  # seconds between looks at who is there

# ---------------------------------------------------------------- before any work


@contextmanager
def crew(address: str, entries: Iterable[Entry], say: Say) -> Iterator[Crew]:
    """The workers of the cluster at `address`, each found to compute what this process would.

    Raises FigureError if dask is missing, if nobody answers, if there are no workers, and for a worker that
    would compute something else.
    """
    work = tuple((entry.figure.id, entry.module, entry.figure.world) for entry in entries)
    with _connection(address) as client:
        threads = _workers(client, address)
        say(f"asking every worker of {address} for its versions")
        mine = preflight.identity(work)
        preflight.refuse(preflight.strangers(client, mine, work))
        other = preflight.other_processors(client)
        if other:
            say(f"{', '.join(other)}: another kind of processor, whose results agree to rounding, not byte for byte")
        yield Crew(sum(threads.values()), partial(_pool, client, mine, work, say), {"dask": address})


@contextmanager
def _connection(address: str) -> Iterator[Any]:
    """A client that keeps its log lines to itself: what matters of them is said in words."""
    try:
        import threadpoolctl  # noqa: F401
        from distributed import Client
    except ImportError as error:
        raise FigureError(f"--dask needs a package that is not installed ({error}): pip install '.[dask]'") from error
    with _quiet():
        try:
            asyncio.run(_knock(address))
        except (OSError, ValueError) as error:
            raise FigureError(
                f"--dask {address}: no Dask scheduler answers there within {TIMEOUT:g} s ({error}). "
                "Start one with `dask scheduler`, which tells its address"
            ) from error
        with closing(Client(address, timeout=TIMEOUT, set_as_default=False, name="restir-ref")) as client:
            yield client


async def _knock(address: str) -> None:
    """Open a connection and close it: a Client that cannot connect is not safe to throw away."""
    from distributed import Security
    from distributed.comm import connect

    comm = await connect(address, timeout=TIMEOUT, **Security().get_connection_args("client"))
    await comm.close()


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence the loggers of `distributed` for a while."""
    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.client")]
    levels = [logger.level for logger in loggers]
    try:
        for logger in loggers:
            logger.setLevel(logging.CRITICAL + 1)
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def _workers(client: Any, address: str) -> dict[str, int]:
    """Threads by worker; there must be at least one."""
    try:
        client.wait_for_workers(1, timeout=TIMEOUT)
    except TimeoutError as error:
        raise FigureError(
            f"--dask {address}: the cluster has no workers. Start some in this checkout: dask worker {address}"
        ) from error
    return dict(client.nthreads())


# ---------------------------------------------------------------- at work


class ClusterExecutor(Executor):
    """The client's executor; its futures fail with Lost where the cluster lost a job for good."""

    def __init__(self, client: Any, expected: Identity, work: Work, say: Say) -> None:
        self._client, self._say = client, say
        self._inner = client.get_executor(pure=False)
        self._checked = partial(preflight.checked, expected, work)
        self._pending: set[Future[Any]] = set()
        self._over = threading.Event()
        threading.Thread(target=self._watch, name="restir-ref-cluster", daemon=True).start()

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Queue the call on the cluster."""
        ours: Future[T] = Future()
        self._pending.add(ours)
        ours.add_done_callback(self._pending.discard)
        theirs = self._inner.submit(self._checked, partial(fn, **kwargs), *args)
        theirs.add_done_callback(partial(_hand_over, ours))
        return ours

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: FBT001, FBT002
        """Leave the cluster; without waiting, what is under way there ends unheard."""
        self._over.set()
        with suppress(Exception):  # there may be no scheduler any more
            self._inner.shutdown(wait=wait and not cancel_futures)

    def _watch(self) -> None:
        """Tell of workers that are lost; give up when all are and none has come for a while."""
        there, alone = self._present(set()), 0.0
        while not self._over.wait(GLANCE):
            now = self._present(there)
            for worker in sorted(there - now):
                self._say(f"worker {worker} of the cluster is lost: others take over its chunks")
            if there and not now:
                self._say(f"the cluster has no workers left: waiting {PATIENCE:g} s for new ones")
            there, alone = now, 0.0 if now else alone + GLANCE
            if alone > PATIENCE:
                self._give_up("the cluster has no workers left")

    def _present(self, before: set[str]) -> set[str]:
        try:
            return set(self._client.nthreads())
        except Exception:  # a scheduler that is gone cancels all futures by itself
            return before

    def _give_up(self, words: str) -> None:
        for future in list(self._pending):
            _fail(future, Lost(words))


def _hand_over(ours: Future[Any], theirs: Future[Any]) -> None:
    """Pass on a result, or what went wrong in words."""
    if theirs.cancelled():
        _fail(ours, Lost("the scheduler of the cluster is gone"))
        return
    error = theirs.exception()
    if error is not None:
        _fail(ours, Lost(_words(error)))
        return
    with suppress(InvalidStateError):  # we gave up on it already
        ours.set_result(theirs.result())


def _words(error: BaseException) -> str:
    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return f"a chunk killed {error.allowed_failures + 1} workers of the cluster, perhaps for want of memory"
    return str(error) if isinstance(error, FigureError) else f"the cluster failed: {type(error).__name__}: {error}"


def _fail(future: Future[Any], error: Exception) -> None:
    with suppress(InvalidStateError):
        future.set_exception(error)


@contextmanager
def _pool(client: Any, expected: Identity, work: Work, say: Say) -> Iterator[Executor]:
    """The executor for a block of work; nothing is waited for at its end."""
    executor = ClusterExecutor(client, expected, work, say)
    try:
        yield executor
    finally:
        executor.shutdown(wait=False)
