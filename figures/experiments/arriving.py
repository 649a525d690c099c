"""Frames of a moving camera that arrives at any crops of space: crops that nobody chose, or an inset of any width.

As in `solid` and `realtime`, by the same steps: crops follow what their centres see.  Light is in two parts, as in
`split_light`; and the truth too, whose direct part costs one scattering event.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from figures.claims.figure import Arrays
from figures.experiments import solid
from figures.experiments.realtime import FRAMES, Method, costed
from figures.experiments.references import INDIRECT, reference
from figures.experiments.rendering import estimates, lattice_tracing, path_tracing
from figures.experiments.split_light import direct_film
from figures.experiments.views import HYBRID, setting, standard, view
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.paths import Tree, radiance
from restir_ref.transport.rays import arrive
from restir_ref.transport.restir_pt import PathIntegrals
from tracer3d.scenes import Setting
from tracer3d.sensors import FILM, Mosaic, Pinhole


def seen(scene: str, wide: int) -> Mosaic:
    """The crops of a scene, or its inset with so many columns and rows."""
    found: Mosaic = solid.inset(scene, wide) if scene in solid.INSETS else standard(scene)
    return found


def middle(scene: str, image: Array, wide: int) -> Array:
    """What `seen` sees of an image by the standard sensor, (n,)."""
    if scene not in solid.INSETS:
        return image
    aside = (solid.WIDE - wide) // 2
    return np.asarray(image.reshape(solid.WIDE, -1)[aside : aside + wide, aside : aside + wide].ravel())


# ---------------------------------------------------------------- cameras


def approach(of: Setting, last: Mosaic, frames: int = FRAMES) -> list[Mosaic]:
    """The sensors of a camera that slides and arrives at the last one, each crop following what its centre sees."""
    return [_before(of, last, of.at(k - frames + 1)) for k in range(frames)]


def _before(of: Setting, last: Mosaic, then: Setting) -> Mosaic:
    now = then.pinhole(last.pinhole.width, last.pinhole.height)
    return Mosaic(now, tuple(_corner(of, crop, now) for crop in last.crops()))


def _corner(of: Setting, crop: Pinhole, now: Pinhole) -> tuple[int, int]:
    """Where a crop of another camera begins whose centre sees what this crop's does; it stays on the film."""
    half, size = np.array([crop.width // 2, crop.height // 2]), np.array([crop.width, crop.height])
    x, w, _ = crop.through(np.array([crop.left + half[0]]), np.array([crop.top + half[1]]))
    v, _, met = arrive(of.scene, x, w)
    place = now.project(np.where(met, v.x, x + w))[:, 0] + np.array([now.left, now.top])
    left, top = np.clip(np.rint(place) - half, 0, np.array(FILM) - size)
    return int(left), int(top)


# ---------------------------------------------------------------- images


def last_frame(method: Method, scene: str, last: Mosaic, replicas: int, rng: np.random.Generator) -> Arrays:
    """The last of FRAMES frames, (replicas, n), and its rays per pixel."""
    asked = Counter[str]()
    views = [method.integrals(of.tracer) for of in _views(scene, method, last, asked)]
    *_, (images, cost) = costed(views, asked, replicas, Live(rng))
    return {"images": images, "rays": np.array(cost)}


def _views(scene: str, method: Method, last: Mosaic, asked: Counter[str]) -> Sequence[PathIntegrals]:
    return [view(scene, method.rule, asked, each) for each in approach(setting(scene), last)]


def direct(scene: str, last: Mosaic, replicas: int, rng: np.random.Generator) -> Arrays:
    """The same frame's direct light by ReSTIR DI, (replicas, n)."""
    *_, images = direct_film(_views(scene, Method(HYBRID), last, Counter()), replicas, Live(rng))
    return {"images": images}


def trees(scene: str, last: Mosaic, count: int, rng: np.random.Generator) -> Arrays:
    """Indirect light by independent path trees, (count, n), and rays per tree, as in `split_light.indirect_trees`."""
    asked = Counter[str]()
    found = estimates(path_tracing(1, indirect_light), view(scene, HYBRID, asked, last), asked, count, Live(rng))
    return {"images": found.images, "rays": np.array(found.rays - 1)}


# ---------------------------------------------------------------- truth


def direct_light(tree: Tree) -> Array:
    """What ReSTIR DI stands for, (C, N)."""
    return np.asarray(radiance(tree) - indirect_light(tree))


def direct_truth(scene: str, last: Mosaic, rng: np.random.Generator) -> Arrays:
    """The image of `direct_light`, (n,), by a lattice of paths with one scattering event."""
    t = replace(view(scene, HYBRID, Counter(), last).tracer, depth=1)
    return {"images": lattice_tracing(direct_light)(PathIntegrals(t), np.arange(last.n), Live(rng))}


def truth(scene: str, wide: int, direct: Array) -> Array:
    """All light that `seen` sees, (n,): the reference of indirect light, and direct light."""
    return middle(scene, reference(scene, INDIRECT).mean, wide) + direct
