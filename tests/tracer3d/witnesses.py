"""Path tracing by us and by Mitsuba, block by block: what the laws and the evidence of the witness are stated with."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType, ModuleType
from unittest.mock import patch

import numpy as np
from scipy.stats import qmc

from restir_ref.batch import Array
from restir_ref.transport import lobes
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import RECONNECTION, Tracer, radiance, trace
from restir_ref.transport.scene import Ball, scene
from tracer3d.scenes import SCENES, Setting, grey, matte
from tracer3d.shapes import lamp, room
from tracer3d.space import SOLID
from tracer3d.witness import exported, rendered

SIDE = 4
BLOCKS = SIDE**2
"""Blocks of an inset, SIDE along each of its own sides."""

AT_ONCE = 2**14


def frosted_ball(roughness: float = 0.2, eta: float = 1.5) -> Setting:
    """The room of GlassBall3 with a ball of rough glass, the reflection slightly red, and a larger lamp.

    Rougher glass is too noisy for a budget.  That our lobes are chosen by Fresnel's term at the surface's normal, not
    at the microfacet's, may be why; it is not tested.
    """
    glass = [Layer("rough reflection", (1.0, 0.9, 0.8), roughness), Layer("rough transmission", grey(0.9), roughness)]
    facets = [*room(0), *lamp((0.3, 0.3), (0.7, 0.7), 0.99, 8.0)]
    materials = [matte(grey(0.6)), Material(glass, eta=eta)]
    inside = scene(SOLID, materials, facets, [Ball((0.5, 0.25, 0.5), 0.2, 1)])
    return Setting(inside, (0.5, 0.45, 0.95), (0.5, 0.1, 0.4), (928, 674), depth=5)


WITNESSED: Mapping[str, Callable[[], Setting]] = MappingProxyType(
    {
        **{name: SCENES[name] for name in ("cornell", "glossy_cornell", "matte_cornell", "glass_ball", "ajar")},
        "frosted_ball": frosted_ball,
    }
)


def separable(alpha: Array, o: Array, i: Array) -> Array:
    """G_2 / G_1(o) = G_1(i): Mitsuba's Smith term, which takes the two maskings for independent."""
    return np.asarray(np.abs(i[-1]) / np.maximum(lobes.smith_area(alpha, i), lobes.TINY))


def with_separable_smith() -> "patch[Callable[..., Array]]":
    """A context in which our GGX lobes have Mitsuba's Smith term."""
    return patch("restir_ref.transport.lobes.masking", separable)


# ---------------------------------------------------------------- means of blocks


def ours(at: Setting, points: Sequence[int], rounds: int, rng: np.random.Generator) -> Array:
    """Means of the inset's blocks by channel, (rounds, 3, BLOCKS), from so many points of a Sobol sequence in each.

    Rounds and blocks are independent scramblings, so that the spread of rounds tells the error.
    """
    t = Tracer(at.scene, at.pinhole(), at.depth, RECONNECTION)
    places = [(block, n) for _ in range(rounds) for block, n in enumerate(points)]
    u, pixel = (np.concatenate(each, axis=-1) for each in zip(*(in_block(t, *at, rng) for at in places), strict=True))
    parts = (slice(k, k + AT_ONCE) for k in range(0, len(pixel), AT_ONCE))
    L = np.concatenate([radiance(trace(t, u[:, part], pixel[part])) for part in parts], axis=1)
    starts = np.cumsum([0, *(n for _, n in places[:-1])])
    found = np.add.reduceat(L, starts, axis=1) / [n for _, n in places]
    return np.asarray(found.reshape(3, rounds, BLOCKS).swapaxes(0, 1))


def in_block(t: Tracer, block: int, n: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Primary samples (D, n) of one block and their pixels (n,); two of Sobol's numbers are a place in the block."""
    u = qmc.Sobol(t.D, seed=rng).random(n).T.copy()  # `rng=` is not known before SciPy 1.15
    rows, columns = (count // SIDE for count in t.sensor.shape)  # type: ignore[attr-defined]
    column, row = u[0] * columns, u[1] * rows
    u[0], u[1] = column % 1, row % 1
    pixel = (block // SIDE * rows + row.astype(int)) * SIDE * columns + block % SIDE * columns + column.astype(int)
    return u, pixel


def theirs(mi: ModuleType, at: Setting, samples: int, rounds: int, rng: np.random.Generator) -> Array:
    """The same by Mitsuba, with so many paths per pixel."""
    loaded = mi.load_dict(exported(mi, at.scene, at.pinhole(), at.depth))
    seeds = rng.integers(2**31, size=rounds).tolist()
    return np.stack([by_block(rendered(mi, loaded, samples, seed)) for seed in seeds])


def by_block(image: Array) -> Array:
    """Means (3, BLOCKS) of a picture (3, rows, columns)."""
    C, rows, columns = image.shape
    cut = image.reshape(C, SIDE, rows // SIDE, SIDE, columns // SIDE)
    return np.asarray(cut.mean(axis=(2, 4)).reshape(C, BLOCKS))


def spread_out(most: int, noise: Array) -> list[int]:
    """Points for each block, powers of 2 that go with the square of its relative noise (BLOCKS,); the most: `most`."""
    exponent = np.log2(most) + np.round(2 * np.log2(noise / noise.max()))
    return [int(2**each) for each in np.maximum(exponent, 6)]


# ---------------------------------------------------------------- comparing


@dataclass(frozen=True, eq=False)
class Means:
    """Means by channel and of all of them for the image (4,), of all channels for blocks (BLOCKS,); their errors."""

    image: Array
    image_error: Array
    block: Array
    block_error: Array


def means(samples: Array) -> Means:
    """Of independent rounds, (rounds, 3, BLOCKS)."""
    grey = samples.mean(axis=1)
    image = np.concatenate([samples.mean(axis=2), grey.mean(axis=1)[:, None]], axis=1)
    found = [(each.mean(axis=0), each.std(axis=0, ddof=1) / np.sqrt(len(each))) for each in (image, grey)]
    return Means(*found[0], *found[1])


@dataclass(frozen=True, eq=False)
class Difference:
    """Ours over Mitsuba's less 1, with standard errors: of the image (4,), of blocks (BLOCKS,)."""

    image: Array
    image_error: Array
    block: Array
    block_error: Array

    def __str__(self) -> str:
        k = int(np.argmax(np.abs(self.block)))
        channels = ", ".join(f"{each:+.2%}" for each in self.image[:3])
        return (
            f"image {self.image[3]:+.2%} +- {self.image_error[3]:.2%} (channels {channels}), block {k} "
            f"{self.block[k]:+.2%} +- {self.block_error[k]:.2%}, SE of blocks <= {self.block_error.max():.2%}"
        )


def difference(mine: Means, truth: Means) -> Difference:
    """Relative differences."""
    return Difference(
        mine.image / truth.image - 1,
        np.hypot(mine.image_error, truth.image_error) / truth.image,
        mine.block / truth.block - 1,
        np.hypot(mine.block_error, truth.block_error) / truth.block,
    )


@dataclass(frozen=True)
class Limits:
    """How far image and blocks may be off, and how large a block's standard error may be; an image's a third of it."""

    image: float
    block: float
    block_error: float


def agrees(d: Difference, limits: Limits) -> bool:
    """All within their limits, and precise enough to tell."""
    near = (np.abs(d.image) <= limits.image).all() and (np.abs(d.block) <= limits.block).all()
    sure = (3 * d.image_error <= limits.image).all() and (d.block_error <= limits.block_error).all()
    return bool(near and sure)


def convicted(d: Difference, limits: Limits) -> bool:
    """The image or a block is beyond its limit, and not by chance: by 5 standard errors of a difference of 0."""
    image = (np.abs(d.image) > limits.image) & (np.abs(d.image) > 5 * d.image_error)
    block = (np.abs(d.block) > limits.block) & (np.abs(d.block) > 5 * d.block_error)
    return bool(image.any() or block.any())
