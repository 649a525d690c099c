"""Pictures show what is there: every segment, all the light of a bundle, vertices where the tracer has them."""

import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from figures.gris import gris_f05
from figures.report import style
from figures.trust import flat_scenes
from flatland2d import PLANE, SCENES, pictures, shift_pictures
from flatland2d import fluence as fluences
from flatland2d.fluence import direct, fluence, fluence_map
from flatland2d.scenes import FURNACE_ALBEDO, Setting, chain, matte, room
from flatland2d.sensors import FluenceMap
from flatland2d.tone import decoded, encoded, exposure, tone, untone
from restir_ref.batch import take
from restir_ref.transport.paths import RECONNECTION, REPLAY, Tracer, leaves, radiance, trace
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.scene import scene
from tests.core.stubs import live
from tests.transport.paths import HYBRID, RULES

every_scene = pytest.mark.parametrize("scene", SCENES)
L = np.geomspace(1e-6, 1e6, 200)

# ---------------------------------------------------------------- tone


@pytest.mark.parametrize("e", [0.01, 1.0, 30.0])
def test_tone_mapping_loses_nothing(e):
    t = tone(L, e)
    assert np.all(np.diff(t) > 0)
    assert 0 < t.min() < t.max() < 1
    np.testing.assert_allclose(untone(t, e)[t < 0.999], L[t < 0.999], rtol=1e-9)


def test_clipping_would_lose_the_bright_end():
    clipped = encoded(np.minimum(L, 1))
    assert abs(decoded(clipped) / L - 1).max() > 0.9


def test_exposure_puts_its_percentile_at_half_the_light():
    lit = np.append(np.zeros(50), L)
    assert tone(np.percentile(L, 90), exposure(lit, 90)) == pytest.approx(encoded(np.array(0.5)))
    assert exposure(np.zeros(3)) == 1
    assert encoded(np.array(0.5)) == pytest.approx(0.7354, abs=1e-4)


def test_the_curve_of_screens_has_no_step_at_its_knee():
    below, above = encoded(np.array([0.0031308, 0.0031309]))
    assert above - below == pytest.approx(12.92e-7, abs=1e-7)


# ---------------------------------------------------------------- what is on an axis


def drawn(draw, *args):
    """The axis that a picture function has drawn on."""
    with style.context():
        ax = Figure().subplots()
        draw(ax, *args)
    return ax


def pieces(ax):
    """Segments of all line collections, by label."""
    return {str(c.get_label()): c.get_segments() for c in ax.collections if hasattr(c, "get_segments")}


@every_scene
def test_a_scene_picture_has_every_segment_circle_and_light(scene):
    setting = SCENES[scene]()
    ax = drawn(pictures.scene_picture, setting)
    surfaces = [c for c in ax.collections if " r ." in str(c.get_label()) or str(c.get_label()).split(" ")[0] in WORDS]
    assert sum(len(c.get_segments()) for c in surfaces) == setting.scene.S + setting.scene.radii.size
    lamps = len(setting.scene.lights.upto)
    words = [text.get_text() for text in ax.texts]
    assert words == (["light"] * lamps if lamps <= 4 else [f"{lamps} lights"])
    assert [c.get_offsets().tolist() for c in ax.collections if c.get_label() == "eye"] == [[list(setting.eye)]]
    assert (ax.get_aspect(), bool(ax.get_xlabel() and ax.get_ylabel())) == (1.0, True)


WORDS = ("lambert", "ggx", "glass")


def test_the_wedge_is_what_the_inset_sees():
    setting = SCENES["glass_disc"]()
    ax = drawn(pictures.scene_picture, setting, 16)
    (wedge,) = ax.patches
    corners, sensor = wedge.get_xy(), setting.pinhole(16)
    x, w, _ = sensor.ray(np.arange(16), np.full((1, 16), 0.5))
    to = corners[1:17].T - x
    np.testing.assert_allclose(to / np.linalg.norm(to, axis=0), w, atol=1e-12)


def test_dotted_lines_are_the_borders_of_the_film():
    setting = SCENES["glass_disc"]()
    ends = [line.get_xydata() for line in drawn(pictures.scene_picture, setting).lines]
    assert [end[0].tolist() for end in ends] == [list(setting.eye)] * 2
    film = setting.pinhole(pictures.FILM, 0)
    place = film.project(np.stack([end[1] for end in ends], axis=1))
    np.testing.assert_allclose(place, [0, pictures.FILM], atol=1e-9)


@pytest.mark.parametrize(("towards", "place"), [((0, 1), ("center", "bottom")), ((1, 0), ("left", "center"))])
def test_a_word_stands_off_in_the_direction_it_is_sent(towards, place):
    (text,) = drawn(pictures._word, "light", np.array([0.2, 0.3]), np.array(towards, dtype=float), 10).texts
    assert (text.xy, text.xyann) == ((0.2, 0.3), (10 * towards[0], 10 * towards[1]))
    assert (text.get_ha(), text.get_va()) == place


def test_lengths_are_drawn_without_a_grid():
    ax = drawn(pictures.scene_picture, SCENES["ajar"]())
    assert not any(line.get_visible() for line in (*ax.get_xgridlines(), *ax.get_ygridlines()))


@every_scene
def test_the_box_of_a_map_holds_the_scene(scene):
    setting = SCENES[scene]()
    low, high = (np.array(each)[:, None, None] for each in (setting.low, setting.high))
    corners = setting.scene.corners.transpose(1, 0, 2)
    assert ((corners >= low - 0.01) & (corners <= high + 0.01)).all()


def test_materials_differ_without_colour():
    dashes = [str(look["ls"]) for look in pictures.MATERIALS]
    assert len(set(dashes)) == len(dashes)


def test_materials_are_named_by_their_lobes():
    scene = SCENES["glossy_cornell"]().scene
    assert pictures.material_in_words(scene, 1) == "lambert + ggx r .15"
    assert pictures.material_in_words(SCENES["glass_disc"]().scene, 1) == "glass reflection + glass transmission"


# ---------------------------------------------------------------- bundles


def bundle(scene, N=50):
    """A tracer of the whole film, primary samples, and pixels."""
    t, rng = flat_scenes.whole_film(scene), np.random.default_rng(1)
    return t, rng.random((t.D, N)), rng.integers(0, t.sensor.n, N)


@every_scene
def test_a_bundle_carries_the_light_of_its_trees_from_vertex_to_vertex(scene):
    t, u, pixel = bundle(scene)
    ends, carried = pictures.strands(t, u, pixel)
    light = carried.reshape(-1, len(pixel))
    to_light, onwards = light[1::2], light[::2]  # by falling index of the vertex
    at_end = {(k, nee): F.mean(axis=0) for k, nee, F in leaves(trace(t, u, pixel))}
    np.testing.assert_allclose(onwards[-1], radiance(trace(t, u, pixel)).mean(axis=0), rtol=1e-12)
    for k in range(t.depth):
        i = t.depth - 1 - k
        np.testing.assert_allclose(onwards[k + 1], onwards[k] + to_light[k] + at_end[i, False], rtol=1e-12)
    start = ends[-len(pixel) :, 0]
    np.testing.assert_array_equal(start, np.broadcast_to(SCENES[scene]().eye, start.shape))


def test_a_bundle_draws_only_pieces_that_carry_light():
    t, u, pixel = bundle("ajar")
    _, carried = pictures.strands(t, u, pixel)
    ax = drawn(pictures.bundle_picture, SCENES["ajar"](), t, u, pixel)
    assert 0 < len(ax.collections[0].get_segments()) == (carried > 0).sum() < carried.size


def test_the_more_light_a_piece_carries_the_darker_it_is_and_nothing_is_coloured():
    t, u, pixel = bundle("ajar")
    ax = drawn(pictures.bundle_picture, SCENES["ajar"](), t, u, pixel)
    colours = ax.collections[0].get_colors()
    assert (colours[:, :3] == 0).all()
    assert (np.diff(colours[:, 3]) >= 0).all()
    assert colours[-1, 3] > colours[0, 3] > 0
    assert "eye" in [c.get_label() for c in ax.collections]


# ---------------------------------------------------------------- fluence


def z_and_error(differences, scale):
    error = differences.std() / np.sqrt(differences.size)
    return differences.mean() / error, error / scale


def small_map(scene, N=16 * 1500):
    """A tracer of 4 x 4 places, N primary samples, and their pixels."""
    setting = SCENES[scene]()
    t = Tracer(setting.scene, setting.fluence(4, 4), setting.depth, RECONNECTION)
    return t, np.random.default_rng(1).random((t.D, N)), np.arange(N) % 16


@pytest.mark.parametrize("scene", ["cornell", "ajar", "rack", "clear_coat", "furnace"])
def test_fluence_is_radiance_over_all_directions(scene):
    t, u, pixel = small_map(scene)
    F, plain = fluence(t, u, pixel)[0], radiance(trace(t, u, pixel))[0]
    z, error = z_and_error(F - plain, plain.mean())
    assert error < 0.011
    assert abs(z) < 4


def test_counting_direct_light_twice_is_noticed():
    t, u, pixel = small_map("cornell")
    tree = trace(t, u, pixel)
    twice = fluence(t, u, pixel)[0] + direct(t, tree, pixel)[0]
    z, error = z_and_error(twice - radiance(tree)[0], twice.mean())
    assert error < 0.011
    assert z > 8


def test_a_furnace_is_evenly_filled():
    bounces = SCENES["furnace"]().depth
    truth = 2 * np.pi * (1 - FURNACE_ALBEDO ** (bounces + 1)) / (1 - FURNACE_ALBEDO)
    values = fluence_map(SCENES["furnace"](), 8, 8, 32, live())
    z, error = z_and_error(values - truth, truth)
    assert error < 0.004
    assert abs(z) < 4
    assert abs(values / truth - 1).max() < 0.15


def test_the_scale_of_a_map_is_in_fluence():
    setting, values = SCENES["ajar"](), np.geomspace(0.01, 300, 32).reshape(4, 8)
    with style.context():
        ax = Figure().subplots()
        bar = pictures.fluence_picture(ax, setting, values)
    shown = ax.images[0].norm(values)
    assert (bar.vmin, bar.vmax) == pytest.approx(pictures.fluence_limits(values))
    inside = (values > bar.vmin) & (values < bar.vmax)
    assert inside.mean() > 0.9
    assert np.all(np.diff(np.asarray(shown)[inside]) > 0)
    assert ax.images[0].get_extent() == [0, 2, 0, 1]
    assert "rad" in bar.ax.get_ylabel()


def test_the_middle_of_a_map_takes_a_third_of_its_tones():
    values = fluence_map(SCENES["occluders"](), 12, 12, 8, live())
    low, high = pictures.fluence_limits(values)
    tones = np.log(np.clip(values, low, high) / low) / np.log(high / low)
    assert np.ptp(np.percentile(tones, [10, 90])) > 0.3
    linear = np.clip(values / values.max(), 0, 1)
    assert np.ptp(np.percentile(linear, [10, 90])) < 0.3


@pytest.mark.parametrize(("percentile", "ends"), [(99, [1, 99]), (90, [10, 90])])
def test_a_map_shows_its_tones_between_percentiles(percentile, ends):
    values = np.geomspace(1e-3, 1e3, 1001)
    assert pictures.fluence_limits(values, percentile) == pytest.approx(tuple(np.percentile(values, ends)))


def test_a_map_counts_its_pixels_along_rows_from_the_bottom():
    sensor = FluenceMap((0, 0), (3, 2), columns=3, rows=2)
    x, _, _ = sensor.ray(np.arange(6), np.full((3, 6), 0.5))
    assert x.T.tolist() == [[column + 0.5, row + 0.5] for row in range(2) for column in range(3)]


def test_directions_of_a_map_are_stratified_over_its_samples(monkeypatch):
    asked = []

    def noted(t, u, pixel):
        asked.append(u[2])
        return np.zeros((1, len(pixel)))

    monkeypatch.setattr(fluences, "fluence", noted)
    fluence_map(SCENES["ajar"](), 3, 2, 4, live())
    assert [np.floor(4 * u).tolist() for u in asked] == [[k] * 6 for k in range(4)]


def test_behind_a_lamp_that_hangs_in_the_room_nothing_is_darker_than_dark():
    s = scene(PLANE, [matte(0.5)], [*room(0), *chain([(0.3, 0.5), (0.7, 0.5)], 0, 8.0)])
    setting = Setting(s, (0.12, 0.45), (0.6, 0.0))
    t = Tracer(s, setting.fluence(4, 4), setting.depth, RECONNECTION)
    u, pixel = np.random.default_rng(3).random((t.D, 1600)), np.arange(1600) % 16
    found = direct(t, trace(t, u, pixel), pixel)
    assert found.min() == 0 < found.max()


def test_an_even_map_stays_even_and_a_dark_one_has_a_scale():
    low, high = pictures.fluence_limits(np.array([9.9, 10.0, 10.1]))
    assert (low, high) == pytest.approx((10 / np.sqrt(10), 10 * np.sqrt(10)), rel=0.02)
    assert pictures.fluence_limits(np.zeros(3)) == (1, 10)


@pytest.mark.parametrize("top", [0.02, 1.0, 37.0, 4e4])
def test_ticks_are_round_and_on_the_scale(top):
    ticks = pictures.fluence_ticks(top / 50, top)
    assert 3 <= len(ticks) <= 6
    assert top / 50 <= ticks[0] <= ticks[-1] <= top
    assert [float(f"{tick:.2g}") for tick in ticks] == pytest.approx(list(ticks))


# ---------------------------------------------------------------- shifts


def lit_pairs(scene, rule, N=60, reach=60):
    """Random paths with light and their offset paths, one by one."""
    t, u, i = bundle(scene, N)
    t = Tracer(t.scene, t.sensor, t.depth, RULES[rule])
    rng = np.random.default_rng(2)
    x = traced(t, u, i, rng.integers(1, t.depth + 1, N), rng.random(N) < 0.5)
    j = np.clip(i + reach, 0, t.sensor.n - 1)
    return [
        shift_pictures.pair(t, take(x, np.array([n])), int(i[n]), int(j[n])) for n in np.flatnonzero(x.F.any(axis=0))
    ]


def sees(p, a, b):
    return bool(p.t.scene.visible(a, b)[0])


def reconnects_from_scratch(p):
    """Where y reconnects if its numbers are traced in its own pixel, or after x_c if it does not before."""
    path = traced(p.t, p.x.u, p.y.pixel, p.x.k, p.x.nee)
    return int(path.c[0]) if p.c == 0 or 0 < path.c[0] < p.c else p.c + 1


REASONS = {
    r"the replay is lost after \$y_\d\$": lambda p, last: not p.y.seen[:last].all(),
    r"\$y\$ would reconnect at \d": lambda p, last: reconnects_from_scratch(p) not in (0, p.c),
    r"\$y\$ cannot reconnect there": lambda p, last: p.c > 0,
    r"something stands between .*": lambda p, last: not sees(p, p.y.x[last], p.x.x[p.c]),
    r"its light is hidden": lambda p, last: not sees(p, p.y.x[last], p.y.x[last + 1]),
    r"no lobe leads there": lambda p, last: p.c > 0 and sees(p, p.y.x[last], p.x.x[p.c]),
}


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("scene", ["glossy_cornell", "occluders", "glass_disc"])
def test_an_undefined_shift_has_a_true_reason(scene, rule):
    found = lit_pairs(scene, rule)
    undefined = [p for p in found if p.J == 0]
    assert len([p for p in found if p.J > 0]) > 0
    for p in undefined:
        (holds,) = [true for words, true in REASONS.items() if re.fullmatch(words, shift_pictures.why_undefined(p))]
        assert holds(p, p.c - 1 if p.c else int(p.y.k[0]))
    assert all("$J$ = 0, " in shift_pictures.pair_in_words(p) for p in undefined)
    assert all("hat p" in shift_pictures.pair_in_words(p) for p in found if p.J > 0)


@pytest.mark.parametrize("rule", RULES)
def test_a_shift_picture_shows_the_vertices_of_both_paths(rule):
    t = gris_f05.tracer(RULES[rule])
    p = shift_pictures.pair(t, gris_f05.by_hand(t, 4), gris_f05.PIXEL, gris_f05.PIXEL + 60)
    ax = drawn(shift_pictures.shift_picture, gris_f05.corridor(), p)
    lines = {line.get_label(): line.get_xydata() for line in ax.lines}
    np.testing.assert_array_equal(lines["base path"], p.x.x[:, :, 0])
    end = p.c or len(p.y.x)
    np.testing.assert_array_equal(lines["offset path, replayed"], p.y.x[:end, :, 0])
    assert ("reconnection" in lines) == (p.c > 0)
    if p.c:
        np.testing.assert_array_equal(lines["reconnection"][1], p.x.x[p.c, :, 0])
    names = {text.get_text() for text in ax.texts} - {"light"}
    assert (f"$x_{p.c} = y_{p.c}$" in names) == (p.c > 0)
    assert {"$x_1$", "$y_1$"} <= names


def test_a_shift_picture_holds_the_box_of_its_setting():
    t = gris_f05.tracer(RULES["hybrid"])
    p = shift_pictures.pair(t, gris_f05.by_hand(t, 4), gris_f05.PIXEL, gris_f05.PIXEL + 60)
    setting = gris_f05.corridor()
    ax = drawn(shift_pictures.shift_picture, setting, p)
    (left, low), (right, high) = setting.low, setting.high
    assert ax.get_xlim()[0] < left < right < ax.get_xlim()[1]
    assert ax.get_ylim()[0] < low < high < ax.get_ylim()[1]


FULL = {"replay": [False] * 4, "hybrid": [False, False, True, True], "reconnection": [True] * 4}


@pytest.mark.parametrize("shift", FULL)
def test_full_vertices_are_those_connectable_under_the_rule(shift):
    t = gris_f05.tracer({"replay": REPLAY, "hybrid": HYBRID, "reconnection": RECONNECTION}[shift])
    p = shift_pictures.pair(t, gris_f05.by_hand(t, 4), gris_f05.PIXEL, gris_f05.PIXEL + 60)
    ax = drawn(shift_pictures.shift_picture, gris_f05.corridor(), p)
    full = {tuple(c.get_offsets()[0]): c.get_facecolor()[0].tolist() != [1, 1, 1, 1] for c in marks(ax)}
    assert [full[tuple(x)] for x in p.x.x[1:5, :, 0]] == FULL[shift]


def test_a_legend_says_connectable_and_not_rough():
    t = gris_f05.tracer(HYBRID)
    p = shift_pictures.pair(t, gris_f05.by_hand(t, 4), gris_f05.PIXEL, gris_f05.PIXEL + 60)
    _, words = drawn(shift_pictures.shift_picture, gris_f05.corridor(), p).get_legend_handles_labels()
    assert {"connectable by this rule", "not connectable by it", "on a light"} <= set(words)
    assert not [each for each in words if "rough vertex" in each or "smooth" in each]


def room_at_the_right(words):
    """Pixels between the longest words of F05's legend, some of them replaced, and the edge of the picture."""
    with style.context():
        picture = gris_f05.draw({})
        (legend,) = [ax.get_legend() for ax in picture.axes if ax.get_legend()]
        for text in legend.get_texts():
            text.set_text(words.get(text.get_text(), text.get_text()))
        picture.draw_without_rendering()
        return picture.bbox.x1 - max(text.get_window_extent().x1 for text in legend.get_texts())


def test_the_words_of_a_legend_stay_inside_the_picture():
    assert room_at_the_right({}) > 0


def test_a_legend_of_longer_words_would_be_cut():
    words = "connectable by this rule"
    assert room_at_the_right({words: f"{words}, whatever the lobes of both vertices may be"}) < 0


def marks(ax):
    return [c for c in ax.collections if len(c.get_offsets()) == 1 and c.get_label() != "eye" and c.get_zorder() == 4]
