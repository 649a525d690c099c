"""What a reservoir has to keep: every shift of a path, from any pixel, follows from its compact record."""

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest

from flatland2d import SCENES
from restir_ref import Live, Pixels, initial, shade, spatial
from restir_ref.batch import Array, ratio
from restir_ref.transport.compact import Compact, pack, unpack
from restir_ref.transport.paths import Connectability, Path, Tracer
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.proofs.reading import extended_path, factors
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.shifts import shift_path
from tests.transport.furnished import FURNISHED, furnished_shifts
from tests.transport.paths import HYBRID, RULES, shifts, successful

every_scene = pytest.mark.parametrize("scene", SCENES)
every_rule = pytest.mark.parametrize("rule", RULES)


def unlike(a: Array, b: Array) -> float:
    """Largest relative difference; 1 where only one is 0."""
    return float(ratio(np.abs(a - b), np.maximum(np.abs(a), np.abs(b))).max())


def shift_difference(t: Tracer, x: Path, again: Path, pixel: Array) -> float:
    """How differently two records of one path shift to `pixel`: J, F and A there."""
    (y, J), (y_again, J_again) = shift_path(t, x, pixel), shift_path(t, again, pixel)
    return max(unlike(J, J_again), unlike(y.F, y_again.F), unlike(y.A * (J > 0), y_again.A * (J_again > 0)))


def stored(t: Tracer, x: Path, pixel: Array) -> Path:
    """Through a reservoir and back."""
    return unpack(t, pack(t, x), pixel)


@pytest.mark.claims("GRIS-A17")
@every_rule
@every_scene
def test_a_stored_path_shifts_like_the_path(scene, rule) -> None:
    s = shifts(SCENES[scene](), RULES[rule], 1000, seed=31)
    assert shift_difference(s.t, s.x, stored(s.t, s.x, s.i), s.j) < 1e-12


@pytest.mark.claims("GRIS-A17")
@every_rule
@every_scene
def test_an_offset_path_can_be_stored_and_shifted_on(scene, rule) -> None:
    """Its numbers are stale from the reconnection on; what took their places is not."""
    s = successful(shifts(SCENES[scene](), RULES[rule], 1000, seed=32))
    assert shift_difference(s.t, s.y, stored(s.t, s.y, s.j), s.j + 1) < 1e-12


@pytest.mark.claims("GRIS-A17")
@every_rule
@pytest.mark.parametrize("name", FURNISHED)
def test_storing_knows_no_dimension(name, rule) -> None:
    """A follows from x_c up to rounding / (r cos), which short connections magnify."""
    s = furnished_shifts(name, RULES[rule], 1000, seed=33)
    assert shift_difference(s.t, s.x, stored(s.t, s.x, s.i), s.j) < 1e-11


@every_rule
@pytest.mark.parametrize("scene", ["glossy_cornell", "clear_coat", "glass_disc"])
def test_contribution_and_density_follow_from_the_rest(scene, rule) -> None:
    s = shifts(SCENES[scene](), RULES[rule], 1000, seed=34)
    again = stored(s.t, s.x, s.i)
    assert unlike(s.x.F, again.F) < 1e-12
    assert unlike(s.x.A, again.A) < 1e-12


@pytest.mark.parametrize("scene", ["glossy_cornell", "clear_coat"])
def test_a_pass_over_stored_reservoirs_gives_the_same_image(scene) -> None:
    setting, n = SCENES[scene](), 32
    of = PathIntegrals(Tracer(setting.scene, setting.pinhole(n, 900), setting.depth, HYBRID))
    here = Pixels(of, np.arange(n * 32))
    X, near = initial(here, Live(np.random.default_rng(35))), [Pixels(of, here.index // n * n + (here.index + 5) % n)]
    kept = replace(X, x=stored(of.tracer, X.x, here.index % n))
    Y, Z = (spatial(each, here, near, Live(np.random.default_rng(36))) for each in (X, kept))
    assert unlike(shade(Y, here), shade(Z, here)) < 1e-10


def nbytes(batch: object) -> int:
    """Bytes of one column."""
    leaves = [getattr(batch, field.name) for field in fields(batch)]  # type: ignore[arg-type]
    return sum(leaf.dtype.itemsize * int(np.prod(leaf.shape[:-1])) for leaf in leaves)


@pytest.mark.claims("GRIS-A17")
def test_a_reservoir_in_flatland_takes_no_more_than_the_paper_s_88_bytes() -> None:
    """Depth 3, double precision: 1 + 2 x 3 numbers and 9 bytes of integers, then W and the confidence."""
    s = shifts(SCENES["cornell"](), HYBRID, 100, seed=37)
    path = extended_path(s.t, s.x.u, s.i, s.x.k, s.x.nee)
    whole = nbytes(path) + nbytes(factors(s.t, path))
    assert (whole, nbytes(s.x), nbytes(pack(s.t, s.x))) == (694, 209, 65)
    assert nbytes(pack(s.t, s.x)) + 16 <= 88


def deep_paths(depth: int, n: int = 20) -> tuple[Tracer, Path, Array]:
    """Paths of up to `depth` vertices in a bright room, few of which connect."""
    setting, rng, pixel = SCENES["furnace"](), np.random.default_rng(39), np.full(n, 900)
    t = Tracer(setting.scene, setting.pinhole(1920, 0), depth, Connectability(0, 1.38))
    k = depth - np.arange(n) % 10
    return t, traced(t, rng.random((t.D, n)), pixel, k, rng.random(n) < 0.5), pixel


def integers(x: Path | Compact) -> Array:
    """k and c, (2, N)."""
    return np.stack([x.k, x.c])


DEPTHS = (128, 254, 255)


@pytest.mark.claims("GRIS-A17")
@pytest.mark.parametrize("depth", DEPTHS)
def test_a_path_of_any_depth_can_be_stored(depth) -> None:
    t, x, pixel = deep_paths(depth)
    again = stored(t, x, pixel)
    assert (integers(again) == integers(x)).all()
    assert shift_difference(t, x, again, pixel) < 1e-9
    last = replace(x, c=x.k + 1)
    assert (integers(pack(t, last)) == integers(last)).all()
    assert pack(t, x).k.dtype.itemsize == (1 if depth < 255 else 2)


@pytest.mark.parametrize(("lobes", "size"), [(2, 1), (256, 1), (257, 2)])
def test_lobes_take_a_byte_each_as_long_as_their_numbers_fit(lobes, size) -> None:
    t, x, _ = deep_paths(10)
    materials = SimpleNamespace(L=lobes)
    many = SimpleNamespace(
        sensor=t.sensor, depth=t.depth, scene=SimpleNamespace(space=t.scene.space, materials=materials)
    )
    kept = pack(many, replace(x, lobe_in=np.full(len(x.k), lobes - 1)))  # type: ignore[arg-type]
    assert (kept.lobe_in == lobes - 1).all()
    assert kept.lobe_in.dtype.itemsize == size


@pytest.mark.parametrize(("dtype", "depth"), [(np.int8, 127), (np.int8, 128), (np.uint8, 255), (np.uint8, 300)])
def test_an_integer_that_wraps_is_noticed(dtype, depth) -> None:
    t, x, _ = deep_paths(depth)
    last = replace(x, c=x.k + 1)
    assert (integers(pack(t, last)).astype(dtype) != integers(last)).any()


# ---------------------------------------------------------------- twins


def numbers_only(t: Tracer, x: Path) -> Compact:
    """A mistake: the primary sample alone, as if nothing had been reconnected yet."""
    return pack(t, replace(x, c=np.zeros_like(x.c)))


def any_lobe(t: Tracer, x: Path) -> Compact:
    """A mistake: the lobe at x_(c-1) is not kept but chosen anew, here the first."""
    return replace(pack(t, x), lobe_in=np.zeros(len(x.k), dtype=np.uint8))


def no_direction(t: Tracer, x: Path) -> Compact:
    """A mistake: the direction leaving x_c is not kept; that of another path stands in."""
    return pack(t, replace(x, out=np.roll(x.out, 1, axis=-1)))


@pytest.mark.claims("GRIS-A17")
@pytest.mark.parametrize("wrong", [numbers_only, any_lobe, no_direction])
def test_keeping_less_is_noticed(wrong) -> None:
    s = successful(shifts(SCENES["clear_coat"](), RULES["reconnection"], 1000, seed=38))
    y = unpack(s.t, wrong(s.t, s.y), s.j)
    _, J = shift_path(s.t, s.y, s.i)
    _, J_wrong = shift_path(s.t, y, s.i)
    assert (np.abs(ratio(J_wrong, J) - 1) > 0.01).mean() > 0.02
