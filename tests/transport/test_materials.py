"""Materials: sums of lobes, how one is chosen, and how columns of many materials are kept apart."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from restir_ref.batch import Array, take
from restir_ref.transport import materials as mat
from restir_ref.transport.lobes import KINDS, LOBES
from restir_ref.transport.materials import Layer, Material, Vertex, table
from tests.transport.lobe_cases import Plain, views
from tests.transport.spaces import SEEING

RGB = (0.2, 0.5, 0.3)
MATERIALS = {
    "matte": Material([Layer("lambert", RGB)]),
    "mixed": Material([Layer("lambert", RGB, weight=0.5), Layer("ggx", (0.3, 0.2, 0.1), 0.5, weight=0.2)]),
    "shiny": Material([Layer("ggx", RGB, 0.15)]),
    "rough glass": Material([Layer("rough reflection", RGB, 0.4), Layer("rough transmission", (1, 1, 0.5), 0.4)], 1.6),
    "glass": Material([Layer("glass reflection", RGB, 0.0), Layer("glass transmission", (1, 0.9, 1), 0.0)]),
    "mirror": Material([Layer("mirror", RGB)]),
    "coated": Material(
        [Layer("rough reflection", (0.3, 0.2, 0.3), 0.2), Layer("lambert", RGB), Layer("ggx", (0.4, 0.1, 0.3), 0.7)]
    ),
    "black": Material([Layer("lambert", (0, 0, 0))]),
}
TABLE = table(list(MATERIALS.values()), 3)
every_space = pytest.mark.parametrize("space", SEEING.values(), ids=SEEING)


def vertices(d: int, material: Array, seed: int = 1) -> Vertex:
    """Vertices of the given materials (N,), seen from random sides and directions."""
    rng, n = np.random.default_rng(seed), len(material)
    nowhere = np.zeros((d, n))
    return Vertex(nowhere, nowhere, views(d, n, rng), material, np.zeros(n, dtype=int), rng.random(n) < 0.5)


def crowd(d: int, n: int = 4000) -> Vertex:
    """Vertices of all materials, mixed."""
    return vertices(d, np.random.default_rng(2).integers(0, len(MATERIALS), n))


def directions(d: int, n: int) -> Array:
    """Random directions to both sides."""
    rng = np.random.default_rng(3)
    return views(d, n, rng) * rng.choice([-1, 1], n)


def chosen(P: Array) -> Array:
    return mat.choose_lobe(P, np.random.default_rng(4).random(P.shape[1]))


# ---------------------------------------------------------------- choosing a lobe


@every_space
def test_shares_are_probabilities(space):
    P = mat.lobe_shares(TABLE, crowd(space.d))
    assert P.shape == (3, 4000)
    assert P.min() >= 0
    assert np.abs(P.sum(axis=0) - 1).max() < 1e-15


@pytest.mark.parametrize("name", MATERIALS)
def test_shares_follow_weights_and_fresnel(name):
    v = vertices(2, np.full(500, list(MATERIALS).index(name)))
    material = MATERIALS[name]
    eta = np.where(v.front, material.eta, 1 / material.eta)
    surface = Plain(eta, eta)
    shares = [
        layer.weight * (LOBES[layer.kind].share or (lambda s, o: np.ones(500)))(surface, v.o)
        for layer in material.layers
    ]
    expected = np.array(shares) / np.sum(shares, axis=0)
    assert np.allclose(mat.lobe_shares(TABLE, v)[: len(shares)], expected, rtol=1e-12)


@every_space
def test_absent_and_black_lobes_are_never_chosen_where_others_are(space):
    v = crowd(space.d)
    lobe = chosen(mat.lobe_shares(TABLE, v))
    count = np.array([len(material.layers) for material in MATERIALS.values()])
    assert (lobe < count[v.material]).all()


shares = st.lists(st.sampled_from([0.0, 0.1, 0.5, 1.0, 3.0]), min_size=3, max_size=3).filter(any)


def rounding(P_x: Array, P_y: Array, lobe: int) -> float:
    """Numbers at x are known to 4 eps; at y that is P_y / P_x times as much, and 4 eps more."""
    return float(4 * np.finfo(float).eps * (1 + P_y[lobe, 0] / P_x[lobe, 0]))


def copies(choose_number, x: list[float], y: list[float], u: float) -> bool:
    """Whether the number chosen at y chooses the lobe of u at x, if both have it, and comes back to u."""
    P_x, P_y = (np.array(P)[:, None] / sum(P) for P in (x, y))
    (lobe,) = mat.choose_lobe(P_x, np.array([u]))
    if not (P_x[lobe, 0] > 0 and P_y[lobe, 0] > 0):
        return True
    number = choose_number(P_x, P_y, np.array([lobe]), np.array([u]))
    close = rounding(P_x, P_y, lobe)
    at_edge = np.abs(number - np.cumsum(P_y, axis=0)).min() < close
    chosen_again = at_edge or mat.choose_lobe(P_y, np.clip(number, close, 1 - close)) == lobe
    back = choose_number(P_y, P_x, np.array([lobe]), number)
    return bool(chosen_again and abs(back[0] - u) < rounding(P_y, P_x, lobe))


@given(shares, shares, st.floats(0, 1, exclude_max=True))
@example([0.5, 3.0, 0.0], [3.0, 0.1, 0.0], 0.21875)
@example([0.0, 0.1, 0.0], [3.0, 0.1, 0.0], 0.3125)
def test_the_copied_lobe_s_number_chooses_it_again_and_comes_back(x, y, u):
    assert copies(mat.choose_number, x, y, u)


WRONG_NUMBERS = {
    "kept": lambda P_x, P_y, lobe, u: u,
    "anywhere in the interval": lambda P_x, P_y, lobe, u: np.cumsum(P_y, axis=0)[lobe, 0] - 0.5 * P_y[lobe, 0],
    "off by a hair": lambda P_x, P_y, lobe, u: mat.choose_number(P_x, P_y, lobe, u) + 1e-14,
}


@pytest.mark.parametrize("wrong", WRONG_NUMBERS)
def test_another_number_is_noticed(wrong):
    assert not copies(WRONG_NUMBERS[wrong], [0.5, 1.0, 0.0], [1.0, 0.5, 0.0], 0.4)


def test_lobes_are_chosen_as_often_as_their_shares_say():
    P = np.repeat([[0.25], [0.0], [0.75]], 1000, axis=1)
    lobe = mat.choose_lobe(P, (np.arange(1000) + 0.5) / 1000)
    assert np.bincount(lobe).tolist() == [250, 0, 750]


# ---------------------------------------------------------------- sums of lobes


@every_space
def test_all_lobes_together_are_the_sum_of_the_lobes_without_the_delta_ones(space):
    v, n = crowd(space.d), 4000
    i, P = directions(space.d, n), mat.lobe_shares(TABLE, v)
    f, p = mat.evaluate_all(TABLE, space, v, P, i)
    f_sum, p_sum = np.zeros((3, n)), np.zeros(n)
    for l in range(TABLE.L):
        lobe = np.full(n, l)
        f_l, p_l = mat.evaluate_lobe(TABLE, space, v, lobe, i)
        f_sum += f_l * (p_l > 0)
        p_sum += P[l] * p_l
    assert (f > 0).any()
    assert np.allclose(f, f_sum, rtol=1e-12, atol=0)
    assert np.allclose(p, p_sum, rtol=1e-12, atol=0)


@every_space
def test_a_sample_carries_f_over_p_with_the_lobe_s_probability(space):
    v = crowd(space.d)
    P, u = mat.lobe_shares(TABLE, v), np.random.default_rng(5).random((space.d - 1, 4000))
    lobe = chosen(P)
    i = mat.sample_lobe(TABLE, space, v, lobe, u)
    kept = np.flatnonzero(i[-1])
    v, P, lobe, i = take((v, P, lobe, i), kept)
    weight, p, p_all = mat.scatter_lobe(TABLE, space, v, P, lobe, i)
    f, p_l = mat.evaluate_lobe(TABLE, space, v, lobe, i)
    P_l = P[lobe, np.arange(len(lobe))]
    delta = mat.lobe_roughness(TABLE, v, lobe) == 0
    assert np.allclose(weight, f / np.where(delta, P_l, P_l * p_l), rtol=1e-12, atol=0)
    assert np.allclose(p, P_l * p_l, rtol=1e-15, atol=0)
    assert (p[delta] == 0).all()
    assert (p_all[delta] == 0).all()
    assert np.allclose(p_all[~delta], mat.evaluate_all(TABLE, space, v, P, i)[1][~delta], rtol=1e-12, atol=0)


def test_dropping_the_lobe_s_probability_is_noticed():
    v = vertices(2, np.full(1000, 1))
    P = mat.lobe_shares(TABLE, v)
    lobe = chosen(P)
    weight, _, _ = mat.scatter_lobe(TABLE, SEEING["plane"], v, P, lobe, v.o)
    f, p = mat.evaluate_lobe(TABLE, SEEING["plane"], v, lobe, v.o)
    assert np.abs(weight * p / f - 1).min() > 0.1


@every_space
def test_directions_of_any_lobe_invert_to_their_numbers(space):
    v, u = crowd(space.d), np.random.default_rng(6).random((space.d - 1, 4000))
    lobe = chosen(mat.lobe_shares(TABLE, v))
    i = mat.sample_lobe(TABLE, space, v, lobe, u)
    columns = np.flatnonzero((i[-1] != 0) & (mat.lobe_roughness(TABLE, v, lobe) > 0))
    v, lobe, i, u = take((v, lobe, i, u), columns)
    assert np.abs(mat.invert_lobe(TABLE, space, v, lobe, i) - u).max() < 1e-9


@every_space
def test_columns_of_one_kind_together_are_what_they_are_one_by_one(space):
    v, i = crowd(space.d, 60), directions(space.d, 60)
    P = mat.lobe_shares(TABLE, v)
    lobe = chosen(P)
    together = (P, *mat.evaluate_all(TABLE, space, v, P, i), *mat.scatter_lobe(TABLE, space, v, P, lobe, i))
    for n in range(60):
        one_v, one_lobe, one_i = take((v, lobe, i), np.array([n]))
        one_P = mat.lobe_shares(TABLE, one_v)
        scattered = mat.scatter_lobe(TABLE, space, one_v, one_P, one_lobe, one_i)
        alone = (one_P, *mat.evaluate_all(TABLE, space, one_v, one_P, one_i), *scattered)
        assert all(np.allclose(a[..., n], b[..., 0], rtol=1e-13, atol=0) for a, b in zip(together, alone, strict=True))


@every_space
def test_a_table_of_one_material_is_that_part_of_the_whole_table(space):
    for k, (name, material) in enumerate(MATERIALS.items()):
        alone, v = table([material], 3), vertices(space.d, np.full(200, k))
        i, first = directions(space.d, 200), replace(v, material=np.zeros(200, dtype=int))
        P, P_alone = mat.lobe_shares(TABLE, v), mat.lobe_shares(alone, first)
        assert np.allclose(P[: alone.L], P_alone, rtol=1e-15), name
        found, expected = mat.evaluate_all(TABLE, space, v, P, i), mat.evaluate_all(alone, space, first, P_alone, i)
        assert all(np.allclose(a, b, rtol=1e-15, atol=0) for a, b in zip(found, expected, strict=True)), name


def test_an_empty_batch_is_no_mistake():
    v = crowd(2, 0)
    P = mat.lobe_shares(TABLE, v)
    f, p = mat.evaluate_all(TABLE, SEEING["plane"], v, P, np.zeros((2, 0)))
    assert P.shape == (3, 0)
    assert f.shape == (3, 0)
    assert p.shape == (0,)


def test_colours_are_channels_of_their_lobe():
    v = vertices(2, np.zeros(100, dtype=int))
    f, _ = mat.evaluate_lobe(TABLE, SEEING["plane"], v, np.zeros(100, dtype=int), v.o)
    assert np.allclose(f / (v.o[-1] / 2), np.array(RGB)[:, None])


def test_the_index_of_refraction_is_turned_over_behind_the_surface():
    k = list(MATERIALS).index("rough glass")
    v = vertices(2, np.full(100, k))
    surface = mat.LobeSurface(TABLE, v.material * TABLE.L, v.front)
    assert (surface.eta == np.where(v.front, 1.6, 1 / 1.6)).all()
    assert np.allclose(surface.alpha, 0.4**2)


def test_roughness_is_perceptual_zero_for_delta_lobes_and_the_largest_of_what_is_there():
    v = vertices(2, np.arange(len(MATERIALS)))
    first = mat.lobe_roughness(TABLE, v, np.zeros(len(MATERIALS), dtype=int))
    assert first.tolist() == [1, 1, 0.15, 0.4, 0, 0, 0.2, 1]
    assert mat.roughest(TABLE, v).tolist() == [1, 1, 0.15, 0.4, 0, 0, 1, 1]


# ---------------------------------------------------------------- no more light leaves than arrives


def reflects(layers: list[Layer], n: int = 4000) -> float:
    """Largest share of the light from 40 directions that leaves the plane again: midpoints of all angles."""
    alone = object.__new__(Material)
    object.__setattr__(alone, "layers", layers)
    object.__setattr__(alone, "eta", 1.5)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mat, "check", lambda material, channels: None)
        t = table([alone], 1)
    angle, arrives = (np.arange(n) + 0.5) / n * 2 * np.pi, (np.arange(40) + 0.5) / 40 * np.pi / 2
    o = np.repeat(np.stack([np.sin(arrives), np.cos(arrives)]), n, axis=1)
    i, N = np.tile(np.stack([np.sin(angle), np.cos(angle)]), 40), 40 * n
    v = Vertex(0 * o, 0 * o, o, np.zeros(N, dtype=int), np.zeros(N, dtype=int), np.arange(N) % (2 * n) < n)
    f, _ = mat.evaluate_all(t, SEEING["plane"], v, np.ones((t.L, N)), i)
    return float(f[0].reshape(40, n).mean(axis=1).max() * 2 * np.pi)


def glassy(reflected: float, transmitted: float) -> list[Layer]:
    return [Layer("rough reflection", (reflected,), 0.4), Layer("rough transmission", (transmitted,), 0.4)]


PALE = {
    "white": [Layer("lambert")],
    "glossy": [Layer("ggx", (1.0,), 0.3)],
    "white in three parts": [Layer("lambert", (0.7,)), Layer("lambert", (0.2,)), Layer("ggx", (0.1,), 0.5)],
    "glass": glassy(1.0, 1.0),
    "dusty glass": [*glassy(0.6, 0.7), Layer("lambert", (0.3,))],
    "coated": [Layer("rough reflection", (0.4,), 0.2), Layer("lambert", (0.6,))],
}
BRIGHT = {
    "1.2": [Layer("lambert", (0.7,)), Layer("ggx", (0.5,), 0.5)],
    "1.4": [Layer("rough reflection", (0.8,), 0.2), Layer("lambert", (0.6,))],
    "1.3": [*glassy(1.0, 0.9), Layer("lambert", (0.3,))],
    "1.5": [*glassy(0.9, 1.0), Layer("mirror", (0.5,))],
}


@pytest.mark.parametrize("name", PALE)
def test_a_material_that_is_accepted_sends_no_more_light_than_arrives(name):
    mat.check(Material(PALE[name]), 1)
    assert reflects(PALE[name]) <= 1 + 1e-6


@pytest.mark.parametrize("total", BRIGHT)
def test_colours_that_sum_above_one_are_refused_with_the_material(total):
    bad = Material(BRIGHT[total])
    with pytest.raises(ValueError, match="scale them to at most 1") as error:
        table([Material(PALE["white"]), bad], 1)
    assert f"the colours of {bad} sum to {total}" in str(error.value)


@pytest.mark.parametrize("total", [each for each in BRIGHT if each != "1.5"])
def test_they_would_send_more_light_than_arrives(total):
    assert reflects(BRIGHT[total]) > 1.02


# ---------------------------------------------------------------- mistakes of users

GOOD = Layer("ggx", (0.5,), 0.5)
BAD = {
    "there is no lobe 'phong'; the kinds are lambert, ggx": replace(GOOD, kind="phong"),
    "roughness of ggx must be in (0, 1], but is 0": replace(GOOD, roughness=0.0),
    "roughness of ggx must be in (0, 1], but is nan": replace(GOOD, roughness=np.nan),
    "roughness of ggx must be in (0, 1], but is 1.5": replace(GOOD, roughness=1.5),
    "roughness of ggx must be in (0, 1], but is -0.1": replace(GOOD, roughness=-0.1),
    "in [0, 1] per channel of the lights' emission, here 1, but is (1.2,)": replace(GOOD, colour=(1.2,)),
    "here 1, but is (-0.1,)": replace(GOOD, colour=(-0.1,)),
    "here 1, but is (nan,)": replace(GOOD, colour=(np.nan,)),
    "here 1, but is (0.1, 0.2, 0.3)": replace(GOOD, colour=(0.1, 0.2, 0.3)),
    "weight of ggx must be finite and, unless it is black, positive, but is -1": replace(GOOD, weight=-1),
    "positive, but is nan": replace(GOOD, weight=np.nan),
    "positive, but is inf": replace(GOOD, weight=np.inf),
    "positive, but is 0": replace(GOOD, weight=0.0),
}


@pytest.mark.parametrize("said", BAD)
def test_a_layer_that_cannot_be_is_refused_with_its_value(said):
    right, wrong = Material([Layer("lambert", (0.5,))]), Material([Layer("lambert", (0.5,)), BAD[said]])
    with pytest.raises(ValueError) as error:  # noqa: PT011
        table([right, wrong], 1)
    assert said in str(error.value)


@pytest.mark.parametrize("eta", [0.0, -1.5, np.nan, np.inf])
def test_an_impossible_index_of_refraction_is_refused(eta):
    with pytest.raises(ValueError, match="index of refraction must be positive and finite"):
        table([Material([GOOD], eta)], 1)


def test_rough_transmission_between_equals_is_refused():
    with pytest.raises(ValueError, match="index of refraction unlike 1"):
        table([Material([replace(GOOD, kind="rough transmission")], 1.0)], 1)


@pytest.mark.parametrize("layers", [[], [Layer("lambert", (0.0,), weight=0.0)]])
def test_a_material_without_a_lobe_is_refused(layers):
    with pytest.raises(ValueError, match="needs a lobe of positive weight"):
        table([Material(layers)], 1)


def test_delta_lobes_ignore_their_roughness():
    delta = [kind for kind in KINDS if LOBES[kind].delta]
    assert (table([Material([Layer(kind, roughness=np.nan)]) for kind in delta], 1).roughness == 0).all()
