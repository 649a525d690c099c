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

import numpy as np

from figures.claims.figure import Arrays
from flatland2d import SCENES
from flatland2d.directions import MAPS
from flatland2d.probe_rooms import PROBE_ROOMS, probes
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
from restir_ref.transport.cache.integrals import CacheIntegrals, cache_integrals, unseen
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

TOLERANCE = 0.01
"""Of light that is missing in a volume, and of its noise, as a share of its mean."""

FREEZING = 0xDD61
"""The stream of a volume's rays: one volume serves all chunks."""

DEPTH = 12
"""Scattering events of path tracing; the rest, 3% at most, is missing there."""

G_MAX = 10.0
"""Of our own variant, per unit length: connections shorter than a tenth of a room's height are bounded."""

G_MAX_PRINTED = 1.0
"""As printed, in a unit that is not; here the room's height."""

ROOMS: Mapping[str, Callable[[], Setting]] = MappingProxyType({**SCENES, **PROBE_ROOMS})

PLACES: Mapping[str, str] = MappingProxyType(
    {
        "FS2": "glossy_cornell",
        "FS3": "ajar",
        "FS4": "crease",
        "FS5": "occluders",
        "FS11": "sunlit",
        "FS13": "open_room",
    }
)
"""Rooms by their names in the ledger."""


@dataclass(frozen=True, eq=False)
class Frozen:
    """A room and its volumes: of all scattered light, Eq. 5, and without direct light, Eq. 4."""

    setting: Setting
    augmented: Volume
    original: Volume


@once
def frozen(name: str, per_unit: float = PER_UNIT, tolerance: float = TOLERANCE) -> Frozen:
    """The room of that name and its volumes, always the same ones."""
    setting = ROOMS[name]()
    grid = probes(setting, per_unit)
    empty = unlit(setting.scene, grid, MAPS)
    spacing = float(np.min(empty.spacing))
    ways = (Updating(telling(along_view(spacing))), Updating(rule=ORIGINAL))
    found = [
        converge(empty, setting.scene, how, Live(np.random.default_rng(FREEZING)), tolerance=tolerance) for how in ways
    ]
    return Frozen(setting, *found)


def along_view(spacing: float) -> Displacement:
    """Queries look back along the path, as far as the self-shadow bias does.  [DDGIR 3.4]"""
    return lambda n, o, r: view_path(o, REACH * spacing, r)


def shadowed(spacing: float) -> Displacement:
    """The self-shadow bias of the volume itself.  [Majercik 2019]"""
    return lambda n, o, r: self_shadow(n, o, np.array([spacing]))


@dataclass(frozen=True, eq=False)
class Scenery:
    """What methods get: paths, the cache of x_2, and the one of x_1; they count into `asked`."""

    tracer: Tracer
    cache: Cache
    original: Cache
    asked: Counter[str]


def scenery(of: Frozen, n: int | None = None) -> Scenery:
    """A room seen by its standard sensor."""
    asked, spacing = Counter[str](), float(np.min(of.augmented.spacing))
    s = of.setting.scene
    augmented = counted(Cache(s, of.augmented, along_view(spacing)), asked)
    original = counted(Cache(s, of.original, shadowed(spacing)), asked)
    t = Tracer(augmented.scene, of.setting.pinhole(), of.setting.depth, RECONNECTION)
    return Scenery(replace(t, depth=DEPTH), augmented, original, asked)


SHADING = recursive(as_wide_as_in_space(2))

Variant = Callable[[CacheIntegrals], CacheIntegrals]
"""Integrals of one variant of DDGI resampling, of integrals without bound that look."""


def ours(of: CacheIntegrals) -> CacheIntegrals:
    """Visibility in the target, and so in MIS weights: unbiased."""
    return replace(of, G_max=G_MAX)


def as_printed(of: CacheIntegrals) -> CacheIntegrals:
    """No visibility before the one shadow ray, and G_max = 1."""
    return replace(of, G_max=G_MAX_PRINTED, sight=unseen)


VARIANTS: Mapping[str, Variant] = MappingProxyType({"resampled": ours, "as printed": as_printed})
BASELINES = ("path tracing", "primary", "secondary")
METHODS = (*BASELINES, *VARIANTS)
