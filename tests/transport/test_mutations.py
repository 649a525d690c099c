"""Laws of mutations on paths: own numbers, two rays against retracing, what moves and what stays, cost, bad input."""

from collections import Counter
from collections.abc import Callable
from dataclasses import fields, replace
from functools import cache
from itertools import product

import numpy as np
import pytest

from flatland2d import SCENES
from restir_ref.batch import Array, changed, take
from restir_ref.chance import Live
from restir_ref.decorrelation import STEPS, mutations
from restir_ref.integrals import Pixels
from restir_ref.transport import materials as mat
from restir_ref.transport import mutations as module
from restir_ref.transport.counting import counted, rays
from restir_ref.transport.mutations import (
    LOBE_CHOICES,
    NUMBERS,
    ByDirections,
    ByNumbers,
    FarPath,
    Retraced,
    TwoRays,
    jumped,
    number_into_x_c,
)
from restir_ref.transport.paths import RECONNECTION, Tracer
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.retracing import inside, traced
from restir_ref.transport.shifts import shift_path
from restir_ref.transport.vectors import normalize
from tests.transport.furnished import FURNISHED, furnished_shifts
from tests.transport.mutated import (
    PIXELS,
    STEP,
    Moves,
    factored,
    moves,
    over_areas,
    own,
    retraced_acceptance,
    retraced_far,
    reused,
    same_fields,
    steep,
    tracer,
)
from tests.transport.paths import RULES

every_scene = pytest.mark.parametrize("scene", SCENES)
TURNS = {"numbers": STEP, "bounded numbers": ByNumbers(0.1, STEPS["bounded"]), "directions": ByDirections(0.1)}

# ---------------------------------------------------------------- own numbers


@cache
def after_reuse(scene: str, rule: str = "hybrid") -> tuple:
    """Lit paths after spatial reuse, and their pixels."""
    of = TwoRays(tracer(scene, rule), STEP)
    X, here = reused(of, 3, seed=1)
    lit = np.flatnonzero(X.x.F.any(axis=0))
    return of.tracer, take(X.x, lit), here.index[lit] % of.n


@pytest.mark.claims("MCMC-A08", part="round trips by retracing")
@pytest.mark.parametrize(
    ("scene", "rule"), [*((name, "hybrid") for name in SCENES), *(("glossy_cornell", rule) for rule in RULES)]
)
def test_retracing_its_own_numbers_finds_the_path_again_whatever_reuse_it_went_through(scene, rule) -> None:
    t, x, i = after_reuse(scene, rule)
    y = traced(t, own(t, x, i), i, x.k, x.nee)
    assert len(i) > 50
    assert (y.c == x.c).all()
    assert np.abs(y.F / x.F - 1).max() < 1e-11
    assert np.abs(y.A / x.A - 1).max() < 1e-8


def test_the_numbers_of_the_record_do_not_find_it_again() -> None:
    t, x, i = after_reuse("glossy_cornell")
    stale = x.c > 0
    y = traced(t, x.u, i, x.k, x.nee)
    assert (np.abs(y.F[0] / x.F[0] - 1)[stale] > 1e-6).mean() > 0.3
    assert np.abs(y.F[0] / x.F[0] - 1)[~stale].max() < 1e-11


@pytest.mark.parametrize("name", FURNISHED)
def test_own_numbers_know_no_dimension(name) -> None:
    s = furnished_shifts(name, RECONNECTION, 2000, seed=3)
    lit = np.flatnonzero((s.J > 0) & s.y.F.any(axis=0) & (s.y.A > 1e-6))
    x, i = take(s.y, lit), s.j[lit]
    y = traced(s.t, own(s.t, x, i), i, x.k, x.nee)
    assert (x.c > 0).sum() > 50
    assert (y.c == x.c).all()
    assert np.abs(y.F / x.F - 1).max() < 1e-6


def test_a_number_inside_of_a_lobe_s_interval_chooses_that_lobe() -> None:
    P = np.array([[0.25, 0.25, 0.5, 1.0], [0.5, 0.5, 0.5, 0.0], [0.25, 0.25, 0.0, 0.0]])
    lobe, r = np.array([1, 2, 1, 0]), np.array([0.0, 0.5, 1 - 2.0**-53, 0.75])
    number = inside(P, lobe, r)
    assert number == pytest.approx([0.25, 0.875, 1, 0.75], rel=1e-8)
    assert (module.mat.choose_lobe(P, number) == lobe).all()


# ---------------------------------------------------------------- two rays


@cache
def moved(scene: str, turn: str, choice: str) -> Moves:
    of = TwoRays(tracer(scene), TURNS[turn], LOBE_CHOICES[choice])
    X, here = reused(of, 3, seed=1)
    return moves(of, X, here, seed=2)


def steep_part(m: Moves) -> Moves:
    kept_ = np.flatnonzero(steep(m))
    return Moves(m.t, m.i[kept_], take(m.x, kept_), take(m.x_new, kept_), m.T[kept_])


def step_ratio(m: Moves, turn: str) -> Array:
    """What the step itself adds to T: p(w') / p(w) where directions are stepped."""
    if turn != "directions":
        return np.ones(len(m.T))
    p = [own_density(m, x) for x in (m.x, m.x_new)]
    return p[1] / p[0]


def own_density(m: Moves, x: FarPath) -> Array:
    """Density of the direction into x_c, from factors of the retraced path."""
    _, of = factored(m.t, own(m.t, x, m.i), m.i, x)
    columns = np.arange(len(x.k))
    return of.p[x.c - 1, columns] / of.P[x.c - 1, columns]


@pytest.mark.claims("MCMC-P01", part="two rays against retracing")
@pytest.mark.claims("MCMC-E10", "MCMC-E14", "MCMC-A03", "MCMC-A04")
@pytest.mark.parametrize(
    ("scene", "choice"), [*product(SCENES, ["kept"]), *product(["cornell", "glossy_cornell", "clear_coat"], ["jumped"])]
)
def test_two_rays_accept_just_as_retracing_does(scene, choice) -> None:
    m = steep_part(moved(scene, "numbers", choice))
    a = m.x_new.F.mean(axis=0) / m.x.F.mean(axis=0) * m.T
    assert len(a) > 25
    assert np.abs(a / retraced_acceptance(m) - 1).max() < 1e-10


@pytest.mark.claims("MCMC-P01", "MCMC-E09", "MCMC-A06")
@pytest.mark.parametrize("scene", ["cornell", "glossy_cornell", "ajar", "clear_coat"])
@pytest.mark.parametrize("turn", TURNS)
def test_the_acceptance_is_that_over_areas_where_all_but_the_moved_vertex_cancels(scene, turn) -> None:
    m = steep_part(moved(scene, turn, "kept"))
    a = m.x_new.F.mean(axis=0) / m.x.F.mean(axis=0) * m.T / step_ratio(m, turn)
    assert np.abs(a / over_areas(m) - 1).max() < 1e-9


WRONG_T: dict[str, Callable[[Array], Array]] = {
    "left out": np.ones_like,
    "upside down": lambda T: 1 / T,
}


@pytest.mark.claims("MCMC-E10")
@pytest.mark.parametrize("wrong", WRONG_T.values(), ids=WRONG_T)
def test_a_wrong_ratio_of_transitions_is_noticed_by_retracing(wrong) -> None:
    m = steep_part(moved("glossy_cornell", "numbers", "kept"))
    a = m.x_new.F.mean(axis=0) / m.x.F.mean(axis=0) * wrong(m.T)
    assert np.median(np.abs(a / retraced_acceptance(m) - 1)[m.T != 1]) > 0.01


@pytest.mark.parametrize("name", ["plane", "solid"])
def test_two_rays_know_no_dimension(name) -> None:
    t = furnished_shifts(name, RECONNECTION, 1, seed=0).t
    of = TwoRays(t, STEP, jumped)
    here = Pixels(of, np.arange(8 * 200))
    x, _ = next(iter(of.candidates(here.index, Live(np.random.default_rng(4)))))
    x_new, T = of.propose(here.index, x, Live(np.random.default_rng(5)))
    valid = np.flatnonzero((T > 0) & x_new.F.all(axis=0))
    m = steep_part(Moves(t, here.index[valid] % 8, take(x, valid), take(x_new, valid), T[valid]))
    a = m.x_new.F.mean(axis=0) / m.x.F.mean(axis=0) * m.T
    assert len(a) > 50
    assert np.abs(a / over_areas(m) - 1).max() < 1e-8


# ---------------------------------------------------------------- what moves, and what stays

STAY = {"k", "nee", "c", "lobe_out", "far_z", "far_prim", "far_lobe", "far_out", "far_S"}


@pytest.mark.claims("MCMC-F01")
@every_scene
def test_only_x_c_moves(scene) -> None:
    m = moved(scene, "numbers", "kept")
    assert all(np.array_equal(getattr(m.x, name), getattr(m.x_new, name)) for name in STAY | {"lobe_in"})
    assert (np.abs(m.x.z - m.x_new.z).max(axis=0) > 0).all()
    before = m.t.sensor.numbers + 2 * m.t.scene.space.d * (m.x.c - 1)
    fresh = np.arange(m.t.D)[:, None] < before
    assert (np.where(fresh, m.x.u, 0) == np.where(fresh, m.x_new.u, 0)).all()


@pytest.mark.claims("MCMC-A10", "MCMC-A14")
@pytest.mark.parametrize(
    ("scene", "choice"), [("cornell", "jumped"), *product(["glossy_cornell", "ajar", "crease", "glass_disc"], ["kept"])]
)
def test_the_moved_record_is_that_of_the_moved_path(scene, choice) -> None:
    m = steep_part(moved(scene, "numbers", choice))
    near, _ = retraced_far(m.t, own(m.t, m.x_new, m.i), m.i, m.x_new)
    names = [each.name for each in fields(FarPath) if each.name not in ("u", "out")]
    onward = np.flatnonzero(m.x.c < m.x.k)
    assert same_fields(m.x_new, near, [name for name in names if not name.startswith("far")]) < 1e-8
    assert same_fields(take(m.x_new, onward), take(near, onward), ["out", *names]) < 1e-8


@pytest.mark.claims("MCMC-A10")
@pytest.mark.parametrize("scene", ["glossy_cornell", "ajar", "clear_coat"])
def test_a_shift_of_the_moved_record_is_that_of_the_moved_path_and_comes_back(scene) -> None:
    m = steep_part(moved(scene, "numbers", "kept"))
    near, _ = retraced_far(m.t, own(m.t, m.x_new, m.i), m.i, m.x_new)
    j = (m.i + 5) % PIXELS
    (y, J), (z, K) = shift_path(m.t, m.x_new, j), shift_path(m.t, near, j)
    defined = np.flatnonzero(J > 0)
    assert (J > 0).sum() > 50
    assert ((J > 0) == (K > 0)).all()
    assert np.abs(J / np.where(K > 0, K, 1) - 1)[defined].max() < 1e-8
    assert np.abs(y.F - z.F).max() < 1e-8
    back, J_back = shift_path(m.t, take(y, defined), m.i[defined])
    assert np.abs(J_back * J[defined] - 1).max() < 1e-9
    assert np.abs(back.F / m.x_new.F[:, defined] - 1).max() < 1e-9


@pytest.mark.parametrize("name", ["A", "S", "out", "z", "prim", "u"])
def test_a_field_that_is_not_brought_up_to_date_is_noticed(name) -> None:
    m = steep_part(moved("glossy_cornell", "numbers", "kept"))
    stale = changed(m.x_new, **{name: getattr(m.x, name)})
    y, J = shift_path(m.t, stale, m.i)
    if name == "u":
        found = traced(m.t, own(m.t, stale, m.i), m.i, stale.k, stale.nee).F
        assert (np.abs(found / m.x_new.F - 1) > 1e-6).any()
        return
    assert (np.abs(np.where(J > 0, y.F, 0) / m.x_new.F - 1) + np.abs(J - 1) > 1e-6).any()


@pytest.mark.claims("MCMC-A14")
@pytest.mark.parametrize("scene", ["glossy_cornell", "ajar"])
def test_no_proposal_reconnects_elsewhere(scene) -> None:
    m = moved(scene, "numbers", "jumped")
    assert (traced(m.t, own(m.t, m.x_new, m.i), m.i, m.x.k, m.x.nee).c == m.x.c).all()


@pytest.mark.claims("MCMC-A14")
def test_proposals_that_would_are_noticed(monkeypatch) -> None:
    """Where x_c comes too close, or onto what is too glossy, a later pair is the first that connects."""
    monkeypatch.setattr(module, "connectable", lambda rule, r_x, r_z, distance: (r_x > 0) & (r_z > 0))
    of = TwoRays(tracer("glossy_cornell"), ByNumbers(0.3))
    X, here = reused(of, 6, seed=1)
    m = moves(of, X, here, seed=2)
    _, J = shift_path(m.t, m.x_new, m.i)
    assert (traced(m.t, own(m.t, m.x_new, m.i), m.i, m.x.k, m.x.nee).c != m.x.c).mean() > 0.01
    assert (J == 0).mean() > 0.01  # not even the shift to its own pixel is defined


def test_numbers_of_which_the_lobe_samples_nothing_are_no_mutation() -> None:
    """The view's direction stands in for the one that is not there, and the lobe could have sampled that."""
    of = TwoRays(tracer("glossy_cornell"), STEP)
    X, here = reused(of, 6, seed=1)
    there, s = of.standing(X, here.index), of.tracer.scene
    x, v = take(X.x, there.columns), there.at.v
    u = np.resize([1e-6, 1 - 1e-6], (1, len(there.columns)))  # at the horizons of the visible normals
    turn = ByNumbers(0.1, lambda old, sigma, chance: (u, np.ones(u.shape[-1])))
    w, T = turn(of.tracer, v, x.lobe_in, normalize(x.z - v.x), Live(np.random.default_rng(4)))
    nothing = mat.sample_lobe(s.materials, s.space, v, x.lobe_in, u)[-1] == 0
    assert nothing.sum() > 5
    assert ((T == 0) == nothing).all()
    _, p = mat.evaluate_lobe(s.materials, s.space, v, x.lobe_in, s.space.to_local(v.n, w))
    assert (p[nothing] > 0).any()


# ---------------------------------------------------------------- retraced proposals


@pytest.mark.parametrize("step", STEPS.values(), ids=STEPS)
@pytest.mark.parametrize("numbers", NUMBERS.values(), ids=NUMBERS)
def test_a_retraced_proposal_is_the_path_of_numbers_a_step_away(step, numbers) -> None:
    of = Retraced(tracer("glossy_cornell"), 0.01, step, numbers)
    X, here = reused(of, 4, seed=1)
    x_new, T = of.propose(here.index, X.x, Live(np.random.default_rng(2)))
    assert set(np.unique(T)) <= {0.0, 1.0}
    lit = np.flatnonzero((T > 0) & X.x.F.any(axis=0))
    i = here.index[lit] % PIXELS
    a, b = (own(of.tracer, take(x, lit), i) for x in (X.x, x_new))
    assert np.abs(traced(of.tracer, b, i, X.x.k[lit], X.x.nee[lit]).F - x_new.F[:, lit]).max() < 1e-9
    turned = np.abs(of.tracer.direction_numbers(b, 1) - of.tracer.direction_numbers(a, 1))[0]
    joined = X.x.c[lit] == 2
    assert 0.003 < np.median(turned[joined]) < 0.02
    if numbers is number_into_x_c:
        assert (x_new.c[lit] == X.x.c[lit]).all()
        assert (turned[X.x.c[lit] == 0] == 0).all()
    else:
        assert (x_new.c[lit] != X.x.c[lit]).any()


def test_dark_columns_are_left_alone() -> None:
    for of in (TwoRays(tracer("ajar"), STEP), Retraced(tracer("ajar"))):
        X, here = reused(of, 2, seed=1)
        x_new, T = of.propose(here.index, X.x, Live(np.random.default_rng(2)))
        dark = ~X.x.F.any(axis=0)
        assert dark.sum() > 20
        assert (T[dark] == 0).all()
        assert np.array_equal(x_new.u[:, dark], X.x.u[:, dark])


def test_where_light_sampling_ends_behind_x_c_no_number_changes() -> None:
    """x_(c+1) sends by the light's numbers: no lobe was chosen there, and those of x_c follow from elsewhere."""
    m = moved("glossy_cornell", "numbers", "kept")
    by_light = m.x.nee & (m.x.c + 1 == m.x.k)
    assert by_light.sum() > 10
    assert np.array_equal(m.x_new.u[:, by_light], m.x.u[:, by_light])
    by_lobe = (m.x.c < m.x.k) & ~by_light
    assert (m.x_new.u != m.x.u)[:, by_lobe].any()


def test_null_samples_with_light_cost_no_ray() -> None:
    """W = 0 with a path that is lit: it would be rejected all the same."""
    of = TwoRays(tracer("ajar"), STEP)
    X, here = reused(of, 2, seed=1)
    assert len(of.standing(X, here.index).columns) > 20
    assert len(of.standing(replace(X, W=0 * X.W), here.index).columns) == 0


@pytest.mark.parametrize("of", [TwoRays(tracer("ajar"), STEP, jumped), Retraced(tracer("ajar"))], ids=["two", "all"])
def test_how_many_numbers_are_drawn_tells_nothing_of_the_samples(of) -> None:
    X, here = reused(of, 2, seed=1)
    left = []
    for x in (X.x, changed(X.x, F=np.zeros_like(X.x.F))):
        rng = np.random.default_rng(3)
        of.propose(here.index, x, Live(rng))
        left.append(rng.random())
    assert left[0] == left[1]


# ---------------------------------------------------------------- cost


def rays_per_proposal(of_tracer: Callable[[Tracer], PathIntegrals], scene: str) -> tuple[float, float]:
    """Rays of a pass of ten mutations and of one, per path that can move."""
    asked = Counter[str]()
    t = tracer(scene)
    of = of_tracer(replace(t, scene=counted(t.scene, asked)))
    X, here = reused(of, 4, seed=1)
    movable = (X.W > 0).sum() if hasattr(of, "numbers") else ((X.x.c > 0) & (X.W > 0)).sum()
    found = []
    for k in (1, 10):
        asked.clear()
        mutations(k)(X, here, Live(np.random.default_rng(2)))
        found.append(rays(asked) / movable)
    return found[0], (found[1] - found[0]) / 9


@pytest.mark.claims("MCMC-T2t")
@pytest.mark.parametrize("scene", ["glossy_cornell", "ajar", "clear_coat"])
def test_a_mutation_costs_at_most_two_rays_and_the_first_one_those_to_where_it_stands(scene) -> None:
    first, each = rays_per_proposal(lambda t: TwoRays(t, STEP), scene)
    assert 1 < each <= 2
    assert first - each <= 2


@pytest.mark.claims("MCMC-T2t")
def test_retracing_costs_the_rays_of_a_tree_and_more() -> None:
    _, each = rays_per_proposal(Retraced, "glossy_cornell")
    assert 6 < each < 20


# ---------------------------------------------------------------- bad input

BAD_SIGMA = {
    "numbers": ByNumbers,
    "directions": ByDirections,
    "retraced": lambda sigma: Retraced(tracer("cornell"), sigma),
}


@pytest.mark.parametrize("make", BAD_SIGMA.values(), ids=BAD_SIGMA)
@pytest.mark.parametrize("sigma", [0, -0.1, np.nan, "wide"])
def test_a_step_without_length_is_refused(make, sigma) -> None:
    with pytest.raises(ValueError, match=r"sigma must be one positive number.*k = 0"):
        make(sigma)


def test_the_far_part_survives_reuse_and_is_that_of_the_path_as_it_stands() -> None:
    t, x, i = after_reuse("ajar")
    onward = np.flatnonzero((x.c > 0) & (x.c < x.k))
    x, i = take(x, onward), i[onward]
    near, _ = retraced_far(t, own(t, x, i), i, x)
    assert len(i) > 50
    assert same_fields(x, near, ["far_z", "far_prim", "far_lobe", "far_out", "far_S"]) < 1e-8
