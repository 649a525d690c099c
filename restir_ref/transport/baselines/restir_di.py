"""ReSTIR DI as integrals: the direct light at first hits x_1 that are given.  [Bitterli 2020; GRIS App. B]

A sample is a point on a light, and its measure is area, so that a shift copies it with J = 1.  The target
leaves visibility out: p_hat = mean over channels of f |cos_1| |cos_y| / r^(d-1) L_e.  Visibility enters
when a sample is kept or shown, `lit`, which zeroes W behind an obstacle; f W is then complete.

So an input's samples stop where its view of the lights does, and MIS weights must know: `DEBIASED`
compares the targets with visibility.  Plain 1/M, `BIASED`, counts inputs that could not have found the
sample, and is too dark around the edges of shadows.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array, take
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs, Shifted, target
from restir_ref.loop import WHOLE, Passes
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.transport import materials as mat
from restir_ref.transport.materials import Vertex
from restir_ref.transport.paths import Tracer, Tree, first_hit, leaves
from restir_ref.transport.rays import LightPoint, sample_light
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot, norm

CANDIDATES = 32
"""Points on lights that are resampled to one.  [Bitterli 2020]"""


@dataclass(frozen=True)
class LightSample:
    """A point on a light, and the radiance f (C, N) that it sends to the sensor by way of x_1, were nothing between."""

    light: LightPoint
    f: Array


@dataclass(frozen=True, eq=False)
class LightIntegrals:
    """I = int over lights of f |cos_1| |cos_y| / r^(d-1) V L_e dA at given x_1, one per column of v and T (C, N).

    Delta lobes have no part in it.  Hazard: points on lights are the only candidates, and where lights touch
    what they light their variance is infinite.
    """

    scene: Scene
    n: int
    v: Vertex
    T: Array

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[LightSample, Array]]:
        """A point on a light that is picked by power; W = 1 / pdf_area."""
        pick, *point = chance.uniform((self.scene.space.d, len(index)))
        light = sample_light(self.scene, pick, np.stack(point))
        yield LightSample(light, self.arriving(index, light)), 1 / light.pdf_area

    def arriving(self, index: Array, light: LightPoint) -> Array:
        """f (C, N): T f |cos_1| |cos_y| / r^(d-1) L_e, for emission is one-sided."""
        s = self.scene
        v, T = take((self.v, self.T), index)
        to = light.y - v.x
        r = np.maximum(norm(to), 1e-300)
        w = to / r
        f, _ = mat.evaluate_all(s.materials, s.space, v, mat.lobe_shares(s.materials, v), s.space.to_local(v.n, w))
        return np.asarray(T * f * np.maximum(-dot(light.n, w), 0) / r ** (s.space.d - 1) * light.emission)

    def target(self, index: Array, x: LightSample) -> Array:
        """p_hat = mean of f over channels, without visibility."""
        return np.asarray(x.f.mean(axis=0))

    def contribution(self, index: Array, x: LightSample) -> Array:
        """f, (C, N); visibility is in W."""
        return x.f

    def shift(self, x: LightSample, index: Array, to: Pixels) -> Shifted:
        """The same point lights another x_1; J = 1 in area."""
        there: LightIntegrals = to.of  # type: ignore[assignment]
        return Shifted(LightSample(x.light, there.arriving(to.index, x.light)), np.ones(len(to.index)))


def visibility(at: Pixels, x: LightSample) -> Array:
    """V(x_1, y), one shadow ray for every sample that would send light; (N,)."""
    of: LightIntegrals = at.of  # type: ignore[assignment]
    clear = np.asarray(x.f.any(axis=0))
    asked = np.flatnonzero(clear)
    clear[asked] = of.scene.visible(of.v.x.take(at.index[asked], axis=-1), x.light.y.take(asked, axis=-1))
    return clear


def seen_target(at: Pixels, x: LightSample) -> Array:
    """p_hat V: where an input's samples can be, and how many; (N,)."""
    return target(at, x) * visibility(at, x)


def lit(X: Reservoirs, here: Pixels) -> Reservoirs:
    """W <- W V: a sample that x_1 does not see becomes a null sample, and keeps its confidence."""
    return replace(X, W=X.W * visibility(here, X.x))


BIASED = WEIGHTS["constant"]
DEBIASED: Mapping[str, Weights] = MappingProxyType(
    {name: replace(WEIGHTS[name], proxy=seen_target) for name in ("1/Z", "talbot", "defensive")}
)
"""Weights that ask which inputs see the sample: 1/Z counts them [Bitterli 2020], the others also compare targets.

All M inputs' samples are asked for, M^2 shadow rays in a pass; Bitterli et al. ask for the selected one's only.
"""


def direct_light(
    here: Pixels,
    near: Sequence[Pixels],
    mis: Weights,
    chance: Chance,
    history: Reservoirs | None = None,
    before: Sequence[Pixels] = (),
    *,
    passes: Passes = WHOLE,
) -> Reservoirs:
    """One frame: candidates, temporal reuse if there is history, mutations, spatial reuse; visibility after every pass.

    Mutations see visibility themselves (`light_mutations`).
    """
    X = lit(passes.initial(here, chance, CANDIDATES), here)
    if history is not None:
        X = lit(passes.temporal(X, here, history, before, chance, mis=mis), here)
    X = passes.mutation(X, here, chance)
    return lit(passes.spatial(X, here, near, chance, mis=mis), here)


def light_integrals(t: Tracer, u: Array, pixel: Array) -> LightIntegrals:
    """Direct light at the first hits of primary numbers u of `pixel` (N,): a G-buffer."""
    v, _, T = first_hit(t, u, pixel)
    return LightIntegrals(t.scene, t.sensor.n, v, T)


def indirect_light(tree: Tree) -> Array:
    """All leaves of a tree that ReSTIR DI does not stand for: k != 1, and lights met by delta lobes of x_1; (C, N)."""
    by_delta = tree.at[0].p == 0
    return np.asarray(sum(F if k != 1 else F * (by_delta & (not nee)) for k, nee, F in leaves(tree)))
