"""Golden vectors of probe queries: what ships, read by a second opinion that knows nothing but docs/golden.md."""

import json
from itertools import product

import numpy as np
import pytest

import flatland2d.golden_probes
import tracer3d.golden_probes
from restir_ref.transport.cache import golden
from tests.transport.cache.ported import wrong

WORLDS = {"plane": flatland2d.golden_probes, "solid": tracer3d.golden_probes}
FILES = {name: json.loads(world.SHIPPED.read_text(encoding="utf-8")) for name, world in WORLDS.items()}
CASES = [(name, k) for name in FILES for k in range(len(FILES[name]["volumes"]))]


class Reader:
    """A port in float32: one probe, one query at a time; every part may be replaced by a mistake."""

    def __init__(self, found, real=np.float32):
        as_real = {key: np.array(value, dtype=real) for key, value in found["volume"].items()}
        self.found, self.real = found, real
        self.E, self.r, self.active, self.reach = (as_real[key] for key in ("E", "r", "active", "reach"))
        self.grid = {key: np.array(value, dtype=real) for key, value in found["grid"].items() if key != "counts"}
        self.counts = found["grid"]["counts"]
        self.K, self.deep = (found["texels"][key] for key in ("irradiance", "depth"))

    def place(self, node):
        return self.grid["origin"] + self.grid["spacing"] * np.array(node, dtype=self.real)

    def texels(self, K, w):
        return self.octahedral(round(K**0.5), w) if len(self.counts) == 3 else self.bins(K, w)

    def bins(self, K, w):
        at = np.arctan2(w[1], w[0]) / self.real(2 * np.pi) * self.real(K) - self.real(0.5)
        low = int(np.floor(at))
        return [(low % K, low + 1 - at), ((low + 1) % K, at - low)]

    def octahedral(self, m, w):
        p = w / np.abs(w).sum()
        square = p[:2]
        if p[2] < 0:
            square = (1 - np.abs(p[1::-1])) * np.where(p[:2] >= 0, 1, -1).astype(self.real)
        at = (square + 1) / 2 * self.real(m) - self.real(0.5)
        low = np.floor(at).astype(int)
        part, found = at - low, []
        for right, up in product((0, 1), repeat=2):
            column, row = low[0] + right, low[1] + up
            if not 0 <= column < m:
                column, row = min(max(column, 0), m - 1), m - 1 - row
            if not 0 <= row < m:
                column, row = m - 1 - column, min(max(row, 0), m - 1)
            weight = (part[0] if right else 1 - part[0]) * (part[1] if up else 1 - part[1])
            found.append((row * m + column, weight))
        return found

    def moments(self, probe, to_point):
        texels = self.texels(self.deep, to_point)
        return [sum(weight * self.r[k, probe, texel] for texel, weight in texels) for k in (0, 1)]

    def wrap(self, cos):
        return ((cos + 1) / 2) ** 2 + self.real(0.2)

    def visibility(self, v, r1, r2):
        if v <= r1:
            return self.real(1)
        var = abs(r1 * r1 - r2)
        return max((var / (var + (v - r1) ** 2)) ** 3, self.real(0.05))

    def crush(self, weight):
        return weight**3 / self.real(0.04) if weight < self.real(0.2) else weight

    def seen_from(self, x, b):
        """The point whose direction to a probe `wrap` takes."""
        return x

    def trust(self, probe, node, x, n, b):
        to_probe, to_point = self.place(node) - self.seen_from(x, b), x + b - self.place(node)
        v = np.sqrt((to_point**2).sum())
        r1, r2 = self.moments(probe, to_point / v)
        cos = (n * to_probe).sum() / np.sqrt((to_probe**2).sum())
        return self.crush(self.wrap(cos) * self.visibility(min(v, self.reach), r1, r2)) * self.active[probe]

    def query(self, x, n, w, b):
        last = np.array(self.counts) - 1
        at = np.clip((x + b - self.grid["origin"]) / self.grid["spacing"], 0, last.astype(self.real))
        low = np.minimum(np.floor(at).astype(int), np.maximum(last - 1, 0))
        part = at - low
        corners, total, whole = [], 0, self.real(0)
        for up in product((0, 1), repeat=len(x)):
            node = np.minimum(low + up, last)
            probe = int(np.ravel_multi_index(tuple(node), self.counts))
            near = np.where(up, part, 1 - part).prod(dtype=self.real)
            trust = self.trust(probe, node, x, n, b)
            E = sum(weight * self.E[:, probe, texel] for texel, weight in self.texels(self.K, w))
            total, whole = total + near * trust * E, whole + near * trust
            corners.append((probe, near, trust))
        probe, near, trust = (np.array(each) for each in zip(*corners, strict=True))
        irradiance = total / whole if whole > 0 else np.zeros(len(self.E), dtype=self.real)
        return {"probe": probe, "near": near, "trust": trust, "irradiance": irradiance}

    def answers(self):
        inputs = {key: np.array(value, dtype=self.real) for key, value in self.found["inputs"].items()}
        found = [self.query(*(inputs[key][:, k] for key in ("x", "n", "w", "b"))) for k in range(inputs["x"].shape[1])]
        return {key: np.stack([each[key] for each in found], axis=-1) for key in found[0]}


@pytest.mark.parametrize("name", WORLDS)
def test_what_ships_is_what_would_be_written(name, tmp_path):
    world = WORLDS[name]
    assert golden.main(world.VOLUMES, world.SHIPPED, ["--check"]) == 0
    assert golden.main(world.VOLUMES, world.SHIPPED, [str(tmp_path / "other.json")]) == 0
    assert golden.alike(json.loads((tmp_path / "other.json").read_text()), FILES[name])
    (tmp_path / "other.json").write_text("{}")
    assert golden.main(world.VOLUMES, tmp_path / "other.json", ["--check"]) == 1


def test_a_rounding_is_no_change_and_everything_else_is():
    said = {"a": [1.0, 0.25, 3], "b": ["x", None]}
    assert golden.alike(said, {"a": [1.0 + 2e-16, 0.25, 3], "b": ["x", None]})
    changes = ([1.0 + 1e-9, 0.25, 3], [1.0, 0.25], [1.0, 0.25, 3.0], [1.0, 0.25, 4])
    assert not any(golden.alike(said, {"a": each, "b": ["x", None]}) for each in changes)
    assert not golden.alike(said, {"a": said["a"], "b": ["y", None]})
    assert not golden.alike(said, {"a": said["a"]})


@pytest.mark.parametrize(("name", "k"), CASES)
def test_all_inputs_are_numbers_of_float32(name, k):
    found = FILES[name]["volumes"][k]
    for part in ({key: found["volume"][key] for key in ("E", "r")}, found["inputs"]):
        for values in part.values():
            np.testing.assert_array_equal(np.array(values, dtype=np.float32).astype(float), values)


@pytest.mark.parametrize(("name", "k"), CASES)
def test_a_reader_in_float32_stays_within_a_quarter_of_the_tolerances(name, k):
    found = FILES[name]["volumes"][k]
    got = Reader(found).answers()
    np.testing.assert_array_equal(got["probe"], found["expected"]["probe"])
    assert max(wrong(found, got).values()) < 0.25


def test_questions_decide_something():
    """Probes inside walls, points outside the grid, visibility of all kinds, and weights on both sides of the crush."""
    for file in FILES.values():
        found = file["volumes"][0]
        trust, near = (np.array(found["expected"][name]) for name in ("trust", "near"))
        assert (trust == 0).any()
        assert (near == 0).any()
        assert ((trust > 0) & (trust < 0.2)).any()
        assert (trust > 0.3).any()


class Swapped(Reader):
    def moments(self, probe, to_point):
        return super().moments(probe, to_point)[::-1]


class Displaced(Reader):
    def seen_from(self, x, b):
        return x + b


class Squared(Reader):
    def visibility(self, v, r1, r2):
        return super().visibility(v, r1, r2) ** self.real(2 / 3)


class Uncrushed(Reader):
    def crush(self, weight):
        return weight


class Unclipped(Reader):
    def __init__(self, found, real=np.float32):
        super().__init__(found, real)
        self.reach = real(1e9)


class Everywhere(Reader):
    def __init__(self, found, real=np.float32):
        super().__init__(found, real)
        self.active = np.ones_like(self.active)


class Nearest(Reader):
    def texels(self, K, w):
        return [(max(super().texels(K, w), key=lambda each: each[1])[0], self.real(1))]


@pytest.mark.parametrize("port", [Swapped, Displaced, Squared, Uncrushed, Unclipped, Everywhere, Nearest])
@pytest.mark.parametrize("name", WORLDS)
def test_a_mistake_of_a_port_is_noticed(name, port):
    found = FILES[name]["volumes"][0]
    assert max(wrong(found, port(found).answers()).values()) > 2
