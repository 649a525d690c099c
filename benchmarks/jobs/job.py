"""A job is chunks of work that are stored when done, and a judge: whatever ends a run, the next one goes on.

A chunk's random numbers come from a stream of its own, named by the job and the chunk's parameters.
Stored chunks count only while the code they were computed by is the same.
"""

import ast
import hashlib
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from time import process_time
from typing import Any, Protocol

import numpy as np
from tqdm import tqdm

from figures.claims.figure import Arrays
from figures.engine import disk, store, syntax

ROOT = Path(__file__).parents[2]
SEED = 20_220_701
OURS = ("restir_ref", "flatland2d", "tracer3d", "toy1d", "benchmarks", "tests", "figures")

Params = Mapping[str, Any]
Done = Sequence[tuple[Params, Arrays]]


@dataclass(frozen=True)
class Row:
    """One judged statement: claims it is about, what was measured, the value, its limit, and the verdict.

    `error` is the standard error of what is said, relative like the value, nan where nothing is sampled.
    """

    claims: str
    what: str
    value: float
    limit: str
    holds: bool
    count: int
    error: float = float("nan")
    note: str = ""


class Compute(Protocol):
    """One chunk; all randomness comes from `rng`."""

    def __call__(self, params: Any, /, *, rng: np.random.Generator) -> Arrays:
        """The arrays of one chunk."""


@dataclass(frozen=True)
class Job:
    """What is asked, the chunks at a share of the full count, how one is computed, and what they say.

    The chunks of a smaller share are among those of a larger one.  `identity` says what a stored chunk
    depends on besides its parameters: the code, unless told otherwise.
    """

    asks: str
    chunks: Callable[[float], Sequence[Params]]
    compute: Compute
    judge: Callable[[Done], Sequence[Row]]
    identity: Callable[[Params], str] | None = None


def parts(count: int, share: float) -> range:
    """The first of `count` chunks, at least one."""
    return range(max(1, round(count * share)))


def run(name: str, job: Job, share: float, folder: Path, processes: int = 1) -> Done:
    """All chunks with their arrays; those that are stored are read, the others computed and stored."""
    chunks = job.chunks(share)
    (folder / name).mkdir(parents=True, exist_ok=True)
    disk.sweep(folder / name)
    missing = [params for params in chunks if load(name, job, params, folder).state != "ours"]
    with tqdm(total=len(chunks), initial=len(chunks) - len(missing), desc=name, unit="chunk") as bar:
        for _ in computed(name, job, missing, folder, processes):
            bar.update()
    return [(params, load(name, job, params, folder).arrays) for params in chunks]


def computed(name: str, job: Job, chunks: Sequence[Params], folder: Path, processes: int) -> Iterator[None]:
    """Compute and store chunks, here or in several processes."""
    if processes == 1:
        for params in chunks:
            compute(name, job, params, folder)
            yield
        return
    with ProcessPoolExecutor(processes, mp_context=get_context("fork")) as pool:
        waiting = [pool.submit(compute, name, job, params, folder) for params in chunks]
        yield from (each.result() for each in as_completed(waiting))


def compute(name: str, job: Job, params: Params, folder: Path) -> None:
    """Compute and store one chunk."""
    words = (zlib.crc32(name.encode()), zlib.crc32(store.canonical(dict(params)).encode()))
    rng = np.random.default_rng(np.random.SeedSequence(SEED, spawn_key=words))
    key = identity(name, job, params)
    start = process_time()
    arrays = job.compute(params, rng=rng)
    spent = {"cpu": np.array(process_time() - start)}
    store.save(place(name, params, folder), {**arrays, **spent}, key)


def load(name: str, job: Job, params: Params, folder: Path) -> store.Stored:
    """What is stored of one chunk."""
    return store.load(place(name, params, folder), identity(name, job, params))


def place(name: str, params: Params, folder: Path) -> Path:
    """The chunk's file."""
    return folder / name / ("-".join(str(value) for value in params.values()).replace("/", "_") + ".npz")


def identity(name: str, job: Job, params: Params) -> str:
    """Everything a stored chunk depends on, as JSON with one spelling."""
    on = job.identity(params) if job.identity else code(job.compute.__module__)
    return store.canonical({"job": name, "seed": SEED, "params": dict(params), "on": on})


# ---------------------------------------------------------------- code


def depends(job: Job) -> str:
    """A digest of all that a job's results depend on: its code, or what every chunk says that it depends on."""
    if job.identity is None:
        return code(job.compute.__module__)
    said = [store.canonical({"params": dict(params), "on": job.identity(params)}) for params in job.chunks(1.0)]
    return hashlib.sha256("\n".join(said).encode()).hexdigest()[:16]


@cache
def code(module: str) -> str:
    """SHA-256, shortened, over the statements of a module and of all of ours that it imports, wherever they stand.

    Numbers count too: those in an `.npz` of the module's name, such as reference images.
    """
    return syntax.total(part for name in reached(module) for part in _syntax(name) | _numbers(name))


def reached(module: str) -> set[str]:
    """The module and everything of ours that it imports, directly or not."""
    seen, to_read = {module}, [module]
    while to_read:
        new = _imports(to_read.pop()) - seen
        seen |= new
        to_read += new
    return seen


@cache
def _imports(module: str) -> frozenset[str]:
    nodes = [node for node in ast.walk(_tree(module)) if isinstance(node, ast.ImportFrom) and node.module]
    names = {name for node in nodes for name in (node.module, *(f"{node.module}.{each.name}" for each in node.names))}
    return frozenset(name for name in names if name and name.partition(".")[0] in OURS and _file(name))


def _file(module: str) -> Path | None:
    """The source of a module of ours, None if the name is no module's."""
    path = ROOT / module.replace(".", "/")
    found = (each for each in (path.with_suffix(".py"), path / "__init__.py") if each.is_file())
    return next(found, None)


def _tree(module: str) -> ast.Module:
    path = _file(module)
    return ast.parse(path.read_bytes() if path else b"")


@cache
def _syntax(module: str) -> frozenset[bytes]:
    path = _file(module)
    return syntax.statements(path, ROOT) if path else frozenset()


def _numbers(module: str) -> frozenset[bytes]:
    path = _file(module)
    return syntax.numbers(path) if path else frozenset()
