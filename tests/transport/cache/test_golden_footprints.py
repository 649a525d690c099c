"""Golden vectors of footprints: what ships, read by a port in float32 that knows nothing but docs/golden.md."""

import json
from math import pi

import numpy as np
import pytest

import flatland2d.golden_probes
import tracer3d.golden_probes
from restir_ref.transport.cache import golden_footprints
from tests.transport.cache.ported import wrong

WORLDS = {2: flatland2d.golden_probes, 3: tracer3d.golden_probes}
FILES = {d: json.loads(world.SHIPPED.read_text(encoding="utf-8"))["footprints"] for d, world in WORLDS.items()}
real = np.float32


class Port:
    """One path at a time, one segment after another; every part may be replaced by a mistake."""

    def __init__(self, d):
        self.n = d - 1

    def sphere(self):
        return real(2 * pi if self.n == 1 else 4 * pi)

    def widening(self, r, p, cos):
        if p == 0:
            return real(0)
        area = r**self.n / (p * cos)
        return area if self.n == 1 else np.sqrt(area)

    def area(self, length):
        return length if self.n == 1 else length * length

    def added(self, length, more):
        return length + more

    def path(self, c, r, p, cos, r0, cos0):
        a0, length, ends = r0**self.n / (self.sphere() * cos0), real(0), 0
        widenings, areas = [], []
        for i in range(len(r)):
            widenings.append(self.widening(r[i], p[i], cos[i]))
            length = self.added(length, widenings[-1])
            areas.append(self.area(length))
            if not ends and areas[-1] > c * a0:
                ends = i + 1
        return widenings, areas, a0, ends or len(r) + 1

    def answers(self, found):
        given = {name: np.array(values, dtype=real) for name, values in found["inputs"].items()}
        columns = range(given["r"].shape[1])
        each = [self.path(real(found["c"]), *(values[..., k] for values in given.values())) for k in columns]
        names = ("widening", "footprint", "pixel", "ends")
        return {name: np.stack([one[k] for one in each], axis=-1) for k, name in enumerate(names)}


@pytest.mark.claims("DDGIR-E07", part="golden vectors")
@pytest.mark.claims("DDGIR-E08", part="golden vectors")
@pytest.mark.parametrize("d", FILES)
def test_a_port_in_float32_stays_within_a_quarter_of_the_tolerances_and_ends_where_it_should(d):
    got = Port(d).answers(FILES[d])
    assert max(wrong(FILES[d], got).values()) < 0.25
    np.testing.assert_array_equal(got["ends"], FILES[d]["expected"]["ends"])


@pytest.mark.parametrize("d", FILES)
def test_all_inputs_are_numbers_of_float32_and_paths_end_everywhere(d):
    found = FILES[d]
    for values in found["inputs"].values():
        np.testing.assert_array_equal(np.array(values, dtype=real).astype(float), values)
    assert (np.array(found["inputs"]["p"]) == 0).any()
    assert set(found["expected"]["ends"]) >= {1, 2, 3, 4}


@pytest.mark.parametrize("d", FILES)
def test_no_path_s_end_hangs_on_a_rounding(d):
    x = golden_footprints.paths(d)
    assert x.r.shape == (golden_footprints.SEGMENTS, golden_footprints.KEPT)
    assert (abs(golden_footprints.spread(x, d) - 1) > golden_footprints.MARGIN).all()


class OfAreas(Port):
    """Areas add, instead of their roots."""

    def widening(self, r, p, cos):
        return r**self.n / (p * cos) if p else real(0)

    def area(self, length):
        return length


class LastAlone(Port):
    def added(self, length, more):
        return more


class Hemisphere(Port):
    def sphere(self):
        return super().sphere() / 2


class NoCosine(Port):
    def widening(self, r, p, cos):
        return super().widening(r, p, real(1))


class DeltaSpreads(Port):
    def widening(self, r, p, cos):
        return super().widening(r, p or real(1), cos)


MISTAKES = {LastAlone: "footprint", Hemisphere: "pixel", NoCosine: "widening", DeltaSpreads: "widening"}


@pytest.mark.parametrize(("port", "term"), MISTAKES.items())
@pytest.mark.parametrize("d", FILES)
def test_a_mistake_of_a_port_is_noticed_at_its_term(d, port, term):
    worst = wrong(FILES[d], port(d).answers(FILES[d]))
    assert next(name for name in ("widening", "footprint", "pixel") if worst[name] > 2) == term


def test_areas_that_add_are_noticed_in_space_and_are_right_in_the_plane():
    for d, right in ((2, True), (3, False)):
        worst = wrong(FILES[d], OfAreas(d).answers(FILES[d]))
        assert (max(worst.values()) < 0.25) == right
