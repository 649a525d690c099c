"""The baselines to 0.5%: path reuse in tiles, ReSTIR GI and DI, each against a truth that is no estimate of theirs.

ReSTIR GI must be right on Lambert surfaces and wrong on glossy ones; ReSTIR DI right with weights that see
obstacles, and without them too dark where shadows end: in the quarter of the pixels at which the exact
direct light changes most from pixel to pixel.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.jobs.comparing import BLOCKS, Sums, Truth, biased, joined, judged, refined, stored, sums
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from benchmarks.jobs.references import coarse_and_fine
from figures.claims.figure import Arrays
from figures.experiments.references import reference
from flatland2d.scenes import INSET, SCENES
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Image, Pixels
from restir_ref.loop import REAL_TIME, frame, random_in_row
from restir_ref.mis import Weights
from restir_ref.restir import shade
from restir_ref.transport.baselines.path_reuse import path_reuse
from restir_ref.transport.baselines.restir_di import (
    BIASED,
    DEBIASED,
    LightIntegrals,
    direct_light,
    indirect_light,
    light_integrals,
)
from restir_ref.transport.baselines.restir_gi import RadianceIntegrals
from restir_ref.transport.paths import RECONNECTION, Tracer, first_hit, trace
from restir_ref.transport.rays import emitted
from restir_ref.transport.restir_pt import PathIntegrals

REPLICAS, FRAMES, EPS = 64, 3, 0.005
INDEX = np.arange(REPLICAS * INSET)


def tracer(scene: str) -> Tracer:
    """The scene's inset."""
    setting = SCENES[scene]()
    return Tracer(setting.scene, setting.pinhole(), setting.depth, RECONNECTION)


def tiles(scene: str, chance: Live) -> Array:
    """Path reuse."""
    return np.asarray(path_reuse(tracer(scene), INDEX % INSET, chance)[0])


def frames(of: Callable[[Tracer], Image]) -> Callable[[str, Live], Array]:
    """Integrals in the loop, the last of some frames with temporal and spatial reuse."""

    def rendered(scene: str, chance: Live) -> Array:
        here, Y = Pixels(of(tracer(scene)), INDEX), None
        for _ in range(FRAMES):
            Y = frame(here, chance, REAL_TIME, random_in_row, Y, [here])
        assert Y is not None
        return np.asarray(shade(Y, here)[0])

    return rendered


def lights(mis: Weights) -> Callable[[str, Live], Array]:
    """ReSTIR DI, and light seen directly: the last of some frames with temporal and spatial reuse."""

    def rendered(scene: str, chance: Live) -> Array:
        t, X = tracer(scene), None
        before: list[Pixels] = []
        u = chance.uniform((1, len(INDEX)))
        of = light_integrals(t, u, INDEX % INSET)
        here = Pixels(of, INDEX)
        for _ in range(FRAMES):
            near = random_in_row(of, INDEX, REAL_TIME.neighbours, REAL_TIME.radius, chance)
            X, before = direct_light(here, near, mis, chance, X, before), [here]
        assert X is not None
        v, _, T = first_hit(t, u, INDEX % INSET)
        return np.asarray((shade(X, here) + T * emitted(t.scene, v))[0])

    return rendered


def direct_and_traced(scene: str, chance: Live) -> Array:
    """Path tracing whose direct light at x_1 is ReSTIR DI's, one frame with spatial reuse."""
    t = tracer(scene)
    tree = trace(t, chance.uniform((t.D, len(INDEX))), INDEX % INSET)
    of = LightIntegrals(t.scene, INSET, tree.x[0], tree.T[0])
    near = random_in_row(of, INDEX, REAL_TIME.neighbours, REAL_TIME.radius, chance)
    here = Pixels(of, INDEX)
    return np.asarray((shade(direct_light(here, near, DEBIASED["talbot"], chance), here) + indirect_light(tree))[0])


def whole(scene: str) -> Truth:
    """The reference."""
    found = reference(scene)
    return Truth(found.mean, found.error, found.image_error)


def direct(scene: str) -> Truth:
    """Direct light by radiosity."""
    return refined(coarse_and_fine(replace(SCENES[scene](), depth=1)))


@dataclass(frozen=True)
class Baseline:
    """Claims, scene, renderer (scene, chance) -> (N,), truth, chunks of REPLICAS images, and how it is judged."""

    claims: str
    scene: str
    render: Callable[[str, Live], Array]
    truth: Callable[[str], Truth]
    chunks: int
    judge: Callable[[str, str, Sums, Truth], list[Row]]


def unbiased(claims: str, what: str, found: Sums, truth: Truth) -> list[Row]:
    """To 0.5%."""
    return [judged(claims, what, found, truth, float(truth.mean.mean()), EPS)]


def certainly_biased(claims: str, what: str, found: Sums, truth: Truth) -> list[Row]:
    """By more than 1%, |z| >= 8, in the image or a block."""
    return [biased(claims, what, found, truth, 0.01)]


def dark_at_edges(claims: str, what: str, found: Sums, truth: Truth) -> list[Row]:
    """Too dark by more than 1% with |z| >= 8 in the blocks of pixels where direct light changes most."""
    change = np.abs(np.diff(truth.mean, prepend=truth.mean[0])).reshape(BLOCKS, -1).sum(axis=1)
    edges = np.argsort(change)[-BLOCKS // 4 :]
    part = truth.mean.reshape(BLOCKS, -1)[edges]
    of_edges = found.blocks[:, edges].mean(axis=1)
    error = of_edges.std(ddof=1) / np.sqrt(found.R)
    z, bias = (of_edges.mean() - part.mean()) / error, of_edges.mean() / part.mean() - 1
    holds, limit = bool(bias < -0.01 and z <= -8), "control: bias < -1%, z <= -8"
    return [Row(claims, f"{what} at edges of shadows", bias, limit, holds, found.R, error / part.mean(), f"z {z:+.1f}")]


GI, PT = frames(RadianceIntegrals), frames(PathIntegrals)
BASELINES: Mapping[str, Baseline] = {
    "path reuse, cornell": Baseline("COM-B02", "cornell", tiles, whole, 16, unbiased),
    "path reuse, ajar": Baseline("COM-B02", "ajar", tiles, whole, 160, unbiased),
    "ReSTIR GI, all Lambert": Baseline("COM-B03, GRIS-C11", "matte_cornell", GI, whole, 32, unbiased),
    "ReSTIR PT, all Lambert": Baseline("GRIS-C11", "matte_cornell", PT, whole, 32, unbiased),
    "ReSTIR GI, glossy": Baseline("COM-B03, GRIS-C11", "glossy_cornell", GI, whole, 64, certainly_biased),
    "ReSTIR PT, glossy": Baseline("GRIS-C11", "glossy_cornell", PT, whole, 64, unbiased),
    "ReSTIR DI, 1/Z": Baseline("COM-B04", "many_lights", lights(DEBIASED["1/Z"]), direct, 16, unbiased),
    "ReSTIR DI, Talbot": Baseline("COM-B04", "many_lights", lights(DEBIASED["talbot"]), direct, 16, unbiased),
    "ReSTIR DI, pairwise": Baseline("COM-B04", "many_lights", lights(DEBIASED["defensive"]), direct, 16, unbiased),
    "path tracing with ReSTIR DI": Baseline("COM-B08", "matte_cornell", direct_and_traced, whole, 16, unbiased),
    "ReSTIR DI, 1/M": Baseline("COM-B04", "many_lights", lights(BIASED), direct, 16, dark_at_edges),
}


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, all baselines in each."""
    every = [(part, name) for name, each in BASELINES.items() for part in parts(each.chunks, share)]
    return [{"of": name, "part": part} for part, name in sorted(every)]


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """REPLICAS images."""
    asked = BASELINES[params["of"]]
    return stored(sums(asked.render(asked.scene, Live(rng)).reshape(REPLICAS, INSET)), "images")


def judge(done: Done) -> Sequence[Row]:
    """Every baseline by its own claim."""
    rows: list[Row] = []
    for name, asked in BASELINES.items():
        found = joined([arrays for params, arrays in done if params["of"] == name], "images")
        rows += asked.judge(asked.claims, f"{name}: bias against the truth", found, asked.truth(asked.scene))
    return rows


JOB = Job("Baselines against references and radiosity", chunks, compute, judge)
