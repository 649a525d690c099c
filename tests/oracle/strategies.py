"""Random finite scenes: everything that bugs need in order to show."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
from hypothesis import strategies as st

from restir_ref.batch import Array
from restir_ref.integrals import pdf
from restir_ref.mis import WEIGHTS, Weights, defensive, one_over_z, pairwise, talbot
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.scenes import Scene, paired

VOLUMES = [0.25, 0.5, 1.0, 2.0]
TARGETS = [0.0, 0.5, 1.0, 3.0]  # zeros that samplers reach
DENSITIES = [0, 1, 1, 2, 4]  # zeros: samplers that do not cover

TRACTABLE = {
    "talbot": Weights(talbot, proxy=pdf),
    "pairwise": Weights(pairwise, proxy=pdf),
    "defensive": Weights(defensive, proxy=pdf),
    "1/Z": Weights(WEIGHTS["1/Z"].m, one_over_z, proxy=pdf),
}
"""Weights that compare the known densities of raw candidates.  [GRIS 5.6]"""


def table(draw: st.DrawFn, shape: tuple[int, ...], values: list[float]) -> Array:
    size = int(np.prod(shape))
    return np.array(draw(st.lists(st.sampled_from(values), min_size=size, max_size=size)), dtype=float).reshape(shape)


@st.composite
def partial_injections(draw: st.DrawFn, K: int) -> tuple[int, ...]:
    """T(x) or -1 for K cells."""
    image = draw(st.permutations(range(K)))
    holes = draw(st.lists(st.booleans(), min_size=K, max_size=K))
    return tuple(-1 if hole else y for y, hole in zip(image, holes, strict=True))


@st.composite
def scenes(draw: st.DrawFn, n: int = 2, K: int = 3, frames: int = 1, techniques: int = 1) -> Scene:
    """A scene of `frames` frames with n pixels and K cells each."""
    count = n * frames
    v = table(draw, (count, K), VOLUMES)
    f = table(draw, (count, K), TARGETS)
    pdf = table(draw, (techniques, count, K), DENSITIES)
    pdf[..., 0] += pdf.sum(axis=-1) == 0  # a technique samples something
    pdf /= (pdf * v).sum(axis=-1, keepdims=True)
    maps = {(i, j): draw(partial_injections(K)) for j in range(count) for i in range(j)}
    tables = cells(v, f, pdf, paired(count, K, maps), proposal=table(draw, (K, K), [0, 1, 2]) + np.eye(K))
    covered = replace(tables, f=tables.p_hat)
    return Scene([Frame(covered, n, t) for t in range(frames)])


def exactly(scene: Scene) -> Scene:
    """The same scene in rational numbers."""
    old = scene.now.cells
    v, f, p_hat = (fractions(values) for values in (old.v, old.f, old.p_hat))
    pdf = fractions(np.round(old.pdf / old.pdf.max(axis=-1, keepdims=True), 6))
    pdf = pdf / (pdf * v).sum(axis=-1)[..., None]
    return Scene([Frame(cells(v, f, pdf, old.shifts, p_hat, old.proposal), each.n, each.t) for each in scene.frames])


def fractions(values: Array) -> Array:
    return np.vectorize(lambda value: Fraction(value).limit_denominator(10**6), otypes=[object])(values)
