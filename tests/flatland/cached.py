"""Rows of flatland that a cache in closed form lights, and what they are worth by quadrature."""

from dataclasses import replace
from functools import cache

import numpy as np

from figures.claims.criteria import all_unbiased, mean_and_blocks
from flatland2d import SCENES
from restir_ref.batch import Array
from restir_ref.integrals import Pixels
from restir_ref.transport.cache.leaving import Cache
from restir_ref.transport.paths import RECONNECTION, Tracer
from tests.transport.cache.fields import Smooth
from tests.transport.cache.gathered import at_centres, gathered

PIXELS, REPLICAS = 32, 256
CROPS = {"matte_cornell": 240, "crease": 128, "ajar": 224, "glossy_cornell": 240, "occluders": 96}
"""First pixels, on a film of 480, of rows that show what the scenes are for."""


def row(scene: str) -> Tracer:
    setting = SCENES[scene]()
    return Tracer(setting.scene, replace(setting.pinhole(PIXELS, 0), film=480, first=CROPS[scene]), 1, RECONNECTION)


def lighted(scene: str, replicas: int = REPLICAS, G_max: float = np.inf, **other) -> Pixels:
    """Replicas of the row; `other` fields of the integrals."""
    t = row(scene)
    here = at_centres(t, Cache(t.scene, Smooth(2)), replicas, G_max)
    return Pixels(replace(here.of, **other), here.index)


@cache
def truth(scene: str) -> Array:
    """By quadrature; halving the cells changes the mean by less than a tenth of eps = 2 %."""
    of = lighted(scene, 1).of
    fine, coarse = (gathered(of, cells)[0] for cells in (2048, 1024))
    assert abs(fine.mean() - coarse.mean()) < 0.002 * fine.mean()
    return fine


def replicated(image: Array) -> Array:
    """(C, N) -> the first channel, (replicas, pixels)."""
    return image[0].reshape(-1, PIXELS)


def agrees(scene: str, found: Array, eps: float = 0.02) -> bool:
    """Whether replicas (R, pixels) are right in the mean, all of the row and its four blocks."""
    return all_unbiased(mean_and_blocks(found, 4), mean_and_blocks(truth(scene), 4), eps).passed
