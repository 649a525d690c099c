"""Frames under a camera that pans by fractions of a pixel, whose history stays in place: differences to 2%."""

from dataclasses import dataclass

import numpy as np
import pytest

from restir_ref.area import MOVED, Following
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient_loop import (
    PRIMAL,
    SAME_SIGN,
    GradientPreset,
    Group,
    forward,
    pairs_of,
    shaded,
    step,
)
from restir_ref.images import random_in_disk
from restir_ref.integrals import NOWHERE, Pixels, Shifted
from restir_ref.loop import Preset, random_in_row
from restir_ref.squares import Squares, keeping

PAN = np.array([0.3, -0.4])
"""Pixels per frame, to the right and down."""

PERIOD = 5.2
"""Of the squares on the sheet, in pixels."""


def wave(x: Array) -> Array:
    """1 in one half of every period, -1 in the other."""
    return np.where(x % PERIOD < PERIOD / 2, 1.0, -1.0)


def primitive(x: Array) -> Array:
    """int_0^x of the wave."""
    return PERIOD / 2 - abs(x % PERIOD - PERIOD / 2)


@dataclass(frozen=True, eq=False)
class Board:
    """A checkered sheet behind a film at `corner`: f = (1 + .5 prod of waves) 2 s, a sample is (u, s) in [0, 1)^(d+1).

    Shifts copy all numbers, so that J = 1.
    """

    shape: tuple[int, ...]
    corner: Array

    @property
    def n(self) -> int:
        return int(np.prod(self.shape))

    def pixel(self, index: Array) -> Array:
        """(d, N), the last axis first."""
        return np.stack(np.unravel_index(index % self.n, self.shape)[::-1])

    def candidates(self, index, chance):
        yield chance.uniform((len(self.shape) + 1, len(index))), np.ones(len(index))

    def target(self, index: Array, x: Array) -> Array:
        at = self.pixel(index) + x[:-1] + self.corner[:, None]
        return (1 + 0.5 * wave(at).prod(axis=0)) * 2 * x[-1]

    def contribution(self, index: Array, x: Array) -> Array:
        return self.target(index, x)[None]

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        return Shifted(x, np.ones(len(index)))

    def place(self, x: Array) -> Array:
        return x[:-1]

    def displaced(self, x: Array, by: Array) -> Array:
        return np.concatenate([(x[:-1] + by) % 1, x[-1:]])

    def image(self) -> Array:
        """The integral of every pixel, in closed form; (n,)."""
        low = self.pixel(np.arange(self.n)) + self.corner[:, None]
        return 1 + 0.5 * (primitive(low + 1) - primitive(low)).prod(axis=0)


PRESET = GradientPreset(Preset(1, 1, 1, 2, 10.0), Preset(1, 1, 1, 2, 10.0))


def view(of: Board, follow: Following) -> dict[str, Group]:
    around = random_in_disk(of.shape) if len(of.shape) == 2 else random_in_row
    motion, everybody = np.tile(PAN[: len(of.shape), None], of.n), np.ones(of.n, dtype=bool)
    found = {PRIMAL: Group({PRIMAL: of}, of.shape, motion, around, everybody, follow)}
    for name, (ends, shape) in forward(of.shape).items():
        E = ends.shape[1]
        near = random_in_disk(shape) if len(shape) == 2 else random_in_row
        found[name] = Group(pairs_of(of, ends, SAME_SIGN), shape, motion[:, :E], near, everybody[:E], follow)
    return found


def rendered(shape: tuple[int, ...], frames: int, follow: Following, replicas: int) -> dict[str, tuple[Array, Array]]:
    """Estimates (R, n) and the truth of every group after so many frames."""
    chance, last = Live(np.random.default_rng(frames)), None
    for k in range(frames):
        of = Board(shape, (k - frames) * PAN[: len(shape)])
        now = view(of, follow)
        last = now, step(now, chance, PRESET, replicas, last)
    image = of.image()
    truth = {name: image[ends[0]] - image[ends[1]] for name, (ends, _) in forward(shape).items()} | {PRIMAL: image}
    return {name: (shaded(now[name], last[1][name])[0].reshape(replicas, -1), truth[name]) for name in now}


def probe(estimates: Array, truth: Array) -> tuple[float, float]:
    """Mean and error of what has the sign of the truth, over the mean of its size, less 1."""
    found = (estimates * np.sign(truth)).mean(axis=1) / abs(truth).mean() - 1
    return float(found.mean()), float(found.std(ddof=1) / np.sqrt(len(found)))


FOLLOWING = {"kept": keeping, "moved": MOVED}


@pytest.mark.claims("GPT-A02", "GPT-A05", part="differences to 2%, a pan by fractions")
@pytest.mark.parametrize("follow", FOLLOWING.values(), ids=FOLLOWING)
@pytest.mark.parametrize("frames", [1, 5, 20])
def test_differences_of_a_map_under_a_pan_by_fractions_are_unbiased_to_2_percent(frames, follow) -> None:
    for name, (estimates, truth) in rendered((9, 10), frames, follow, 250).items():
        mean, error = probe(estimates, truth)
        assert error < 0.005, name
        assert abs(mean) < 0.02, name


@pytest.mark.claims("GPT-A02", "GPT-A05", part="differences to 2%, a pan by fractions")
@pytest.mark.parametrize("frames", [1, 5, 20])
def test_differences_of_a_row_under_a_pan_by_fractions_are_unbiased_to_2_percent(frames) -> None:
    for name, (estimates, truth) in rendered((40,), frames, keeping, 400).items():
        mean, error = probe(estimates, truth)
        assert error < 0.005, name
        assert abs(mean) < 0.02, name


class Everything(Squares):
    """A mistake: samples outside of the square are kept as well."""

    def within(self, index, x, column):
        return column != NOWHERE


def test_differences_that_keep_all_samples_are_noticed(monkeypatch) -> None:
    monkeypatch.setattr("restir_ref.squares.Squares", Everything)
    found = rendered((9, 10), 5, keeping, 60)
    for name in ("dx", "dy"):
        mean, error = probe(*found[name])
        assert abs(mean) > 0.02 + 4 * error, name
