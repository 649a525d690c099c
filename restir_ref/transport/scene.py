"""Surfaces in d dimensions, simplices and spheres, compiled to arrays: segments and triangles are the same code."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.coincidence import coincidence, coincident
from restir_ref.transport.intersection import CLEARANCE, Matrices, Surfaces
from restir_ref.transport.materials import Material, Table, table
from restir_ref.transport.sheets import affine_maps, sheets
from restir_ref.transport.space import Space

FAR = 1e4
"""Coordinates reach at most so many times the scene's size: beyond, they are too coarse for what is told apart."""


@dataclass(frozen=True)
class Facet:
    """A simplex with d corners, row by row; its front, where det(edges, normal) > 0, may emit."""

    corners: Sequence[Sequence[float]]
    material: int = 0
    emission: Sequence[float] = ()


@dataclass(frozen=True)
class Ball:
    """A sphere (circle in flatland); its front is outside."""

    centre: Sequence[float]
    radius: float
    material: int = 0


@dataclass(frozen=True, eq=False)
class Lights:
    """The E emitting simplices: corners (d, d, E) corner by corner, normals (d, E), emission (C, E).

    upto (E,)  running sum of their probabilities;  pdf_area (E,)  density per area of a sampled point
    """

    corners: Array
    normals: Array
    emission: Array
    upto: Array
    pdf_area: Array


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything a path can meet, as arrays; primitives are the S facets, then the B balls.

    corners (d, d, S) corner by corner, normals (d, S)
    centres (d, B), radii (B, 1);  material (S + B,), emission (C, S + B), pdf_area (S + B,)
    surfaces  answers what rays meet: whoever counts, lets light through walls, or knows a faster way puts it here
    """

    space: Space
    materials: Table
    corners: Array
    normals: Array
    centres: Array
    radii: Array
    material: Array
    emission: Array
    pdf_area: Array
    lights: Lights
    extent: float
    surfaces: Surfaces

    @property
    def C(self) -> int:
        """Number of channels."""
        return len(self.emission)

    @property
    def S(self) -> int:
        """Number of facets."""
        return int(self.normals.shape[-1])

    def intersect(self, x: Array, w: Array) -> tuple[Array, Array]:
        """Distance t (N,) to the nearest surface along x + t w, and its primitive (N,); inf and 0 if there is none."""
        return self.surfaces.intersect(x, w)

    def visible(self, x: Array, y: Array) -> Array:
        """Whether nothing stands between x and y, (N,)."""
        return self.surfaces.visible(x, y)

    def meets(self, x: Array, y: Array, prim: Array) -> Array:
        """Whether a ray from x meets the primitive at y, of which y is a point, and nothing before; (N,)."""
        return np.asarray(self.visible(x, y) & (self.surfaces.foremost(y, prim, y - x) == prim))


def scene(space: Space, materials: Sequence[Material], facets: Sequence[Facet], balls: Sequence[Ball] = ()) -> Scene:
    """Compile a scene.

    Raises ValueError for a scene without light, too far from the origin, corners or centres of the wrong shape,
    degenerate facets, balls without radius, unknown materials, emission that is negative or of unequal channels, or
    two lamps in one place.
    """
    C = _check_scene(space.d, materials, facets, balls)
    corners = np.array([facet.corners for facet in facets], dtype=float)
    normals, sizes = _normals_and_sizes(corners)
    dark = np.zeros(C)
    emission = np.array([[*facet.emission] or dark for facet in facets] + [dark] * len(balls), dtype=float).T
    share = emission[:, : len(facets)].mean(axis=0) * sizes
    pdf_area = np.append(share / share.sum() / sizes, np.zeros(len(balls)))
    centres = np.array([ball.centre for ball in balls], dtype=float).reshape(-1, space.d).T
    radii = np.array([ball.radius for ball in balls], dtype=float).reshape(-1, 1)
    extent = _extent(np.concatenate([corners.reshape(-1, space.d).T, centres - radii.T, centres + radii.T], axis=1))
    maps, offsets = affine_maps(corners, normals)
    pairs = coincident(corners, maps, offsets, CLEARANCE * extent)
    _check_lamps(pairs, normals, emission)
    together = coincidence(pairs, emission.max(axis=0) > 0, normals.T.copy(), maps, offsets)
    return Scene(
        space,
        table(materials, C),
        np.moveaxis(corners, 0, -1).copy(),
        together.normals,
        centres,
        radii,
        np.array([facet.material for facet in facets] + [ball.material for ball in balls]),
        emission,
        pdf_area,
        _lights(corners, normals, emission, pdf_area, share),
        extent,
        Matrices(maps, offsets, sheets(corners, normals, len(balls)), centres, radii, extent, together),
    )


def _check_scene(d: int, materials: Sequence[Material], facets: Sequence[Facet], balls: Sequence[Ball]) -> int:
    """Number of channels; raises ValueError."""
    channels = {np.size(facet.emission) for facet in facets if np.any(facet.emission)}
    if len(channels) != 1:
        raise ValueError(
            f"the lights have {sorted(channels)} channels, but all must have the same number."
            if channels
            else "the scene has no light: give at least one facet a positive emission."
        )
    for facet in facets:
        _check_facet(facet, d, max(channels))
    for ball in balls:
        if np.shape(ball.centre) != (d,) or not 0 < ball.radius < np.inf or not np.isfinite(ball.centre).all():
            raise ValueError(f"{ball} needs a centre of {d} finite coordinates and a positive, finite radius.")
    for index in {facet.material for facet in facets} | {ball.material for ball in balls}:
        if not (index == int(index) and 0 <= index < len(materials)):
            raise ValueError(f"there is no material {index!r}: the scene has {len(materials)}, counted from 0.")
    return max(channels)


def _check_facet(facet: Facet, d: int, channels: int) -> None:
    if [np.size(corner) for corner in facet.corners] != [d] * d or not np.isfinite(facet.corners).all():
        raise ValueError(f"a facet needs {d} corners of {d} finite coordinates each, but {facet} has others.")
    if (
        np.ndim(facet.emission) != 1
        or len(facet.emission) not in (0, channels)
        or not all(0 <= e < np.inf for e in facet.emission)
    ):
        raise ValueError(
            f"emission must be {channels} finite numbers >= 0, or () for none, but is {facet.emission!r} in {facet}."
        )


def _extent(x: Array) -> float:
    """The larger of the scene's size and its largest coordinate, of which rounding errors are a share.

    Raises ValueError for a scene too far from the origin.
    """
    size, reach = float(np.ptp(x, axis=1).max()), float(np.abs(x).max())
    if reach > FAR * size:
        raise ValueError(
            f"the scene is {size:.6g} wide and has coordinates up to {reach:.6g}, more than {FAR:g} times that: "
            f"rounding errors would show. Move it, and whoever looks at it, to the origin."
        )
    return max(size, reach)


def _check_lamps(pairs: Array, normals: Array, emission: Array) -> None:
    """Raise ValueError for two lamps in one place that shine to one side."""
    for a, b in pairs.T:
        if emission[:, a].any() and emission[:, b].any() and normals[a] @ normals[b] > 0:
            raise ValueError(
                f"facets {min(a, b)} and {max(a, b)} emit to the same side from the same place, and only one can be "
                f"seen: leave one out, or move it in front of the other."
            )


def _normals_and_sizes(corners: Array) -> tuple[Array, Array]:
    """Unit normals (S, d) with det(edges, normal) > 0, and d-1 dimensional sizes (S,)."""
    edges = corners[:, 1:] - corners[:, :1]
    d = corners.shape[-1]
    minors = [np.linalg.det(np.delete(edges, k, axis=2)) * (-1) ** (d - 1 + k) for k in range(d)]
    normals = np.stack(minors, axis=-1)
    length = np.linalg.norm(normals, axis=-1)
    flatness = length / np.maximum(np.abs(edges).max(axis=(1, 2)) ** (d - 1), 1e-300)
    worst = int(np.argmin(flatness))
    if not flatness[worst] > 1e-10:
        raise ValueError(
            f"facet {worst} is degenerate: its corners are {corners[worst].tolist()}; move them apart, or leave it out."
        )
    return normals / length[:, None], length / np.prod(np.arange(1, d))


def _lights(corners: Array, normals: Array, emission: Array, pdf_area: Array, share: Array) -> Lights:
    """Lights are picked by power."""
    lit = np.flatnonzero(share)
    upto = np.cumsum(share[lit]) / share.sum()
    return Lights(
        np.moveaxis(corners[lit], 0, -1).copy(), normals[lit].T.copy(), emission[:, lit].copy(), upto, pdf_area[lit]
    )
