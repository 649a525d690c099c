"""Whole frames of ReSTIR PT in rooms of segments, triangles and tetrahedra: what a 3D world will plug into."""

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import Preset, frame, random_in_row
from restir_ref.restir import initial, shade
from restir_ref.transport.paths import RECONNECTION, Connectability
from restir_ref.transport.restir_pt import PathIntegrals
from tests.transport.furnished import FURNISHED, furnished_shifts

HYBRID = Connectability(0.45, 0.02)
REPLICAS, BATCHES = 1000, 3
PRESET = Preset(trees=1, rounds=1, neighbours=2, radius=3, cap=5)


def differences(name: str, rule: Connectability) -> tuple[Array, float]:
    """Mean over pixels of two reused frames minus initial estimates, one per replica; and the mean image."""
    of = PathIntegrals(furnished_shifts(name, rule, 1, 0).t)
    here, chance = Pixels(of, np.arange(REPLICAS * of.n)), Live(np.random.default_rng(3))
    found, means = [], []
    for _ in range(BATCHES):
        history: Reservoirs | None = None
        for _ in range(2):
            history = frame(here, chance, PRESET, random_in_row, history, [Pixels(of, here.index)] if history else [])
        plain = shade(initial(here, chance), here)
        found.append((shade(history, here) - plain).mean(axis=0).reshape(REPLICAS, -1).mean(axis=1))
        means.append(plain.mean())
    return np.concatenate(found), float(np.mean(means))


@pytest.mark.claims("COM-A06")
@pytest.mark.parametrize("rule", [RECONNECTION, HYBRID], ids=["reconnection", "hybrid"])
@pytest.mark.parametrize("name", FURNISHED)
def test_reuse_over_space_and_time_changes_no_mean_in_any_dimension(name, rule) -> None:
    d, mean = differences(name, rule)
    error = d.std(ddof=1) / np.sqrt(len(d))
    assert error < 0.02 * mean
    assert abs(d.mean()) < 4 * error


@pytest.mark.parametrize("name", FURNISHED)
def test_jacobians_all_twice_as_large_are_seen_in_any_dimension(name, monkeypatch) -> None:
    right = PathIntegrals.shift

    def wrong(self, x, index, to):
        y = right(self, x, index, to)
        return type(y)(y.x, 2.0 * (y.J > 0))

    monkeypatch.setattr(PathIntegrals, "shift", wrong)
    d, _ = differences(name, RECONNECTION)
    assert abs(d.mean()) > 8 * d.std(ddof=1) / np.sqrt(len(d))
