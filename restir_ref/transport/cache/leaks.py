"""Light that leaks: what queries are told by probes that do not see the point they ask for."""

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.transport.cache.maps import fetched
from restir_ref.transport.cache.volume import Volume
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot


def leaked(v: Volume, s: Scene, x: Array, n: Array, b: Array) -> Array:
    """The part (C, N) of E+(x, n) that is told by probes behind the surface at x (d, N), or hidden from it.

    n (d, N) unit normal, b (d, N) the query's displacement; irradiance.
    """
    texels = v.maps.irradiance.fetch(n)
    E, whole = np.zeros((v.C, x.shape[-1])), np.zeros(x.shape[-1])
    for probe, weight in v.heard(x, n, b):
        place = v.grid.place(probe)
        unseen = (dot(n, place - x) <= 0) | ~s.visible(x, place)
        E += weight * unseen * fetched(v.E, probe, *texels)
        whole += weight
    return ratio(E, whole)
