"""Paths that left an open box send no rays, and change nothing that the others find."""

from collections import Counter

import numpy as np
import pytest

from restir_ref.transport import paths
from restir_ref.transport.counting import counted, rays
from restir_ref.transport.paths import REPLAY, Tracer, leaves, trace
from tracer3d import SCENES


def traced(scene: str, crowded: float, monkeypatch):
    """All leaves of 4000 trees, and their rays, where dead paths are left out below that share of living ones."""
    monkeypatch.setattr(paths, "CROWDED", crowded)
    s, asked = SCENES[scene](), Counter()
    t = Tracer(counted(s.scene, asked), s.pinhole(8, 8), s.depth, REPLAY)
    tree = trace(t, np.random.default_rng(1).random((t.D, 4000)), np.arange(4000) % 64)
    return [F for *_, F in leaves(tree)], tree, rays(asked)


@pytest.mark.parametrize("scene", ["cornell", "glossy_cornell", "ajar"])
def test_leaving_out_dead_paths_changes_no_leaf_to_the_last_bit(scene, monkeypatch) -> None:
    (found, _, _), (expected, _, _) = (traced(scene, share, monkeypatch) for share in (1.0, -1.0))
    assert all(map(np.array_equal, found, expected))
    assert sum(F.sum() for F in found) > 0


def test_dead_paths_send_no_rays(monkeypatch) -> None:
    (_, tree, fewer), (_, _, all_of_them) = (traced("cornell", share, monkeypatch) for share in (1.0, -1.0))
    alive = [T.any(axis=0).mean() for T in tree.T]
    assert alive[2] < 0.7
    assert fewer < 0.8 * all_of_them
