"""Contribution weights after k mutations, k = 1, 2, 5, 50: E[g(X) W] is the integral of g, for four probes g.

Three still frames with temporal reuse, mutations in the two-ray form, and spatial reuse; probes are taken after the
last frame's mutations and after its spatial reuse.  They look at what mutations move: x_c, and how far x_(c+1) is.
Truth is a sum over all leaves of path tracing.  The control leaves out the ratio of transitions.

Eight path trees per pixel and frame instead of one: behind the slit light is rare, and candidates make most noise.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from benchmarks.jobs.comparing import as_truth, biased, joined, judged, stored, sums
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from benchmarks.jobs.probes import constant
from benchmarks.jobs.references import lattice
from figures.claims.figure import Arrays
from flatland2d.scenes import INSET, SCENES
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.decorrelation import Mutation, mutations
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import REAL_TIME, WHOLE, frame, random_in_row
from restir_ref.oracle.mutations import without_T
from restir_ref.transport.mutations import LOBE_CHOICES, ByNumbers, FarPath, TwoRays, far_record
from restir_ref.transport.paths import Tracer, leaves, trace
from restir_ref.transport.vectors import norm
from tests.transport.paths import HYBRID

FRAMES, SIGMA, REPLICAS, PIXELS_AT_ONCE, EPS = 3, 0.1, 64, 8, 0.005
LOOP = replace(REAL_TIME, trees=8)
CHUNKS: Mapping[str, int] = MappingProxyType({"ajar": 320, "clear_coat": 576, "crease": 160})


@dataclass(frozen=True)
class Case:
    """A scene, the lobe's choice, how many mutations, and the claims."""

    scene: str
    choice: str
    k: int
    claims: str


CASES: Mapping[str, Case] = MappingProxyType(
    {
        **{f"ajar, k = {k}": Case("ajar", "kept", k, "MCMC-C02, MCMC-A02") for k in (1, 2, 5, 50)},
        **{f"clear coat, lobe {how}": Case("clear_coat", how, 5, "MCMC-A09") for how in LOBE_CHOICES},
        "crease, k = 50": Case("crease", "kept", 50, "MCMC-C02"),
    }
)
CONTROL = "crease, k = 50, T left out"
EVERY = {**CASES, CONTROL: CASES["crease, k = 50"]}

Probe = Callable[[FarPath], Array]


def carries(x: FarPath) -> Array:
    """Nearly 1 for paths that carry light, 0 at p_hat = 0."""
    return constant(x.F.mean(axis=0))


def near(x: FarPath) -> Array:
    """How near x_c is to x_(c+1), if it is joined to it."""
    joined_ = (x.c > 0) & (x.c <= x.k) & ~(x.nee & (x.c == x.k))
    return np.asarray(joined_ / (norm(x.far_z - x.z) + 0.1))


PROBES: Mapping[str, Probe] = MappingProxyType(
    {
        "constant": carries,
        "half domain": lambda x: carries(x) * ((x.c > 0) & (x.z[1] < 0.5)),
        "near": lambda x: carries(x) * near(x),
        "bump": lambda x: carries(x) * (x.c > 0) * np.exp(-(((x.z[0] - 0.3) / 0.1) ** 2)),
    }
)


def image(scene: str, choice: str) -> TwoRays:
    """The scene's inset."""
    setting = SCENES[scene]()
    return TwoRays(
        Tracer(setting.scene, setting.pinhole(), setting.depth, HYBRID), ByNumbers(SIGMA), LOBE_CHOICES[choice]
    )


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """Probes after the last frame's mutations and spatial reuse, or their truth."""
    if params["of"] == "truth":
        return truths(image(params["case"], "kept").tracer, rng)
    case = EVERY[params["case"]]
    rule = (lambda X, here, chance: without_T) if params["case"] == CONTROL else None
    return after_stages(image(case.scene, case.choice), mutations(case.k, *([rule] if rule else [])), Live(rng))


def after_stages(of: TwoRays, mutation: Mutation, chance: Live) -> Arrays:
    """REPLICAS images of g(X) W, for every probe and both stages of the last frame."""
    here, seen = Pixels(of, np.arange(REPLICAS * INSET)), []

    def watched(X: Reservoirs, here: Pixels, chance: Live) -> Reservoirs:
        seen.append(mutation(X, here, chance))
        return seen[-1]

    passes, X = replace(WHOLE, mutation=watched), None
    for _ in range(FRAMES):
        X = frame(here, chance, LOOP, random_in_row, X, [here] if X else (), passes=passes)
    found: Arrays = {}
    for stage, Y in (("mutation", seen[-1]), ("spatial", X)):
        for name, probe in PROBES.items():
            found |= stored(sums((probe(Y.x) * Y.W).reshape(REPLICAS, INSET)), f"{name}, {stage}")
    return found


def truths(t: Tracer, rng: np.random.Generator) -> Arrays:
    """One image of sum_leaves g for every probe, over moved lattices."""
    found: dict[str, list[Array]] = {name: [] for name in PROBES}
    for at in range(0, t.sensor.n, PIXELS_AT_ONCE):
        pixel = np.arange(at, at + PIXELS_AT_ONCE)
        u = ((lattice(t.D)[:, None] + rng.random((t.D, PIXELS_AT_ONCE, 1))) % 1).reshape(t.D, -1)
        N = u.shape[1]
        tree = trace(t, u, pixel.repeat(N // PIXELS_AT_ONCE))
        paths = [far_record(t, tree, (np.full(N, k), np.full(N, nee)), F) for k, nee, F in leaves(tree)]
        for name, probe in PROBES.items():
            total = np.sum([probe(x) for x in paths], axis=0)
            found[name].append(total.reshape(PIXELS_AT_ONCE, -1).mean(axis=1))
    return {
        key: value
        for name, each in found.items()
        for key, value in stored(sums(np.concatenate(each)[None]), name).items()
    }


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, truths and cases in each."""
    truth = [("truth", scene, part) for scene, count in CHUNKS.items() for part in parts(count // 2, share)]
    cases = [("case", name, part) for name, case in EVERY.items() for part in parts(CHUNKS[case.scene], share)]
    return [
        {"of": of, "case": name, "part": part} for of, name, part in sorted(truth + cases, key=lambda each: each[2])
    ]


def judge(done: Done) -> Sequence[Row]:
    """Every probe of every case after both stages; the control by the probe that sees it best."""
    rows = []
    for name, case in EVERY.items():
        mine = [arrays for params, arrays in done if (params["of"], params["case"]) == ("case", name)]
        exact = [arrays for params, arrays in done if (params["of"], params["case"]) == ("truth", case.scene)]
        for probe in PROBES:
            truth = as_truth(joined(exact, probe))
            for stage in ("mutation", "spatial"):
                found, what = joined(mine, f"{probe}, {stage}"), f"{name}: {probe}, after {stage}"
                if name != CONTROL:
                    rows.append(judged(case.claims, what, found, truth, float(truth.mean.mean()), EPS))
                elif (probe, stage) == ("near", "mutation"):
                    rows.append(biased("MCMC-C02", what, found, truth, 0.01))
    return rows


JOB = Job("Four probes of the contribution weights after any number of mutations", chunks, compute, judge)
