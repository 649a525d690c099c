"""How much of a caustic's light a shift keeps on the way to a neighbour: whether a scene holds what Fig. 13 is about.

No error of any frame enters: this is how much two integrands overlap under one shift, of one initial sample per pixel.
"""

import numpy as np

from figures.claims.figure import Arrays
from figures.experiments.views import HYBRID, Traced, at_random
from restir_ref.batch import Array, rows
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels
from restir_ref.loop import REAL_TIME
from restir_ref.restir import initial
from restir_ref.transport.materials import roughest
from restir_ref.transport.paths import Path, Tracer, first_hit, scatter_by
from restir_ref.transport.rays import arrive


def kept(of: Traced, replicas: int, chance: Chance) -> Arrays:
    """Light of initial samples x that comes by way of a mirror or glass, and what a shift T keeps of it.

    light  sum of p_hat_i(x) W
    kept   sum of min(p_hat_i(x), p_hat_j(T(x)) J) W, j a random neighbour of i within the radius of reuse
    paths  how many there are
    J = 0 keeps nothing, and kept / light estimates int min(f_i, f_j o T |T'|) / int f_i, in [0, 1].
    """
    index = np.arange(replicas * of.n)
    X = initial(here := Pixels(of, index), chance)
    (near,) = at_random(of, index, 1, REAL_TIME.radius, chance)
    y = of.shift(X.x, index, near)
    p_hat = here.of.target(index, X.x)
    there = near.of.target(near.index, y.x) * y.J
    caustic = (p_hat > 0) & by_mirror(of.tracer, X.x, index % of.n)
    light = np.where(caustic, X.W, 0)
    found = light @ p_hat, light @ np.minimum(p_hat, there), caustic.sum()
    return dict(zip(("light", "kept", "paths"), map(np.asarray, found), strict=True))


def by_mirror(t: Tracer, x: Path, pixel: Array) -> Array:
    """Whether x_2 is on a mirror or glass, which no lobe makes rough enough to be connected to, (N,).  [GRIS 7.6]"""
    v, _, _ = first_hit(t, rows(x, "u", slice(t.sensor.numbers)), pixel)
    at = scatter_by(t, v, rows(x, "u", t.scatter_numbers(1)))
    z, _, met = arrive(t.scene, v.x, at.w)
    smooth = roughest(t.scene.materials, z) < HYBRID.roughness
    return np.asarray(met & smooth & (x.k > 1))


def share(a: Arrays, of: str) -> float:
    """What share of the light is kept, of arrays by "name.kept" and "name.light"."""
    return float(a[f"{of}.kept"] / a[f"{of}.light"])
