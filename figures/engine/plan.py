"""What one run asks of one figure: its declared chunks, their files, and the keys these must carry."""

import json
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from figures.claims.errors import FigureError
from figures.claims.figure import Arrays, Data, Entry, Figure
from figures.engine import code, disk, store
from figures.engine.jobs import Job

FORMAT = 1
OF_CODE = frozenset({"code", "data", "chunks", "chunk", "parameters", "stream"})
"""Fields of a key that the code decides: what differs in nothing else is older, not foreign."""


@dataclass(frozen=True)
class Plan:
    """A figure under one preset and seed, the parameters of its chunks, and its folder.

    `trouble` is the traceback of a figure that could not even declare its chunks.
    """

    module: str
    figure: Figure
    preset: str
    data: Data
    parts: tuple[Data, ...]
    seed: int
    folder: Path
    code: str
    trouble: str = ""


def plan(entry: Entry, preset: str, seed: int, out: Path) -> Plan:
    """Ask the figure for its chunks; the count is its own and does not depend on the workers."""
    figure = entry.figure
    data: Data = _round_trip(figure.presets[preset])
    parts, trouble = (), ""
    try:
        parts = tuple(_round_trip(part) for part in figure.chunks(data))
    except Exception:
        trouble = traceback.format_exc()
    made_by = code.digest(entry.module, figure.world)
    return Plan(entry.module, figure, preset, data, parts, seed, out / figure.id, made_by, trouble)


def _round_trip(data: Any) -> Any:
    """Data as a worker or a stored key sees it: dicts and lists, whatever the module wrote."""
    return json.loads(store.canonical(data))


def job(plan: Plan, number: int) -> Job:
    """Chunk `number` as a pure job."""
    return Job(plan.module, plan.figure.id, plan.data, number, plan.parts[number], plan.seed, stream(plan, number))


def stream(plan: Plan, number: int) -> int:
    """The number of a chunk's random stream: its own, or that of the first arm of its comparison."""
    return min(arms(plan, number))


def arms(plan: Plan, number: int) -> list[int]:
    """The chunk and all that differ from it in nothing but the figure's `arm`."""
    name, mine = plan.figure.arm, plan.parts[number]
    if name not in mine:
        return [number]
    rest = {key: value for key, value in mine.items() if key != name}
    parts = enumerate(plan.parts)
    return [k for k, part in parts if name in part and rest == {key: part[key] for key in part if key != name}]


def key(plan: Plan) -> str:
    """Everything the figure's arrays depend on."""
    return store.canonical(_identity(plan))


def chunk_key(plan: Plan, number: int) -> str:
    """Everything the arrays of one chunk depend on."""
    shared = {"stream": stream(plan, number)} if plan.figure.arm else {}
    return store.canonical({**_identity(plan), "chunk": number, "parameters": plan.parts[number], **shared})


def _identity(plan: Plan) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "figure": plan.figure.id,
        "version": plan.figure.version,
        "code": plan.code,
        "preset": plan.preset,
        "data": plan.data,
        "chunks": len(plan.parts),
        "seed": plan.seed,
    }


def chunk_path(plan: Plan, number: int) -> Path:
    """The file of chunk `number`."""
    return plan.folder / "chunks" / f"{number:03d}.npz"


def arrays_path(plan: Plan) -> Path:
    """The file of the combined arrays."""
    return plan.folder / "arrays.npz"


def prepare(plan: Plan, warn: Callable[[str], object]) -> set[int]:
    """Make the folder, clean up after killed runs, set damaged chunks aside; return the missing numbers.

    A file of another run or program is an error: it is neither used nor overwritten.  One that differs in nothing
    but the code that made it is computed again.
    """
    _make(plan.folder / "chunks")
    found = {n: state_at(chunk_path(plan, n), chunk_key(plan, n)) for n in range(len(plan.parts))}
    for path in _left_over(plan):
        path.unlink()
    for path, trouble in _foreign(plan, found):
        raise FigureError(
            f"{path} is not a part of this run: {trouble}. "
            f"Choose another folder with --out, or delete {plan.folder} to compute the figure anew"
        )
    for path, trouble in ((chunk_path(plan, n), text) for n, (s, text) in found.items() if s == "damaged"):
        warn(f"{path} is damaged ({trouble}): set aside as {disk.set_aside(path).name}, computed again")
    stale = [number for number, (state, _) in found.items() if state == "stale"]
    if stale:
        warn(f"{plan.figure.id}: the code has changed since {len(stale)} of its chunks were computed: computed again")
    return {number for number, (state, _) in found.items() if state != "ours"}


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        disk.sweep(folder.parent)
        disk.sweep(folder)
    except OSError as error:
        raise FigureError(disk.unwritable(folder, error)) from error


def _left_over(plan: Plan) -> list[Path]:
    """Chunks of the same run by older code, which declared more of them."""
    count, paths = len(plan.parts), sorted((plan.folder / "chunks").glob("*.npz"))
    extra = [path for path in paths if path.stem.isdigit() and int(path.stem) >= count > 0]
    return [path for path in extra if state_at(path, chunk_key(plan, 0))[0] == "stale"]


def state_at(path: Path, key: str) -> tuple[store.State, str]:
    """What stands at a path, and what is wrong with it; older where the code, or what it decides, was another."""
    state, trouble = store.state(path, key)
    if state == "foreign" and path.is_file():
        found = store.read(path).get(store.KEY)
        fields = set(store.differing(str(found[0]), key)) if found is not None and found.ndim == 1 else set()
        if fields and fields <= OF_CODE:
            return "stale", "other code computed it"
    return state, trouble


def _foreign(plan: Plan, found: Mapping[int, tuple[store.State, str]]) -> Iterator[tuple[Path, str]]:
    state, trouble = state_at(arrays_path(plan), key(plan))
    if state == "foreign":
        yield arrays_path(plan), trouble
    yield from ((chunk_path(plan, n), trouble) for n, (state, trouble) in found.items() if state == "foreign")
    ours = {chunk_path(plan, number) for number in found}
    for path in sorted((plan.folder / "chunks").iterdir()):
        if path not in ours and not path.name.startswith(".") and path.suffix != disk.ASIDE:
            yield path, f"it is none of the figure's {len(ours)} chunks"


def read_chunks(plan: Plan) -> list[Arrays]:
    """The arrays of all chunks, in order, from their files."""
    return [_read_chunk(plan, number) for number in range(len(plan.parts))]


def _read_chunk(plan: Plan, number: int) -> Arrays:
    path = chunk_path(plan, number)
    found = store.load(path, chunk_key(plan, number))
    if found.state != "ours":
        raise FigureError(f"{path} was changed while the run was under way: {found.trouble or 'it is gone'}")
    return found.arrays
