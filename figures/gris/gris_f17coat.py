"""GRIS 9.3 on path reuse: it beats path tracing in all scenes but one, whose surfaces have shiny layers.

The floor of FS10 has a matte base, which shares what the coat does not.  Beside it stands the same room with a base
that is shiny as well, twice as rough as its coat, and ever smoother: fewer and fewer directions of a tile's other
pixels carry light to one's own.  Errors are compared at the MAPE of 256 path trees.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import offline
from figures.experiments.rendering import lattice_tracing, means
from figures.gris.gris_f17 import rays_to
from figures.report import style
from flatland2d.scenes import matte
from restir_ref.metrics import mape
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.materials import Layer, Material, table
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SCENE = "clear_coat"
SMOOTH = (0.1, 0.03, 0.01)
FLOORS = ("FS10", *(f"two shiny layers, r = {2 * r:g}, {r:g}" for r in SMOOTH))
METHODS = ("path tracing", "path reuse", "truth")
TARGET = 256
"""Path trees whose error is to be reached: within what path reuse renders, so that nothing is extrapolated."""

MOST = 1.2
"""The largest speedup that counts as none."""

MAKERS = {
    "path tracing": offline.METHODS["path tracing"],
    "path reuse": offline.METHODS["path reuse"],
    "truth": offline.Method(lattice_tracing(indirect_light), 0),
}


@dataclass(frozen=True)
class Floor:
    """Path integrals of the room with the floor of that number in FLOORS."""

    number: int

    def __call__(self, t: Tracer) -> PathIntegrals:
        """The integrals of a tracer."""
        if self.number == 0:
            return PathIntegrals(t)
        r = SMOOTH[self.number - 1]
        base, coat = Layer("ggx", (0.5,), 2 * r, weight=0.6), Layer("ggx", (0.3,), r, weight=0.4)
        materials = table([matte(0.6), Material([base, coat])], t.scene.C)
        return PathIntegrals(replace(t, scene=replace(t.scene, materials=materials)))


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """One per floor and method, and the truth."""
    return [{"floor": k, "method": method} for k in range(len(FLOORS)) for method in METHODS]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images (count, n) and rays per pixel of one; the mean image (n,) of the truth."""
    method, integrals = chunk["method"], Floor(chunk["floor"])
    found = offline.render(replace(MAKERS[method], integrals=integrals), SCENE, preset[method], rng)
    return {**found, "images": found["images"].mean(axis=0)} if method == "truth" else found


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """By "floor.method.name"."""
    named = zip(chunks(preset), results, strict=True)
    return {f"{chunk['floor']}.{chunk['method']}.{key}": part[key] for chunk, part in named for key in part}


def curve(a: Arrays, k: int, method: str) -> tuple[Any, Any]:
    """Rays per pixel and MAPE of means of 1, 2, 4, .. images, as long as there are eight groups."""
    images, truth = a[f"{k}.{method}.images"], a[f"{k}.truth.images"]
    T = 2 ** np.arange(int(np.log2(len(images) // 8)) + 1)
    return T * float(a[f"{k}.{method}.rays"]), np.array([mape(means(images, int(t)), truth).mean() for t in T])


def speedup(a: Arrays, k: int) -> float:
    """Rays of path tracing with TARGET trees over those of path reuse with the same MAPE."""
    rays, errors = curve(a, k, "path tracing")
    at = int(np.log2(TARGET // offline.UNIT))
    return float(rays[at] / rays_to(float(errors[at]), *curve(a, k, "path reuse")))


def check(a: Arrays) -> list[Claim]:
    """On the shiniest layers path reuse gains nothing, and less the shinier they are; every floor is told."""
    found = [speedup(a, k) for k in range(len(FLOORS))]
    texts = "; ".join(f"{name}: {each:.2g}" for name, each in zip(FLOORS, found, strict=True))
    falls = criteria.below(max(after / before for before, after in pairwise(found[1:])), 1)
    return [
        Claim("GRIS-F17", criteria.below(found[-1], MOST), "path reuse: speedup on the shiniest layers", caveat=CAVEAT),
        Claim("GRIS-F17", falls, "path reuse: largest ratio of speedups, shinier layers over those before"),
        Claim("GRIS-F17", criteria.reported(texts), "path reuse: speedup by floor"),
    ]


CAVEAT = (
    "On FS10, whose base is matte, path reuse gains as elsewhere. How shiny Zeroday's layers are, the paper does not "
    "say; here they have to be much smoother than FS10's coat."
)


def draw(a: Arrays) -> "Picture":
    """MAPE over rays, by floor."""
    picture, axes = style.panels(2, 2, width=4.2, height=2.9)
    for k, (axis, name) in enumerate(zip(axes.ravel(), FLOORS, strict=True)):
        for method in METHODS[:2]:
            axis.loglog(*curve(a, k, method), **style.look(method), markevery=1)
        axis.set(xlabel="rays per pixel", ylabel="MAPE", title=f"{name}: {speedup(a, k):.2g}x")
        axis.legend()
    return picture


FIGURE = Figure(
    id="GRIS-F17coat",
    title="Path reuse on ever shinier layers",
    world="flatland2d",
    source="[GRIS Fig. 17; 9.3]",
    claims=("GRIS-F17",),
    presets={
        "quick": {"path tracing": 1024, "path reuse": 512, "truth": 6},
        "paper": {"path tracing": 8192, "path reuse": 4096, "truth": 128},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
    conditions=(
        Conditions(
            ("GRIS-F17",),
            "9.3, Fig. 17",
            Setup("offline", "still", "indirect", "Zeroday, surfaces of shiny layers"),
            Setup("offline", "still", "indirect", "inset of FS10, its floor as it is, and of two shiny layers"),
        ),
    ),
)
