"""Whether another process would compute what this one would: equal versions, equal code, one BLAS thread.

Everything here runs on the workers of a cluster as well, so it imports little.
"""
# ruff: noqa: PLC0415

import hashlib
import platform
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, TypeVar

import numpy as np
import scipy

from figures.claims.errors import FigureError
from figures.engine import code, manifest

T = TypeVar("T")

Work = tuple[tuple[str, str, str], ...]
"""Figure id, module and world of everything that is to be computed."""

Identity = Mapping[str, str | None]
"""What there is by name: versions, digests of code, threads."""

SETUP = "pip install -c constraints.txt -e '.[dask]' in the same checkout, then start the worker again"
REMEDIES = {
    "python": "start the worker with this Python",
    "BLAS": "start the worker with OMP_NUM_THREADS=1",
    "code": "bring its checkout to this one's state, then start the worker again",
}

# ---------------------------------------------------------------- who we are


def identity(work: Work) -> Identity:
    """All that the bytes of a chunk depend on besides its job, in this process; BLAS keeps to one thread from here."""
    libraries = {"numpy": np.__version__, "scipy": scipy.__version__, "BLAS threads": _blas_threads()}
    return {**manifest.versions(["restir-ref"]), **libraries, **_code(work)}


@cache
def _code(work: Work) -> Mapping[str, str]:
    """Digests as first asked for: later changes of files do not reach modules that are loaded."""
    figures = {f"code of {id_}": code.digest(module, world) for id_, module, world in work}
    return {"code of the engine": code.digest("figures.engine.jobs", "restir_ref"), **figures}


def _blas_threads() -> str:
    """The largest number of threads of any BLAS here, after all were told to use one."""
    from threadpoolctl import threadpool_info, threadpool_limits

    threadpool_limits(1)  # not as a context: another thread of the worker may be at work
    return str(max((pool["num_threads"] for pool in threadpool_info()), default=1))


def arithmetic() -> str:
    """A digest of what exp, log, tan, pow and a matrix product return here: processors differ in the last bits."""
    x = np.linspace(0.1, 7.9, 4097)
    square = np.sin(x[:4096]).reshape(64, 64)
    values = (np.exp(x), np.log(x), np.tan(x), x**1.7, square @ square)
    return hashlib.sha256(b"".join(value.tobytes() for value in values)).hexdigest()[:16]


# ---------------------------------------------------------------- who they are


def strangers(client: Any, mine: Identity, work: Work) -> list[str]:
    """What is wrong with the workers, in words; Python first, whose other versions may not read our questions."""
    pythons = client.run(platform.python_version, on_error="return")
    found = {worker: {"python": version} for worker, version in pythons.items() if version != mine["python"]}
    found = found or client.run(identity, work, on_error="return")
    return [difference(worker, answer, mine) for worker, answer in found.items() if answer != mine]


def difference(worker: str, found: Any, mine: Identity) -> str:
    """In what a worker, by its answer, differs from this process, and the remedy."""
    if isinstance(found, Exception):
        return f"worker {worker} lacks something ({found}). Remedy there: {SETUP}"
    names = [name for name in found if found[name] != mine.get(name)]
    values = [f"{name} is {found[name]} there and {mine.get(name)} here" for name in names]
    remedies = dict.fromkeys(REMEDIES.get(name.partition(" ")[0], SETUP) for name in names)
    return f"worker {worker} would not compute the same bytes: {few(values)}. Remedy there: {'; '.join(remedies)}"


def refuse(found: list[str]) -> None:
    """Raise FigureError if there are strangers."""
    if found:
        raise FigureError(few(found))


def few(words: list[str]) -> str:
    """The first three, and how many more there are."""
    return "; ".join(words[:3]) + (f"; and {len(words) - 3} more" if len(words) > 3 else "")


def other_processors(client: Any) -> list[str]:
    """The workers whose arithmetic differs from ours in the last bits."""
    mine = arithmetic()
    return [worker for worker, bits in client.run(arithmetic, on_error="return").items() if bits != mine]


def checked(expected: Identity, work: Work, fn: Callable[..., T], *args: Any) -> T:
    """fn(*args), on a worker that is like the client; one that joined late may not be."""
    found = identity(work)
    if found != expected:
        from distributed import get_worker

        raise FigureError(difference(get_worker().address, found, expected))
    return fn(*args)
