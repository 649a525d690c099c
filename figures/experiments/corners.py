"""Corners in an image: how near other surfaces are, and how short the connections.  [GRIS 7.5]"""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from figures.claims.figure import Arrays
from figures.experiments.realtime import Method
from figures.experiments.views import view
from flatland2d import radiosity
from flatland2d.gbuffer import gbuffer
from flatland2d.scenes import Setting
from flatland2d.sensors import Pinhole
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.loop import REAL_TIME, random_in_row
from restir_ref.metrics import SMALL
from restir_ref.restir import initial
from restir_ref.transport.paths import first_hit
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot, norm


def clearance(scene: Scene, sensor: Pinhole) -> Array:
    """Distance of what the middle of each pixel sees to the nearest segment that is in front of it, (n,)."""
    v = gbuffer(scene, sensor)
    a, b = (end[:, :, None] - v.x[:, None] for end in scene.corners)
    edge = b - a
    along = np.clip(-dot(edge, a) / dot(edge, edge), 0, 1)
    ahead = np.maximum(dot(v.n[:, None], a), dot(v.n[:, None], b)) > 1e-9
    return np.asarray(np.where(ahead, norm(a + along * edge), np.inf).min(axis=0))


def around(mask: Array, radius: float = REAL_TIME.radius) -> Array:
    """The masked pixels and all that have one of them within the radius, (n,)."""
    distance = np.abs(np.subtract.outer(np.arange(len(mask)), np.flatnonzero(mask)))
    return np.asarray((distance <= radius).any(axis=1))


def connections(
    method: Method,
    scene: str,
    distances: Sequence[float],
    replicas: int,
    rng: np.random.Generator,
    sensor: Pinhole | None = None,
) -> Arrays:
    """Shifts of initial samples into each pixel from random neighbours, counted: `shifts` and those `defined`, (n,).

    short (distance, n)  those that connect y_1 to x_2 over less than each distance
    """
    chance = Live(rng)
    of = method.integrals(view(scene, method.rule, Counter(), sensor).tracer)
    X = initial(here := Pixels(of, np.arange(replicas * of.n)), chance)
    (near,) = random_in_row(of, here.index, 1, REAL_TIME.radius, chance)
    to, alive = near.index % of.n, X.W > 0
    J = of.shift(X.x, here.index, near).J
    y, _, _ = first_hit(of.tracer, X.x.u, to)
    r = np.where((J > 0) & (X.x.c == 2), norm(X.x.z - y.x), np.inf)
    masks = [alive, alive & (J > 0), *(alive & (r < d) for d in distances)]
    shifts, defined, *short = (np.bincount(to[mask], minlength=of.n) for mask in masks)
    return {"shifts": shifts, "defined": defined, "short": np.stack(short)}


def share(counts: Array, shifts: Array, mask: Array) -> float:
    """What share of the shifts into some pixels."""
    return float(counts[mask].sum() / shifts[mask].sum())


def indirect_light(setting: Setting, sensor: Pinhole) -> Array:
    """The image of a Lambert scene without direct light, by radiosity; (n,)."""
    whole, direct = (radiosity.render(setting.scene, sensor, bounces) for bounces in (setting.depth, 1))
    return np.asarray(whole - direct)


def relative(images: Array, truth: Array) -> Array:
    """(I - R)^2 / (R^2 + (.01 mean R)^2) of every pixel, whose mean is relMSE; (..., n)."""
    return np.asarray((images - truth) ** 2 / (truth**2 + (SMALL * truth.mean()) ** 2))
