"""From a scene to a picture: frames of a method, their mean, and where an earlier run has stopped."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.guards import whole
from restir_ref.transport.paths import Tracer
from restir_ref.transport.scene import Scene
from tracer3d.embree import embree, with_embree
from tracer3d.methods import METHODS, PRESETS, Shot
from tracer3d.names import known
from tracer3d.scene_files import digest, opened
from tracer3d.scenes import Setting
from tracer3d.sensors import Pinhole

HELD, LONGER = 1_500, 180
"""Bytes per pixel of what outlives a window of a pass, and more per vertex: reservoirs, old and new."""

TRACED = 200
"""Bytes per pixel of path tracing and path reuse, which hold some images only."""

RAY, BESIDE = 3e-8, 30
"""Seconds for asking one surface for one ray, and how many surfaces all else costs as much as; 34 to 5000 measured."""

MOST = 4 * 2**30
"""Bytes that a picture may need."""

DEEPEST = 100
"""Scattering vertices that a path may have, as in scene files."""

SURFACES = 10_000
"""So many triangles and spheres at most are asked by brute force."""

INTERSECT: Mapping[str, Callable[[Scene], Scene]] = MappingProxyType(
    {"brute": lambda scene: scene, "embree": with_embree}
)
"""Who answers what rays meet: all surfaces at once, or a hierarchy of them."""

Chances = Callable[[int], Chance]
"""The chance of every frame by its number."""


@dataclass(frozen=True)
class Job:
    """What is asked for; whatever changes the picture but the number of frames.

    scene  a name, or a file whose name ends in .toml;  content  the file's digest, by which a change of it is noticed
    size   columns and rows;  crop  column and row of the film at which they begin, None for all of the view
    moving  steps of the camera per frame: a picture of a moving camera is its last frame, of a still one the mean
    intersect  who answers what rays meet, of `INTERSECT`
    Raises ValueError for unknown names, a crop off the film, paths longer than DEEPEST, pictures that need too much
    memory, more surfaces than brute force is for, and where Embree is asked for and not installed.
    """

    scene: str
    method: str
    preset: str = "realtime"
    size: tuple[int, int] = (64, 64)
    crop: tuple[int, int] | None = None
    moving: float = 0.0
    depth: int | None = None
    seed: int = 1
    content: str | None = None
    intersect: str = "brute"

    def __post_init__(self) -> None:
        if self.content is None:
            object.__setattr__(self, "content", digest(self.scene))
        known(METHODS, self.method, "method")
        known(PRESETS, self.preset, "preset")
        known(INTERSECT, self.intersect, "way to intersect")
        for count in self.size:
            whole(count, 1, "each side of a picture", "Say --size 64x64.")
        if self.depth is not None and self.depth > DEEPEST:
            raise ValueError(f"the path depth is {self.depth}, more than {DEEPEST}: say --depth 4, or leave it out.")
        needed = self.size[0] * self.size[1] * self._bytes()
        if needed > MOST:
            raise ValueError(
                f"a picture of {self.size[0]} x {self.size[1]} pixels by {self.method} needs about "
                f"{needed / 2**30:.1f} GiB, more than {MOST / 2**30:.0f}, and {self.hours():.1f} hours a frame: "
                f"render a smaller one, or a crop{'' if self.method == 'path' else ', or by path'}."
            )
        if self.method == "path-reuse" and any(count % 4 for count in self.size):
            raise ValueError(f"path reuse needs sides that are multiples of 4, but the size is {self.size}.")
        surfaces = len(self.setting(0).scene.material)
        if self.intersect == "brute" and surfaces > SURFACES:
            raise ValueError(
                f"{self.scene} has {surfaces:,} triangles and spheres, and brute force is for at most {SURFACES:,}: a "
                f"frame would take about {self.hours():.2g} hours. Install restir-ref with its extra 'embree', and say "
                f"--intersect embree."
            )
        if self.intersect == "embree":
            embree()
        self.sensor(0)

    def _bytes(self) -> int:
        """What a pixel needs while a frame is made."""
        return TRACED if self.method in ("path", "path-reuse") else HELD + LONGER * self.setting(0).depth

    def compiled(self) -> Scene:
        """The scene, with who is to answer what rays meet; the same one every time."""
        return _compiled(self.scene, self.content, self.intersect)

    def setting(self, frame: float) -> Setting:
        """The scene as the camera of a frame sees it."""
        at, steps = _begun(self.scene, self.content, self.depth), frame * self.moving
        return at.at(steps) if steps else at

    def hours(self) -> float:
        """About the time that path tracing of a frame takes: two rays per vertex, by brute force each asks all."""
        at = self.setting(0)
        rays = self.size[0] * self.size[1] * PRESETS[self.preset].trees * 2 * at.depth
        asked = len(at.scene.material) if self.intersect == "brute" else 0
        return rays * (asked + BESIDE) * RAY / 3600

    def sensor(self, frame: float) -> Pinhole:
        """The camera of a frame."""
        at = self.setting(frame)
        return at.view(*self.size) if self.crop is None else at.pinhole(*self.size, self.crop)

    def tracer(self, frame: int, scene: Scene) -> Tracer:
        """The tracer of a frame, in a scene that is compiled once."""
        return Tracer(scene, self.sensor(frame), self.setting(frame).depth, METHODS[self.method].rule)


@cache
def _begun(scene: str, content: str | None, depth: int | None) -> Setting:
    at = opened(scene, content).setting
    return at if depth is None else replace(at, depth=depth)


@cache
def _compiled(scene: str, content: str | None, intersect: str) -> Scene:
    return INTERSECT[intersect](opened(scene, content).setting.scene)


@dataclass(frozen=True, eq=False)
class Picture:
    """The sum of frames (C, rows, columns) and how many they are; of a moving camera the last one, times as many."""

    sum: Array
    frames: int

    @property
    def mean(self) -> Array:
        """What is shown, (C, rows, columns)."""
        return np.asarray(self.sum / max(self.frames, 1))


def blank(job: Job) -> Picture:
    """Before the first frame."""
    columns, rows = job.size
    return Picture(np.zeros((job.setting(0).scene.C, rows, columns)), 0)


def render(job: Job, chances: Chances, frames: int, begun: Picture, scene: Scene) -> Iterator[Picture]:
    """The picture after every further frame, up to `frames`.

    Frames are numbered from the beginning of the first run, so that a run that was ended and goes on draws what one
    in a single go would; methods with history begin it anew.
    """
    columns, rows = job.size
    shots = (Shot(job.tracer(k, scene), chances(k)) for k in range(begun.frames, frames))
    images = METHODS[job.method].frames(shots, PRESETS[job.preset], (rows, columns))
    now = begun
    for image in images:
        L = image.reshape(-1, rows, columns)
        now = Picture(L * (now.frames + 1) if job.moving else now.sum + L, now.frames + 1)
        yield now
