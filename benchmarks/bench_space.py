"""What rays and frames in space cost: brute force and Embree on CB3 and on 70 000 triangles, and a frame's memory.

Paths per CPU-second depend on the machine; ratios are of runs by turns.  Memory is the most a process of its own has
held, its libraries included.  Exits with 1 if a requirement is missed; what needs Embree is left out without it.
--profile shows where the time of a path goes by brute force.  Takes 2 minutes, and 3 with --offline.
"""

import cProfile
import pstats
import resource
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from multiprocessing import get_context

import numpy as np
from bench_resampling import Row, keep_freed_memory, print_sections
from bench_transport import cpu, rng

from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport.paths import RECONNECTION, Tracer, radiance, trace
from restir_ref.transport.scene import Facet, Scene, scene
from restir_ref.transport.vectors import normalize
from tracer3d.embree import embree, with_embree
from tracer3d.render import Job, blank, render
from tracer3d.scenes import SCENES, grey, lamp, matte, room
from tracer3d.space import SOLID

COLUMNS, REPEATS, SHOWN = 2**14, 7, 16
TRIANGLES = 187
"""Squares along a field of twice that many triangles by themselves: 69 938."""
MIB, GIB = 2**20, 1024


def main(arguments: Sequence[str]) -> int:
    """Print all rows; 1 if a requirement is missed."""
    keep_freed_memory()
    if "--profile" in arguments:
        return profile()
    sections = {"CB3 at depth 4": paths, "70 000 triangles": triangles, "A frame of 512 x 512 pixels": frames}
    if "--offline" in arguments:
        sections["The same offline"] = partial(frames, presets=("offline",))
    return print_sections(sections)


def has_embree() -> bool:
    """Whether the extra is installed."""
    try:
        embree()
    except ValueError as missing:
        print(missing)
        return False
    return True


def traced(s: Scene, n: int = COLUMNS) -> Array:
    """One path tree per column through the inset."""
    at = SCENES["cornell"]()
    t = Tracer(s, at.pinhole(), 4, RECONNECTION)
    return radiance(trace(t, rng().random((t.D, n)), np.arange(n) % t.sensor.n))


def paths() -> Iterator[Row]:
    """Paths per CPU-second."""
    plain = SCENES["cornell"]().scene
    scenes = {"brute force": plain, **({"Embree": with_embree(plain)} if has_embree() else {})}
    found = cpu({name: partial(traced, s) for name, s in scenes.items()}, REPEATS)
    for name, seconds in found.items():
        yield Row(f"paths per CPU-second by {name}", COLUMNS / seconds)
    if "Embree" in found:
        yield Row("those by Embree over those by brute force", found["brute force"] / found["Embree"])


def field(m: int = TRIANGLES) -> Scene:
    """A closed room whose floor is a rolling field of 2 m^2 triangles."""
    x, z = np.meshgrid(*[np.linspace(0, 1, m + 1)] * 2, indexing="ij")
    v = np.stack([x, 0.2 + 0.1 * np.sin(9 * x) * np.cos(7 * z) + 0.01 * np.sin(50 * x * z), z], axis=-1)
    a, b, c, d = v[:-1, :-1], v[1:, :-1], v[1:, 1:], v[:-1, 1:]
    corners = np.concatenate([np.stack(each, axis=2).reshape(-1, 3, 3) for each in ((a, d, c), (a, c, b))])
    facets = [*room(0), *lamp((0.3, 0.3), (0.7, 0.7), 0.99, 8.0), *(Facet(each) for each in corners.tolist())]
    return scene(SOLID, [matte(grey(0.5))], facets)


def triangles() -> Iterator[Row]:
    """Nearest hits per CPU-second of rays that leave surfaces, and memory of brute force."""
    most = in_a_process(_few_rays)
    yield Row("brute force, 256 rays: MiB that the process has held (requirement 300)", most, most=300)
    if not has_embree():
        return
    s = with_embree(field())
    n = 4 * COLUMNS
    u = rng().random((3, n))
    x, w = np.stack([u[0], 0.4 + 0.5 * u[1], u[2]]), normalize(rng().normal(size=(3, n)))
    t, prim = s.intersect(x, w)
    t = np.where(np.isfinite(t), t, 0)
    away = normalize(rng().normal(size=(3, n)))
    n_at = s.normals.take(prim, axis=-1)
    side = -np.sign((n_at * w).sum(axis=0)) * np.sign((n_at * away).sum(axis=0))
    found = cpu({"hits": lambda: s.intersect(x + t * w, side * away)}, REPEATS)
    yield Row("nearest hits per CPU-second by Embree", n / found["hits"], least=1e6)


def _few_rays() -> None:
    n = 256
    w = normalize(rng().normal(size=(3, n)))
    field().intersect(np.repeat([[0.5], [0.7], [0.5]], n, axis=1), w)


def frames(presets: Sequence[str] = ("realtime",)) -> Iterator[Row]:
    """Memory of ReSTIR PT in windows: two frames of a moving camera, or one offline."""
    for preset in presets:
        most = in_a_process(partial(_frames, preset))
        yield Row(f"{preset}: MiB that the process has held (requirement 1024)", most, most=GIB)


def _frames(preset: str) -> None:
    job = Job("cornell", "restir-pt", preset, size=(512, 512), moving=1.0)
    count = {"realtime": 2, "offline": 1}[preset]
    for _ in render(job, lambda k: Live(np.random.default_rng(k)), count, blank(job), job.compiled()):
        pass


def in_a_process(work) -> float:
    """MiB that a new process holds at most while it works."""
    with get_context("spawn").Pool(1) as pool:
        return pool.apply(_most_of, (work,))


def _most_of(work) -> float:
    work()
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / MIB


def profile() -> int:
    """Functions of path tracing on CB3 by their own time."""
    plain = SCENES["cornell"]().scene
    traced(plain)
    seen = cProfile.Profile()
    seen.enable()
    for _ in range(5):
        traced(plain)
    seen.disable()
    pstats.Stats(seen).sort_stats("tottime").print_stats(SHOWN)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
