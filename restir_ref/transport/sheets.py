"""Facets as rays ask for them: by affine maps, and two at a time where two triangles make a parallelogram.

A simplex with corners v_0 .. v_(d-1) has coordinates b, x = v_0 + sum b_k (v_k - v_0), and is where b >= 0 and
sum b <= 1.  The box that its edges at v_0 span is where 0 <= b <= 1.  (d-1)! simplices fill it: in space two, and
most scenes are made of rectangles.  One sheet then does for both, and sum b <= 1 tells which of them is met.
"""

from dataclasses import dataclass
from math import factorial

import numpy as np

from restir_ref.batch import Array

EDGE = 1e-12
"""Simplices are larger by this much of themselves, so that neighbours leave no gap."""

FLUSH = 2.0**-44
"""Corners that are nearer than this share of the facet are one: what rounding leaves of a box that was turned."""


@dataclass(frozen=True, eq=False)
class Sheets:
    """P sheets, of which the first `boxes` are two facets each, and balls.

    maps (d P, d), offsets (d P, 1)  coordinates first, heights last
    prims (2, P + B)  the primitive where sum b <= 1, and the one beyond; balls come last
    """

    maps: Array
    offsets: Array
    boxes: int
    prims: Array

    @property
    def P(self) -> int:
        """How many."""
        return len(self.maps) // int(self.maps.shape[1])


def affine_maps(corners: Array, normals: Array) -> tuple[Array, Array]:
    """Coordinates b of the facets (S, d, d) enlarged by EDGE, then heights: maps (d S, d), offsets (d S, 1)."""
    d = corners.shape[-1]
    matrix = np.concatenate([corners[:, 1:] - corners[:, :1], normals[:, None]], axis=1).swapaxes(1, 2)
    maps = np.linalg.inv(matrix).swapaxes(0, 1) / (1 + d * EDGE)  # (d, S, d)
    maps[-1] = normals
    offsets = -np.einsum("ksd,sd->ks", maps, corners[:, 0])
    offsets[:-1] += EDGE / (1 + d * EDGE)
    return maps.reshape(-1, d).copy(), offsets.reshape(-1, 1)


def sheets(corners: Array, normals: Array, balls: int) -> Sheets:
    """Of facets with corners (S, d, d) and normals (S, d): neighbours in the list that fill a box, then the others.

    A box begins at the corner that its second facet does not have.
    """
    first, apex = _boxes(corners)
    single = np.setdiff1d(np.arange(len(corners)), [*first, *first + 1])
    order = np.append(first, single)
    turned = corners[order]
    turned[: len(first)] = _from(turned[: len(first)], apex)
    maps, offsets = affine_maps(turned, normals[order])
    last = [*single, *range(len(corners), len(corners) + balls)]
    return Sheets(maps, offsets, len(first), np.array([[*first, *last], [*first + 1, *last]], dtype=int))


def _boxes(corners: Array) -> tuple[Array, Array]:
    """Facets k that fill a box with facet k + 1, none of them twice, and the corner of each where the box begins."""
    S, d = corners.shape[:2]
    if factorial(d - 1) != 2 or S < 2:
        return np.zeros(0, dtype=int), np.zeros(0, dtype=int)
    fills = np.stack([_fill(_from(corners[:-1], apex), corners[1:]) for apex in range(d)])
    k = np.flatnonzero(fills.any(axis=0))
    run = np.maximum.accumulate(np.where(np.diff(k, prepend=-2) > 1, np.arange(len(k)), 0))
    k = k[(np.arange(len(k)) - run) % 2 == 0]
    return k, fills[:, k].argmax(axis=0)


def _from(corners: Array, apex: int | Array) -> Array:
    """The corners (P, d, d) of facets, in a circle from the one called apex, an index or (P,)."""
    turn = (np.reshape(apex, (-1, 1)) + np.arange(corners.shape[1])) % corners.shape[1]
    return np.take_along_axis(corners, np.broadcast_to(turn, corners.shape[:2])[:, :, None], axis=1)


def _fill(p: Array, q: Array) -> Array:
    """Whether facets q (P, d, d) have the corners of p but v_0, whose mirror image in their middle they have; (P,)."""
    others = p[:, 1:]
    wanted = np.concatenate([others, others.sum(axis=1, keepdims=True) - p[:, :1]], axis=1)
    apart = np.abs(wanted[:, :, None] - q[:, None]).max(axis=3).min(axis=2).max(axis=1)
    return np.asarray(apart <= FLUSH * np.abs(others - p[:, :1]).max(axis=(1, 2)))
