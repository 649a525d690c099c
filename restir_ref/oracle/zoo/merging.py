"""Loops whose passes end in another merge than `gris`, for bugs that sit inside the pass itself.

`restir.temporal` and `restir.spatial` are a list of inputs and `gris`; `merging` keeps the lists.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from restir_ref.batch import Array, take, total
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs, Shifted, target
from restir_ref.mis import Confidences, Weights
from restir_ref.oracle.scenes import Parts
from restir_ref.resampling import Candidate, Input, gris, select
from restir_ref.restir import around, capped

Merge = Callable[[Sequence[Input], Pixels, Weights, Chance], Reservoirs]
"""Resample the inputs, the canonical one first, into reservoirs of the pixels."""

Rate = Callable[[int, int, Shifted, Sequence[Input], Pixels], Array]
"""rate(j, i, Y_i, inputs, here): what the MIS weight of candidate i takes for the density of input j, (N,)."""


def merging(merge: Merge) -> Parts:
    """The two-frame loop with another merge."""

    def across(
        X: Reservoirs, here: Pixels, neighbours: Sequence[Pixels], chance: Chance, /, *, mis: Weights
    ) -> Reservoirs:
        return merge([Input(X, here), *around(X, neighbours)], here, mis, chance)

    def along(
        X: Reservoirs,
        here: Pixels,
        Y: Reservoirs,
        before: Sequence[Pixels],
        chance: Chance,
        /,
        *,
        mis: Weights,
        cap: float,
    ) -> Reservoirs:
        history = [Input(capped(take(Y, source.index), cap), source) for source in before]
        return merge([Input(X, here), *history], here, mis, chance)

    return Parts(temporal=along, spatial=across)


def confidence(inputs: Sequence[Input]) -> Array:
    """C = sum_j c_j."""
    return total([source.X.c for source in inputs])


def shifted(source: Input, here: Pixels) -> Shifted:
    """Y_i = T_i(X_i); the identity for canonical inputs."""
    if source.at is here:
        return Shifted(source.X.x, np.ones(len(here.index)))
    return source.at.of.shift(source.X.x, source.at.index, here)


def jacobians(inputs: Sequence[Input], here: Pixels) -> list[Array]:
    """J_i of every input's sample."""
    return [shifted(source, here).J for source in inputs]


def edited(edit: Callable[[Input, Pixels], Reservoirs]) -> Merge:
    """`gris` of inputs whose reservoirs are edited on entry."""

    def merge(inputs: Sequence[Input], here: Pixels, mis: Weights, chance: Chance) -> Reservoirs:
        return gris([replace(source, X=edit(source, here)) for source in inputs], here, mis, chance)

    return merge


def rated(rate: Rate) -> Merge:
    """`gris` with other densities in its MIS weights.  The bug is in `weigh`, whose lines these are."""

    def merge(inputs: Sequence[Input], here: Pixels, mis: Weights, chance: Chance) -> Reservoirs:
        c = Confidences([source.X.c for source in inputs], [i for i, each in enumerate(inputs) if each.at is here])
        offered = []
        for i, source in enumerate(inputs):
            y = shifted(source, here)
            m = mis.m(i, lambda j, i=i, y=y: rate(j, i, y, inputs, here), c)  # type: ignore[misc]
            offered.append(Candidate(y.x, target(here, y.x), m * source.X.W * y.J))
        return select(offered, chance, confidence(inputs))

    return merge
