"""The decorrelation pass on paths keeps p_hat, as flows that cancel show; each known mistake turns a named check red.

Under detailed balance what goes from x to x' comes back: E[p_hat(X) W a(X, x') (h(x') - h(X))] = 0 for every h, where X
are candidates with their W, x' is proposed from X and a is the probability of acceptance.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cache
from itertools import product

import numpy as np
import pytest

from figures.claims.criteria import biased, unbiased
from figures.mcmc.mcmc_1d import six_cells
from flatland2d import PLANE, SCENES
from flatland2d.radiosity import cut, gather
from flatland2d.scenes import chain, matte, room
from restir_ref.batch import Array, ratio, take
from restir_ref.chance import Live
from restir_ref.decorrelation import STEPS, Acceptance, Blue, Move, Mutation, metropolis, mutate, mutations, ready
from restir_ref.integrals import Pixels, Reservoirs, target
from restir_ref.loop import REAL_TIME, WHOLE, frame, random_in_row
from restir_ref.oracle.mutations import clamped, inverted, kernel, last_accepted, power, without_T
from restir_ref.oracle.scenes import reference_scene
from restir_ref.oracle.zoo import exact_bias
from restir_ref.oracle.zoo.mutations import RIGHT, Stepping, mutating
from restir_ref.restir import initial, shade
from restir_ref.transport import mutations as module
from restir_ref.transport.baselines import light_mutations
from restir_ref.transport.baselines.light_mutations import MovingLights
from restir_ref.transport.baselines.restir_di import DEBIASED, direct_light, lit
from restir_ref.transport.mutations import ByDirections, ByNumbers, Retraced, TwoRays, jumped, number_into_x_c
from restir_ref.transport.paths import RECONNECTION, Path, Tracer, first_hit
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.scene import scene as compiled
from restir_ref.transport.shifts import shift_path
from restir_ref.transport.vectors import norm
from tests.oracle.walks import stationarity_error
from tests.transport.mutated import PIXELS, STEP, moves, retraced_acceptance, reused, same_fields, steep, tracer

REPLICAS = 192
WALKS: dict[str, Callable[[Tracer], PathIntegrals]] = {
    "two rays": lambda t: TwoRays(t, ByNumbers(0.2)),
    "two rays, bounded": lambda t: TwoRays(t, ByNumbers(0.2, STEPS["bounded"])),
    "two rays, lobe jumped": lambda t: TwoRays(t, ByNumbers(0.2), jumped),
    "two rays, directions": lambda t: TwoRays(t, ByDirections(0.2)),
    "retraced": lambda t: Retraced(t, 0.05),
    "retraced, into x_c": lambda t: Retraced(t, 0.2, STEPS["bounded"], number_into_x_c),
}
LOBED = ("two rays", "two rays, lobe jumped")
WHERE_IT_MATTERS = {"two rays": "crease", "two rays, lobe jumped": "cornell", "two rays, directions": "rack"}
"""Corners; two rough lobes; bars that make directions grazing."""

# ---------------------------------------------------------------- detailed balance


@cache
def candidates(scene: str) -> tuple[Reservoirs, Array]:
    """Reservoirs that have not been reused, and their columns."""
    here = Pixels(TwoRays(tracer(scene)), np.arange(REPLICAS * PIXELS))
    return initial(here, Live(np.random.default_rng(1)), 2), here.index


def heights(x: Path) -> dict[str, Array]:
    """Functions of a path: its target, the density of x_c, and how near x_c is to x_(c+1) if it is joined to it."""
    joined = (x.c > 0) & (x.c <= x.k) & ~(x.nee & (x.c == x.k))
    p_hat = x.F.mean(axis=0)
    return {
        "p_hat": p_hat / (p_hat + 0.5),
        "A": np.minimum(np.log(x.A + 1e-6), 3),
        "near": joined / (norm(x.far_z - x.z) + 0.1) if hasattr(x, "far_z") else np.zeros(len(x.k)),
        "where": x.z[0] * (x.c > 0),
    }


def flows(of: PathIntegrals, scene: str, acceptance: Acceptance = metropolis) -> dict[str, float]:
    """z of E[p_hat W a (h(x') - h(x))] over images, for every h."""
    X, index = candidates(scene)
    if isinstance(of, Retraced):
        X = replace(X, x=Path(**{each.name: getattr(X.x, each.name) for each in fields(Path)}))
    here = Pixels(of, index)
    x_new, T = of.propose(index, X.x, Live(np.random.default_rng(2)))
    move = Move(here, X, x_new, target(here, X.x), target(here, x_new), T)
    flow = move.p_hat * X.W * np.where((move.p_hat_new > 0) & (X.W > 0), acceptance(move), 0)
    before, after = heights(X.x), heights(x_new)
    each = {h: (flow * (after[h] - before[h])).reshape(REPLICAS, -1).mean(axis=1) for h in before}
    return {h: float(e.mean() / (e.std(ddof=1) or 1) * np.sqrt(REPLICAS)) for h, e in each.items()}


def worst_flow(of: PathIntegrals, scene: str, acceptance: Acceptance = metropolis) -> float:
    return max(abs(z) for z in flows(of, scene, acceptance).values())


@pytest.mark.claims("MCMC-A07", part="flows of steps of primary numbers", world="flatland2d")
@pytest.mark.claims("MCMC-A09", part="flows, the lobe kept and jumped", world="flatland2d")
@pytest.mark.parametrize(
    ("walk", "scene"), [*product(WALKS, ["glossy_cornell"]), *product(LOBED, ["clear_coat"]), *WHERE_IT_MATTERS.items()]
)
def test_what_goes_from_path_to_path_comes_back(walk, scene) -> None:
    assert worst_flow(WALKS[walk](tracer(scene)), scene) < 4  # 44 numbers: by chance once in 350 suites


def upside_down(move: Move) -> Array:
    """T turned round."""
    return metropolis(replace(move, T_ratio=ratio(np.ones(len(move.T_ratio)), move.T_ratio)))


def mixed(w: float) -> Acceptance:
    """The acceptance of blue noise where a_bn = 1, as it is in grey pixels."""
    return lambda move: np.minimum(1, (w + (1 - w) * ratio(move.p_hat_new, move.p_hat)) * move.T_ratio)


WRONG = {"T left out": without_T, "T upside down": upside_down, "half blue": mixed(0.5), "blue": mixed(1.0)}


@pytest.mark.parametrize("wrong", WRONG.values(), ids=WRONG)
def test_a_wrong_acceptance_makes_paths_flow(wrong) -> None:
    assert worst_flow(TwoRays(tracer("glossy_cornell"), ByNumbers(0.2)), "glossy_cornell", wrong) > 6


@dataclass(frozen=True)
class Symmetric(ByDirections):
    """Steps of directions that are taken for symmetric in primary numbers."""

    def __call__(self, t, v, lobe, w, chance):
        w_new, T = super().__call__(t, v, lobe, w, chance)
        return w_new, np.where(T > 0, 1.0, 0.0)


def test_steps_of_directions_taken_for_symmetric_make_paths_flow() -> None:
    assert worst_flow(TwoRays(tracer("rack"), Symmetric(0.2)), "rack") > 6


def test_lobes_that_jump_in_proportion_to_their_shares_alone_make_paths_flow() -> None:
    def careless(t, at, lobe, w, chance):
        return chance.choose(at.P)

    assert worst_flow(TwoRays(tracer("cornell"), ByNumbers(0.2), careless), "cornell") > 6


# ---------------------------------------------------------------- named checks, and the mistakes that turn them red


def standing(mutation: Mutation) -> Mutation:
    """A mutation by integrals that know where paths stand."""
    return lambda X, here, chance: mutation(X, ready(X, here), chance)


def keeps_light(of: TwoRays, mutation: Mutation) -> bool:
    """p_hat W, the luminance of the pixel itself, is what it was."""
    X, here = reused(of, 3, seed=3)
    Y = mutation(X, here, Live(np.random.default_rng(4)))
    before, after = (shade(Z, here)[0] for Z in (X, Y))
    return bool(np.abs(after - before).max() < 1e-10 * before.mean())


def retraces(of: TwoRays, acceptance: Acceptance) -> bool:
    """Acceptances are those of paths traced from scratch."""
    X, here = reused(of, 3, seed=3)
    m = moves(of, X, here, seed=4)
    p_hat, p_hat_new = m.x.F.mean(axis=0), m.x_new.F.mean(axis=0)
    one = np.ones(len(m.T))
    a = acceptance(Move(here, Reservoirs(m.x, one, one), m.x_new, p_hat, p_hat_new, m.T))
    right = np.minimum(1, retraced_acceptance(m))
    return bool((np.abs(a - right) < 1e-9)[steep(m)].all())


def comes_back(of: TwoRays, mutation: Mutation) -> bool:
    """The shift of every moved path to its own pixel is defined and the identity."""
    X, here = reused(of, 3, seed=3)
    Y = mutation(X, here, Live(np.random.default_rng(4)))
    lit_ = np.flatnonzero(Y.W > 0)
    y, J = shift_path(of.tracer, take(Y.x, lit_), here.index[lit_] % of.n)
    return bool((np.abs(J - 1) < 1e-9).all() and (np.abs(y.F / Y.x.F[:, lit_] - 1) < 1e-9).all())


def lies_inside(of: TwoRays, mutation: Mutation) -> bool:
    """No number lies on the boundary, where continuous steps never end."""
    X, here = reused(of, 3, seed=3)
    Y = mutation(X, here, Live(np.random.default_rng(4)))
    return not ((Y.x.c > 0) & (Y.x.A < 1e-11)).any() and not on_boundary(of, Y, here).any()


def on_boundary(of: TwoRays, Y: Reservoirs, here: Pixels) -> Array:
    at = of.standing(Y, here.index)
    x = take(Y.x, at.columns)
    w = (x.z - at.at.v.x) / norm(x.z - at.at.v.x)
    u = module.direction_number(of.tracer, at.at.v, x.lobe_in, w)
    return np.asarray((u < 1e-7) | (u > 1 - 1e-7))


def keeps_moves(of: TwoRays, walk: Mutation) -> bool:
    """What was accepted stays, whatever becomes of later proposals."""
    X, here = reused(of, 1, seed=3)
    moved = [np.array_equal(walk(X, here, AcceptingOnly(5, which)).x.z, X.x.z) for which in (0, 4)]
    return moved == [False, False]


class AcceptingOnly:
    """Accepts only one of k proposals."""

    def __init__(self, k: int, which: int) -> None:
        self.rng, self.asked, self.which = np.random.default_rng(5), 0, which

    def choose(self, weights: Array) -> Array:
        self.asked += 1
        return ((self.asked - 1 == self.which) & (weights[1] > 0)).astype(int)

    def uniform(self, shape: tuple[int, ...]) -> Array:
        return self.rng.random(shape)


TWO = TwoRays(tracer("glossy_cornell"), STEP)
CLAMPED = replace(TWO, turn=ByNumbers(0.3, clamped))
GREEDY = replace(TWO, tracer=replace(TWO.tracer, rule=RECONNECTION))


@dataclass(frozen=True, eq=False)
class Unchecked(TwoRays):
    """Proposals are made as if any two rough vertices could be connected."""

    def standing(self, X, index):
        loose = TwoRays(replace(self.tracer, rule=RECONNECTION), self.turn)
        at = super().standing(X, index)
        return module.Standing(loose, at.columns, at.at)


Check = Callable[[], bool]
RED: dict[str, tuple[Check, Check]] = {
    "inverted W: light is kept": (
        lambda: keeps_light(TWO, mutations(5)),
        lambda: keeps_light(TWO, standing(inverted)),
    ),
    "accept overwritten: accepted moves stay": (
        lambda: keeps_moves(TWO, mutations(5)),
        lambda: keeps_moves(TWO, standing(last_accepted(5))),
    ),
    "clamped proposal: numbers lie inside": (
        lambda: lies_inside(TWO, mutations(5)),
        lambda: lies_inside(CLAMPED, mutations(5)),
    ),
    "T left out: acceptance by retracing": (
        lambda: retraces(TWO, metropolis),
        lambda: retraces(TWO, without_T),
    ),
    "T upside down: acceptance by retracing": (
        lambda: retraces(TWO, metropolis),
        lambda: retraces(TWO, upside_down),
    ),
    "changed index not rejected: the shift to its own pixel": (
        lambda: comes_back(TWO, mutations(5)),
        lambda: comes_back(Unchecked(TWO.tracer, STEP), mutations(5)),
    ),
    "blue acceptance with W for p_hat: acceptance by retracing": (
        lambda: retraces(TWO, metropolis),
        lambda: retraces(TWO, mixed(1.0)),
    ),
}


@pytest.mark.parametrize(("right", "wrong"), RED.values(), ids=RED)
def test_the_check_is_green_for_the_right_mutation_and_red_for_the_mistake(right, wrong) -> None:
    assert right()
    assert not wrong()


# ---------------------------------------------------------------- exact on cells


@pytest.mark.claims("MCMC-C02", part="the pass on finite cells")
@pytest.mark.parametrize("k", [0, 1, 2, 3])
def test_k_mutations_are_the_kth_power_of_one_and_keep_p_hat(k) -> None:
    cells = six_cells("bounded")
    assert pytest.approx(power(kernel(cells, 0), k).A, abs=1e-12) == kernel(cells, 0, mutations(k)).A
    assert stationarity_error(cells, mutations(k)) < 1e-12


@pytest.mark.claims("MCMC-A02", part="on finite cells")
def test_mutations_between_candidates_and_spatial_reuse_are_exact() -> None:
    scene = reference_scene()
    assert np.abs(exact_bias(mutating(mutations(2))(scene), scene)).max() < 1e-12
    assert np.abs(exact_bias(replace(RIGHT, here=Stepping, near=Stepping)(scene), scene)).max() < 1e-12


# ---------------------------------------------------------------- in the loop


def two_frames(of: TwoRays, mutation: Mutation, seed: int = 6) -> Reservoirs:
    """Two frames with history."""
    here, chance = Pixels(of, np.arange(2 * of.n)), Live(np.random.default_rng(seed))
    passes = replace(WHOLE, mutation=mutation)
    X = frame(here, chance, REAL_TIME, random_in_row, passes=passes)
    return frame(here, chance, REAL_TIME, random_in_row, X, [here], passes=passes)


@pytest.mark.claims("COM-B14", world="flatland2d")
def test_without_mutations_the_frame_is_bit_for_bit_what_it_was() -> None:
    of = TwoRays(tracer("ajar"), STEP)
    here, chance = Pixels(of, np.arange(2 * of.n)), Live(np.random.default_rng(6))
    X = frame(here, chance, REAL_TIME, random_in_row)
    X = frame(here, chance, REAL_TIME, random_in_row, X, [here])
    none, one = (two_frames(of, mutations(k)) for k in (0, 1))
    assert np.array_equal(none.W, X.W)
    assert same_fields(none.x, X.x) == 0
    assert not np.array_equal(one.W, X.W)


@pytest.mark.claims("MCMC-A02", "MCMC-F06")
def test_mutations_come_after_temporal_and_before_spatial_reuse() -> None:
    of, said = PathIntegrals(tracer("cornell")), []

    def named(name: str, call):
        def noted(X, *args, **options):
            said.append(name)
            return call(X, *args, **options)

        return noted

    passes = replace(
        WHOLE,
        initial=named("initial", WHOLE.initial),
        temporal=named("temporal", WHOLE.temporal),
        mutation=named("mutation", WHOLE.mutation),
        spatial=named("spatial", WHOLE.spatial),
    )
    here, chance = Pixels(of, np.arange(of.n)), Live(np.random.default_rng(6))
    X = frame(here, chance, REAL_TIME, random_in_row, passes=passes)
    frame(here, chance, replace(REAL_TIME, rounds=2), random_in_row, X, [here], passes=passes)
    assert said == [*["initial", "mutation", "spatial", "initial", "temporal", "mutation", "spatial", "spatial"]]


@pytest.mark.parametrize("k", [1, 3])
def test_null_samples_stay_where_they_are(k) -> None:
    for of in (TWO, Retraced(TWO.tracer)):
        X, here = reused(of, 1, seed=7)
        null = here.index % 2 == 0
        X = replace(X, W=np.where(null, 0, X.W))
        Y = mutations(k)(X, here, Live(np.random.default_rng(8)))
        assert (Y.W[null] == 0).all()
        assert np.array_equal(Y.x.z[:, null], X.x.z[:, null])
        assert (Y.x.z[:, ~null] != X.x.z[:, ~null]).any()


# ---------------------------------------------------------------- light samples


def two_lamps() -> Tracer:
    """A room with a post, a wide dim lamp and a small bright one, so that points are not equally likely per area."""
    lamps = [*chain([(0.5, 0.99), (0.1, 0.99)], 0, 2.0), *chain([(0.9, 0.99), (0.85, 0.99)], 0, 30.0)]
    post = [*chain([(0.45, 0.3), (0.45, 0.6)], 0), *chain([(0.45, 0.6), (0.45, 0.3)], 0)]
    setting = SCENES["cornell"]()
    scene = compiled(PLANE, [matte(0.6)], [*room(0), *lamps, *post])
    return Tracer(scene, replace(setting.pinhole(64, 0), film=64, half=1.2), 1, RECONNECTION)


def lights(t: Tracer, replicas: int, kind=MovingLights) -> Pixels:
    """Direct light at the pixels' centres."""
    index = np.arange(replicas * t.sensor.n)
    v, _, T = first_hit(t, np.full((1, len(index)), 0.5), index % t.sensor.n)
    return Pixels(kind(t.scene, t.sensor.n, v, T, 0.1), index)


@dataclass(frozen=True, eq=False)
class Areal(MovingLights):
    """Steps of numbers that are taken for symmetric per area."""

    def propose(self, index, x, chance):
        y, T = super().propose(index, x, chance)
        return y, np.where(T > 0, 1.0, 0.0)


def light_flow(kind) -> float:
    """The largest z of flows between points on the lamps, by where they are."""
    t, replicas = two_lamps(), 256
    here, chance = lights(t, replicas, kind), Live(np.random.default_rng(9))
    X = lit(initial(here, chance, 8), here)
    y, T = here.of.propose(here.index, X.x, chance)
    move = Move(here, X, y, target(here, X.x), target(here, y), T)
    flow = move.p_hat * X.W * np.where((move.p_hat_new > 0) & (X.W > 0), metropolis(move), 0)
    zs = []
    for h in (lambda x: x.light.y[0], lambda x: x.light.y[0] > 0.7, lambda x: np.sin(9 * x.light.y[0])):
        each = (flow * (h(y) * 1.0 - h(X.x))).reshape(replicas, -1).mean(axis=1)
        zs.append(abs(each.mean() / each.std(ddof=1)) * np.sqrt(replicas))
    return max(zs)


def test_what_goes_from_light_point_to_light_point_comes_back() -> None:
    assert light_flow(MovingLights) < 4
    assert light_flow(Areal) > 6


def direct_images(k: int, kind=MovingLights) -> tuple[Array, Array]:
    """Two frames of direct light with k mutations each, (replicas, n), and the truth by quadrature."""
    t, chance, found = two_lamps(), Live(np.random.default_rng(10)), []
    for _ in range(2):
        here = lights(t, 64, kind)
        X, before = None, []
        for _ in range(2):
            near = random_in_row(here.of, here.index, 3, 10, chance)
            passes = replace(WHOLE, mutation=mutations(k))
            X = direct_light(here, near, DEBIASED["talbot"], chance, X, before, passes=passes)
            before = [here]
        found.append(shade(X, here)[0].reshape(64, -1))
    panels = cut(t.scene, 16)
    v, _, _ = first_hit(t, np.full((1, t.sensor.n), 0.5), np.arange(t.sensor.n))
    return np.concatenate(found), gather(t.scene, panels, panels.emission, v.x, v.prim, v.n)


def test_direct_light_with_mutations_is_unbiased() -> None:
    images, truth = direct_images(5)
    assert unbiased(images.mean(axis=1), truth.mean(), eps=0.02).passed


def test_light_points_that_move_behind_obstacles_are_noticed(monkeypatch) -> None:
    monkeypatch.setattr(light_mutations, "visibility", lambda at, x: np.ones(len(at.index), dtype=bool))
    images, truth = direct_images(5)
    assert biased(images.mean(axis=1), truth.mean(), -0.5, -0.02).passed


def test_the_numbers_of_a_light_sample_draw_its_point_after_any_reuse() -> None:
    here, chance = lights(two_lamps(), 2), Live(np.random.default_rng(11))
    near = random_in_row(here.of, here.index, 3, 10, chance)
    passes = replace(WHOLE, mutation=mutations(3))
    X = direct_light(here, near, DEBIASED["talbot"], chance, passes=passes)
    again = module_sample(here, X.x.u)
    assert np.array_equal(again, X.x.light.y)


def module_sample(here: Pixels, u: Array) -> Array:
    return light_mutations.sample_light(here.of.scene, u[0], u[1:]).y


# ---------------------------------------------------------------- bad input


@pytest.mark.parametrize("k", [-1, 1.5, "5", None])
def test_a_number_of_mutations_that_is_none_is_refused(k) -> None:
    with pytest.raises(
        ValueError, match=r"number k of mutations must be a whole number >= 0, but is .*leaves the pass"
    ):
        mutations(k)


def test_integrals_that_cannot_propose_are_named_with_the_remedy() -> None:
    of = PathIntegrals(tracer("cornell"))
    X, here = reused(of, 1, seed=1)
    for walk in (mutations(1), mutate):
        with pytest.raises(TypeError, match=r"PathIntegrals has no propose.*transport.mutations.*k = 0"):
            walk(X, here, Live(np.random.default_rng(1)))
    assert mutations(0)(X, here, Live(np.random.default_rng(1))) is X


@pytest.mark.parametrize("w", [-0.1, 1.1, np.nan])
def test_a_weight_of_blue_noise_outside_of_the_unit_interval_is_refused(w) -> None:
    with pytest.raises(ValueError, match=r"weight w of blue noise must be in \[0, 1\], but is"):
        Blue(np.ones(1), [], [], w)


@pytest.mark.parametrize("temperature", [0, -1.0, np.nan])
def test_a_temperature_that_is_none_is_refused(temperature) -> None:
    with pytest.raises(ValueError, match="temperature of blue noise must be one positive number"):
        Blue(np.ones(1), [], [], 1.0, temperature)


@pytest.mark.parametrize("sigma", [0, -1.0, np.nan])
def test_lights_that_do_not_move_are_refused(sigma) -> None:
    of = lights(two_lamps(), 1).of
    with pytest.raises(ValueError, match="sigma must be one positive number"):
        replace(of, sigma=sigma)
