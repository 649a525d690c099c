"""Chunks as pure jobs behind one parallel interface, `concurrent.futures.Executor`.

A job carries everything its result depends on, so any executor returns the same bytes in any order.
"""

import importlib
import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from multiprocessing import resource_tracker
from typing import Any, ParamSpec, TypeVar
from zlib import crc32

import numpy as np

from figures.claims.figure import Arrays, Data
from figures.engine.store import plain

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True)
class Job:
    """Chunk `number` of the figure in `module`: its parameters, and the root seed and number of its stream."""

    module: str
    figure: str
    preset: Data
    number: int
    chunk: Data
    seed: int
    stream: int


@dataclass(frozen=True)
class Result:
    """The arrays of a job, or the traceback of what went wrong (empty if nothing did)."""

    job: Job
    arrays: Arrays
    seconds: float
    traceback: str = ""


def stream(seed: int, figure: str, number: int) -> np.random.Generator:
    """A random stream, a function of (root seed, figure id, number) alone."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(crc32(figure.encode()), number)))


def run(job: Job) -> Result:
    """Compute one chunk; an exception becomes a traceback, so that nothing exotic crosses processes."""
    start = time.perf_counter()
    try:
        compute = importlib.import_module(job.module).FIGURE.compute
        arrays = plain(compute(job.preset, job.chunk, rng=stream(job.seed, job.figure, job.stream)))
    except Exception:
        return Result(job, {}, time.perf_counter() - start, traceback.format_exc())
    return Result(job, arrays, time.perf_counter() - start)


class SerialExecutor(Executor):
    """Runs each call at once, in this process."""

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """A future that is already done; Ctrl-C passes through."""
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


class Workers(ProcessPoolExecutor):
    """Spawned processes. Ctrl-C is blocked while they may be born: they inherit the block, it is not for them."""

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Queue the call; this is where a pool starts its processes."""
        if not hasattr(signal, "pthread_sigmask"):
            return super().submit(fn, *args, **kwargs)
        resource_tracker.ensure_running()  # it would lift the block if it had to be started below
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return super().submit(fn, *args, **kwargs)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def cores() -> int:
    """The cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def executor(jobs: int) -> Executor:
    """The executor of `jobs` workers: this process for one, spawned processes for more."""
    if jobs == 1:
        return SerialExecutor()
    context = multiprocessing.get_context("spawn")
    return Workers(jobs, mp_context=context, initializer=_worker)


class Lost(Exception):
    """Workers died with their chunks: the message says which and why, as far as it is known."""


KILLED = "a worker process was killed, perhaps for want of memory (fewer --jobs need less)"


@contextmanager
def pool(jobs: int) -> Iterator[Executor]:
    """The executor for a block of work; a block that ends in an error does not wait for chunks under way.

    Raises Lost for a killed worker process.
    """
    workers = executor(jobs)
    try:
        yield workers
    except BrokenExecutor as error:
        abandon(workers)
        raise Lost(KILLED) from error
    except BaseException:
        abandon(workers)
        raise
    workers.shutdown()


@dataclass(frozen=True)
class Crew:
    """Who computes the chunks: how many at a time, the executor for a block of work, and words for the manifest."""

    size: int
    pool: Callable[[], AbstractContextManager[Executor]]
    about: Mapping[str, Any] = field(default_factory=dict)


def crew(jobs: int) -> Crew:
    """Workers on this machine; 0 for all its cores."""
    size = jobs or cores()
    return Crew(size, partial(pool, size))


def completed(pool: Executor, work: Iterable[Job], window: int) -> Iterator[Result]:
    """Results in order of completion; `work` is read lazily, at most `window` jobs are under way."""
    queue = iter(work)
    pending: set[Future[Result]] = {pool.submit(run, job) for job in islice(queue, window)}
    while pending:
        done, pending = wait(pending, return_when=FIRST_COMPLETED)
        for future in sorted(done, key=_failed):  # a killed worker must not hide what the others finished
            yield future.result()
        pending |= {pool.submit(run, job) for job in islice(queue, len(done))}


def _failed(future: Future[Result]) -> bool:
    return future.exception() is not None


def abandon(pool: Executor) -> None:
    """Drop the pool without waiting for chunks under way; its workers, our own children, are terminated."""
    pool.shutdown(wait=False, cancel_futures=True)
    for child in multiprocessing.active_children():
        child.terminate()


def _worker() -> None:
    """Prepare a worker: Ctrl-C is the parent's business, and no worker outlives a parent that was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_die_with_parent, daemon=True).start()


def _die_with_parent() -> None:
    parent: Any = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
