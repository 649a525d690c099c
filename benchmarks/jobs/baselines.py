"""The baselines to 0.5%: path reuse in tiles, ReSTIR GI and DI, each against a truth that is no estimate of theirs.

ReSTIR GI must be right on Lambert surfaces and wrong on glossy ones; ReSTIR DI right with weights that see
obstacles, and without them too dark where shadows end: in the quarter of the pixels at which the exact
direct light changes most from pixel to pixel.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.jobs.comparing import Sums, Truth, biased, joined, judged, stored, sums
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from benchmarks.jobs.nystrom import COARSE, FINE, render
from figures.figure import Arrays
from figures.references import reference
from flatland2d.scenes import INSET, SCENES
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Image, Pixels, Reservoirs
from restir_ref.loop import REAL_TIME, frame, random_in_row
from restir_ref.mis import Weights
from restir_ref.restir import shade
from restir_ref.transport.path_reuse import path_reuse
from restir_ref.transport.paths import RECONNECTION, Tracer, first_hit
from restir_ref.transport.rays import emitted
from restir_ref.transport.restir_di import BIASED, DEBIASED, direct_light, light_integrals
from restir_ref.transport.restir_gi import RadianceIntegrals

REPLICAS, FRAMES, EPS = 64, 3, 0.005
INDEX = np.arange(REPLICAS * INSET)


def tracer(scene: str) -> Tracer:
    """The scene's inset."""
    setting = SCENES[scene]()
    return Tracer(setting.scene, setting.pinhole(), setting.depth, RECONNECTION)


def tiles(scene: str, chance: Live) -> Array:
    """Path reuse."""
    return path_reuse(tracer(scene), INDEX % INSET, chance)[0]


def stored_radiance(scene: str, chance: Live) -> Array:
    """ReSTIR GI, the last of some frames with temporal and spatial reuse."""
    here, Y = Pixels(RadianceIntegrals(tracer(scene)), INDEX), None
    for _ in range(FRAMES):
        Y = frame(here, chance, REAL_TIME, random_in_row, Y, [here])
    assert Y is not None
    return shade(Y, here)[0]


def lights(mis: Weights) -> Callable[[str, Live], Array]:
    """ReSTIR DI, and light seen directly: the last of some frames with temporal and spatial reuse."""

    def rendered(scene: str, chance: Live) -> Array:
        t, X, before = tracer(scene), None, []
        u = chance.uniform((1, len(INDEX)))
        of = light_integrals(t, u, INDEX % INSET)
        here = Pixels(of, INDEX)
        for _ in range(FRAMES):
            near = random_in_row(of, INDEX, REAL_TIME.neighbours, REAL_TIME.radius, chance)
            X, before = direct_light(here, near, mis, chance, X, before), [here]
        assert X is not None
        v, _, T = first_hit(t, u, INDEX % INSET)
        return (shade(X, here) + T * emitted(t.scene, v))[0]

    return rendered


def whole(scene: str) -> Truth:
    """The reference."""
    found = reference(scene)
    return Truth(found.mean, found.error, found.image_error)


def direct(scene: str) -> Truth:
    """Direct light by radiosity with exact visibility."""
    setting = replace(SCENES[scene](), depth=1)
    coarse, fine = (render(setting, setting.pinhole(), fine) for fine in (COARSE, FINE))
    return Truth(fine, np.abs(fine - coarse), float(abs(fine.mean() - coarse.mean())))


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
    """By more than 1%, |z| >= 8."""
    return [biased(claims, what, found, truth, float(truth.mean.mean()), 0.01)]
