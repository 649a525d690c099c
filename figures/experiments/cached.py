"""Rooms with frozen volumes of probes, and what is compared in them: DDGI resampling and its three baselines.

A volume is updated until nothing changes, once per room, and serves all methods.  Every frame draws its x_1 anew, and
all methods of a frame see the same ones.  History is cold in the first frame of a chain, and warm in the last.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache as once
from functools import partial
from types import MappingProxyType
from typing import TypeVar

import numpy as np

from figures.claims.figure import Arrays
from figures.experiments.deep import DEPTH, ROOMS, depth_of
from flatland2d.directions import MAPS
from flatland2d.probe_rooms import probes
from flatland2d.scenes import Setting
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import REAL_TIME, random_in_row
from restir_ref.restir import shade
from restir_ref.transport.baselines import probes as baselines
from restir_ref.transport.baselines.restir_di import DEBIASED, LightIntegrals, direct_light, indirect_light
from restir_ref.transport.cache.biases import REACH, self_shadow, view_path
from restir_ref.transport.cache.converge import converge
from restir_ref.transport.cache.footprint import as_wide_as_in_space
from restir_ref.transport.cache.frame import Frame, frame, image
from restir_ref.transport.cache.integrals import CacheIntegrals, cache_integrals, lit, unseen
from restir_ref.transport.cache.leaving import Cache, Displacement, telling
from restir_ref.transport.cache.queries import QUERIES, counted
from restir_ref.transport.cache.rules import ORIGINAL
from restir_ref.transport.cache.shading import own_light, recursive
from restir_ref.transport.cache.update import Updating
from restir_ref.transport.cache.volume import Volume, unlit
from restir_ref.transport.counting import rays
from restir_ref.transport.paths import RECONNECTION, Tracer, trace

PER_UNIT = 8.0
"""Probes per unit length, the height of a room."""

TOLERANCE = 0.02
"""Of light that is missing in a volume, and of its noise, as a share of its mean."""

FREEZING = 0xDD61
"""The stream of a volume's rays: one volume serves all chunks."""

G_MAX = 10.0
"""Of our own variant, per unit length: connections shorter than a tenth of a room's height are bounded."""

G_MAX_PRINTED = 1.0
"""As printed, in a unit that is not; here the room's height."""

FRAMES = 20
"""Frames of a chain: as many as the cap of confidences."""


@dataclass(frozen=True)
class Place:
    """A room by its name, and how densely probes stand in it, per unit length."""

    room: str
    per_unit: float = PER_UNIT


PLACES: Mapping[str, Place] = MappingProxyType(
    {
        "FS2": Place("glossy_cornell"),
        "FS3": Place("ajar"),
        "FS4": Place("crease"),
        "FS5": Place("occluders"),
        "FS13": Place("open_room"),
        "FS11": Place("sunlit", 10.0),
    }
)
"""Rooms by their names in the ledger.  In FS11 probes stand in the plane of the thin walls, and see both sides; with 8
per unit they stand on either side, and next to nothing leaks."""


@dataclass(frozen=True, eq=False)
class Frozen:
    """A room and its volumes: of all scattered light, Eq. 5, and without direct light, Eq. 4."""

    place: Place
    setting: Setting
    augmented: Volume
    original: Volume


@once
def frozen(place: Place, tolerance: float = TOLERANCE) -> Frozen:
    """The room and its volumes, always the same ones."""
    setting = ROOMS[place.room]()
    empty = unlit(setting.scene, probes(setting, place.per_unit), MAPS)
    ways = (Updating(telling(along_view(empty))), Updating(rule=ORIGINAL))
    found = [
        converge(empty, setting.scene, how, Live(np.random.default_rng(FREEZING)), tolerance=tolerance) for how in ways
    ]
    return Frozen(place, setting, *found)


def along_view(v: Volume) -> Displacement:
    """Queries look back along the path, as far as the self-shadow bias does.  [DDGIR 3.4]"""
    distance = REACH * float(np.min(v.spacing))
    return lambda n, o, r: view_path(o, distance, r)


def shadowed(v: Volume) -> Displacement:
    """The self-shadow bias of the volume itself.  [Majercik 2019]"""
    return lambda n, o, r: self_shadow(n, o, v.spacing)


@dataclass(frozen=True, eq=False)
class Scenery:
    """What methods get: paths, those as deep as the truth, the caches of x_2 and of x_1; all count into `asked`."""

    tracer: Tracer
    deep: Tracer
    cache: Cache
    original: Cache
    asked: Counter[str]

    @property
    def n(self) -> int:
        """Number of pixels."""
        return self.tracer.sensor.n

    def first(self, index: Array, chance: Chance) -> tuple[CacheIntegrals, Array]:
        """Integrals over new x_1 of columns `index` (N,), without bound, and the numbers (D, N) that they come from."""
        u = chance.uniform((self.tracer.D, len(index)))
        return cache_integrals(self.tracer, self.cache, u, index % self.n, np.inf), u


def scenery(of: Frozen) -> Scenery:
    """A room seen by its standard sensor, its queries and rays counted."""
    asked, s = Counter[str](), of.setting.scene
    cache = counted(Cache(s, of.augmented, along_view(of.augmented)), asked)
    original = counted(Cache(s, of.original, shadowed(of.original)), asked)
    t = Tracer(cache.scene, of.setting.pinhole(), DEPTH, RECONNECTION)
    return Scenery(t, replace(t, depth=depth_of(of.place.room)), cache, original, asked)


SHADING = recursive(as_wide_as_in_space(2))
"""Specular recursion, with the paper's threshold as a length."""


# ---------------------------------------------------------------- DDGI resampling


@dataclass(frozen=True)
class Variant:
    """A variant of DDGI resampling.

    integrals   of integrals without bound that look
    remembered  what of a frame is the next one's history
    """

    integrals: Callable[[CacheIntegrals], CacheIntegrals]
    remembered: Callable[[Reservoirs, Pixels], Reservoirs] = lambda X, here: X


RESAMPLED = Variant(lambda of: replace(of, G_max=G_MAX))
"""Visibility in the target, and so in MIS weights: it has the mean of secondary DDGI."""

PRINTED = Variant(lambda of: replace(of, G_max=G_MAX_PRINTED, sight=unseen), lit)
"""One shadow ray, to the selected sample, G_max = 1; what it does not see is not remembered.  [Bitterli 2020]

The paper does not say whether it is.  If it is, history fills with lights that are hidden, and behind a door ajar the
image is as noisy as path tracing.
"""

VARIANTS: Mapping[str, Variant] = MappingProxyType({"resampled DDGI": RESAMPLED, "resampled as printed": PRINTED})
BASELINES = ("path tracing", "primary DDGI", "secondary DDGI")
METHODS = (*BASELINES, *VARIANTS)


@dataclass
class Chain:
    """A variant's history from frame to frame: `run`, then `keep`, once per frame."""

    variant: Variant
    history: Reservoirs | None = None
    before: Sequence[Pixels] = ()

    def run(self, of: CacheIntegrals, index: Array, chance: Chance) -> Frame:
        """The frame over new x_1."""
        here = Pixels(self.variant.integrals(of), index)
        now = frame(here, chance, REAL_TIME, random_in_row, self.history, self.before)
        self.before = [here]
        return now

    def keep(self, now: Frame) -> Frame:
        """The frame as the next one knows it."""
        self.history = self.variant.remembered(now.X, self.before[0])
        return replace(now, X=self.history)

    def shown(self, now: Frame, chance: Chance) -> Array:
        """Its image, (C, N)."""
        return image(now, self.before[0], SHADING, chance)


@dataclass
class DirectChain:
    """ReSTIR DI at x_1, its weights with visibility, from frame to frame."""

    history: Reservoirs | None = None
    before: Sequence[Pixels] = ()

    def run(self, of: LightIntegrals, index: Array, chance: Chance) -> Array:
        """Direct light over new x_1, (C, N)."""
        here = Pixels(of, index)
        near = random_in_row(of, index, REAL_TIME.neighbours, REAL_TIME.radius, chance)
        around = [Pixels(of, each.index) for each in near]
        self.history = direct_light(here, around, DEBIASED["defensive"], chance, self.history, self.before)
        self.before = [here]
        return shade(self.history, here)


# ---------------------------------------------------------------- all methods, frame by frame


Result = TypeVar("Result")


@dataclass
class Bill:
    """Rays and probe queries per column, by what they were spent on."""

    asked: Counter[str]
    columns: int

    def of(self, work: Callable[[], Result]) -> tuple[Result, Array]:
        """What the work returns, and its rays and queries per column, (2,)."""
        before = self._spent()
        found = work()
        return found, (self._spent() - before) / self.columns

    def _spent(self) -> Array:
        return np.array([rays(self.asked), self.asked[QUERIES]], dtype=float)


def compared(of: Scenery, replicas: int, frames: int, chance: Chance) -> Arrays:
    """Images (history, method, replica, pixel) of METHODS, history cold or warm, and what each cost.

    spent (history, method, 2)  rays and probe queries per pixel and frame, the eye's ray among them
    drawn (variant, 2)          those of the last frame before any sample is shown: candidates and their reuse
    """
    index = np.arange(replicas * of.n)
    chains, lamps = {name: Chain(each) for name, each in VARIANTS.items()}, DirectChain()
    images, spent, drawn = [], [], np.zeros((len(chains), 2))
    for k in range(frames):
        bill = Bill(of.asked, len(index))
        (first, u), eye = bill.of(lambda: of.first(index, chance))
        direct, by_lamps = bill.of(partial(lamps.run, baselines.direct(first), index, chance))
        shown = [bill.of(partial(each, of, first, u, index, chance)) for each in TAILS if k in (0, frames - 1)]
        shown = [(own_light(first, index) + direct + tail, by_lamps + cost) for tail, cost in shown]
        for variant, chain in enumerate(chains.values()):
            now, drawn[variant] = bill.of(partial(chain.run, first, index, chance))
            now, kept = bill.of(partial(chain.keep, now))
            if k in (0, frames - 1):
                L, cost = bill.of(partial(chain.shown, now, chance))
                shown.append((L, drawn[variant] + kept + cost))
        if shown:
            images.append(np.stack([L.mean(axis=0).reshape(replicas, of.n) for L, _ in shown]))
            spent.append([eye + cost for _, cost in shown])
    return {"images": np.stack(images), "spent": np.array(spent), "drawn": drawn}


def converged(of: Scenery, replicas: int, chance: Chance) -> Array:
    """Means over replicas, (3, n): path tracing with direct light by ReSTIR DI, and what TAILS of caches add to it."""
    index, t = np.arange(replicas * of.n), of.deep
    tree = trace(t, chance.uniform((t.D, len(index))), index % of.n)
    lit_by = LightIntegrals(t.scene, of.n, tree.x[0], tree.T[0])
    trees = DirectChain().run(lit_by, index, chance) + indirect_light(tree)
    first, u = of.first(index, chance)
    tails = [each(of, first, u, index, chance) for each in TAILS[1:]]
    found = np.stack([trees, *tails])
    return np.asarray(found.mean(axis=1).reshape(len(found), replicas, of.n).mean(axis=1))


def tree_tail(of: Scenery, first: CacheIntegrals, u: Array, index: Array, chance: Chance) -> Array:
    """What path tracing adds to L_e and direct light at the same x_1; (C, N)."""
    return indirect_light(trace(of.tracer, u, index % of.n)) - own_light(first, index)


def primary_tail(of: Scenery, first: CacheIntegrals, u: Array, index: Array, chance: Chance) -> Array:
    """What primary DDGI adds."""
    return baselines.primary(first, of.original, index, SHADING, chance)


def secondary_tail(of: Scenery, first: CacheIntegrals, u: Array, index: Array, chance: Chance) -> Array:
    """What secondary DDGI adds."""
    return baselines.secondary(first, index, SHADING, chance)


TAILS = (tree_tail, primary_tail, secondary_tail)
"""Of BASELINES.  The first rays of a tree, from the eye and to a lamp, are charged although nobody needs them."""
