"""GRIS Fig. 5 on its hand-built path, with the mistake that would move the reconnection; the gallery of scenes."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from figures.claims.figure import undeclared, verdict_of
from figures.gris import gris_f05
from figures.report import style
from figures.trust import flat_scenes
from flatland2d import SCENES, shift_pictures
from restir_ref.transport import record
from tests.core.stubs import live
from tests.transport.paths import HYBRID


def made(figure, preset):
    chunks = figure.chunks(preset)
    return figure.combine(preset, [figure.compute(preset, c, rng=np.random.default_rng(1)) for c in chunks])


@pytest.mark.claims("GRIS-F05")
def test_hybrid_reconnects_the_hand_built_path_at_four():
    arrays = made(gris_f05.FIGURE, {"paths": 400})
    assert {verdict_of(claim) for claim in gris_f05.check(arrays)} == {"reproduced"}
    assert undeclared(gris_f05.FIGURE, gris_f05.check(arrays)) == ""
    assert arrays["index"].tolist() == [[4, 4], [2, 2], [0, 0]]
    assert len(set(arrays["found"])) > 2


def far_end_only(rule, r_x, r_z, distance):
    """A mistake: only the vertex to be connected to is tested, not the one before it."""
    return (r_z >= rule.roughness) & (distance >= rule.distance)


def test_testing_one_vertex_of_the_pair_is_noticed(monkeypatch):
    monkeypatch.setattr(record, "connectable", far_end_only)
    t = gris_f05.tracer(HYBRID)
    assert gris_f05.by_hand(t, 4).c == 3
    found, counted = gris_f05.indices(400, live())
    assert (found != counted).any()


def test_the_hand_built_path_goes_where_it_should():
    t = gris_f05.tracer(HYBRID)
    p = shift_pictures.pair(t, gris_f05.by_hand(t, 5), gris_f05.PIXEL, gris_f05.PIXEL)
    np.testing.assert_allclose(p.x.x[2:6, :, 0], gris_f05.POINTS[1:], atol=1e-12)
    assert (p.J, p.gain) == pytest.approx((1, 1), rel=1e-12)


def test_the_gallery_has_a_bundle_and_a_map_of_every_scene():
    arrays = made(flat_scenes.FIGURE, {"rows": 4, "samples": 1, "paths": 3})
    assert {name.split(" ")[0] for name in arrays} == set(SCENES)
    assert arrays["ajar fluence"].shape == (4, 8)
    with style.context():
        panels = Figure().subplots(1, 2)
        flat_scenes.draw_scene(panels, "ajar", {k.split(" ")[1]: v for k, v in arrays.items() if k.startswith("ajar")})
    assert all(ax.get_xlabel() and ax.get_ylabel() for ax in panels)
    assert " ".join(flat_scenes.sentence("ajar").split()).endswith("rare, valuable paths.")
