"""Frames under a camera that pans by fractions of a pixel, whose history gathers: differences to 2%."""

import numpy as np
import pytest

from restir_ref import gathering as module
from restir_ref.gathering import gathering
from restir_ref.gradient_loop import PRIMAL
from restir_ref.squares import keeping
from tests.core.test_squares import SEEN, STILL, probe, rendered

REPLICAS = {1: 400, 5: 260, 20: 230}
"""By frames."""

FILMS = {"row": ((40,), ["dx"]), "map along x": ((7, 8), ["dx"]), "map along y": ((7, 8), ["dy"])}
"""Shapes, and the directions that are rendered at once."""


@pytest.mark.claims("GPT-A02", "GPT-A05", part="differences to 2%, a pan by fractions")
@pytest.mark.parametrize(("shape", "directions"), FILMS.values(), ids=FILMS)
@pytest.mark.parametrize("frames", REPLICAS)
def test_differences_whose_history_gathers_are_unbiased_to_2_percent(frames, shape, directions) -> None:
    found = rendered(shape, frames, gathering, REPLICAS[frames], directions=directions)
    assert [*found] == [PRIMAL, *directions]
    for name, (estimates, truth) in found.items():
        mean, error = probe(estimates, truth)
        assert error < SEEN, name
        assert abs(mean) < 0.02, name


@pytest.mark.claims("GPT-A02", "GPT-A05", part="differences to 2%, a camera that stands still")
@pytest.mark.parametrize("shape", [(7, 8), (40,)])
def test_where_nothing_moves_what_is_gathered_is_what_is_kept(shape) -> None:
    """So that differences of a still camera are those of `test_squares`, number by number."""
    gathered, kept = (rendered(shape, 5, follow, 40, pan=STILL) for follow in (gathering, keeping))
    assert all(np.array_equal(gathered[name][0], kept[name][0]) for name in kept)


def test_differences_that_gather_all_in_full_are_noticed(monkeypatch) -> None:
    monkeypatch.setattr(module, "balance", lambda i, found, c: np.ones(len(c[i])))
    found = rendered((7, 8), 5, gathering, 160)
    for name in ("dx", "dy"):
        mean, error = probe(*found[name])
        assert abs(mean) > 0.02 + 4 * error, name


def test_an_image_that_gathers_has_less_variance_than_one_that_rejects() -> None:
    """Rejection keeps none or several of the overlapped samples; m keeps a share of every one."""
    variance = {
        follow: rendered((7, 8), 10, follow, 60)[PRIMAL][0].var(axis=0, ddof=1).mean()
        for follow in (gathering, keeping)
    }
    assert variance[gathering] < 0.7 * variance[keeping]
