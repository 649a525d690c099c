"""Frames under a camera that stands still or pans by fractions of a pixel, whose history stays: differences to 2%."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
from restir_ref.restir import capped
from restir_ref.squares import Squares, keeping

PAN = np.array([0.3, -0.4])
"""Pixels per frame, to the right and down."""

STILL = np.zeros(2)

PERIOD = 5.2
"""Of the sheet's waves, in pixels."""


def wave(x: Array) -> Array:
    """sin(2 pi x / PERIOD)."""
    return np.sin(2 * np.pi * x / PERIOD)


def primitive(x: Array) -> Array:
    """int_0^x of the wave, up to a constant."""
    return -PERIOD / (2 * np.pi) * np.cos(2 * np.pi * x / PERIOD)


@dataclass(frozen=True, eq=False)
class Sheet:
    """A sheet of waves behind a film at `corner`: f = (1 + .9 prod of waves) (.5 + s).

    A sample is (u, s) in [0, 1)^(d+1); shifts copy all numbers, so that J = 1.
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
        return (1 + 0.9 * wave(at).prod(axis=0)) * (0.5 + x[-1])

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
        return 1 + 0.9 * (primitive(low + 1) - primitive(low)).prod(axis=0)


PRESET = GradientPreset(Preset(1, 0, 1, 2, 2.0), Preset(1, 0, 1, 2, 2.0))
"""Reuse in time alone, of a short history: rejection makes noise in every frame, and 2% are to be seen."""


def view(of: Sheet, follow: Following, pan: Array) -> dict[str, Group]:
    around = random_in_disk(of.shape) if len(of.shape) == 2 else random_in_row
    motion, everybody = np.tile(pan[: len(of.shape), None], of.n), np.ones(of.n, dtype=bool)
    found = {PRIMAL: Group({PRIMAL: of}, of.shape, motion, around, everybody, follow)}
    for name, (ends, shape) in forward(of.shape).items():
        E = ends.shape[1]
        near = random_in_disk(shape) if len(shape) == 2 else random_in_row
        found[name] = Group(pairs_of(of, ends, SAME_SIGN), shape, motion[:, :E], near, everybody[:E], follow)
    return found


def rendered(
    shape: tuple[int, ...],
    frames: int,
    follow: Following,
    replicas: int,
    *,
    pan: Array = PAN,
    directions: Sequence[str] = ("dx", "dy"),
) -> dict[str, tuple[Array, Array]]:
    """Estimates (R, n) and the truth of the image and of its differences in these directions after so many frames."""
    chance, last = Live(np.random.default_rng(frames)), None
    for k in range(frames):
        of = Sheet(shape, (k - frames) * pan[: len(shape)])
        now = {name: group for name, group in view(of, follow, pan).items() if name in (PRIMAL, *directions)}
        last = now, step(now, chance, PRESET, replicas, last)
    image = of.image()
    truth = {name: image[ends[0]] - image[ends[1]] for name, (ends, _) in forward(shape).items()} | {PRIMAL: image}
    return {name: (shaded(now[name], last[1][name])[0].reshape(replicas, -1), truth[name]) for name in now}


def probe(estimates: Array, truth: Array) -> tuple[float, float]:
    """Mean and error of what has the sign of the truth, over the mean of its size, less 1."""
    found = (estimates * np.sign(truth)).mean(axis=1) / abs(truth).mean() - 1
    return float(found.mean()), float(found.std(ddof=1) / np.sqrt(len(found)))


SEEN = 0.02 / 3
"""The error at which a bias of 2% is three of them."""

REPLICAS = {1: 400, 5: 160, 20: 160}
"""By frames."""


@pytest.mark.claims("GPT-A02", "GPT-A05", part="differences to 2%, a pan by fractions")
@pytest.mark.parametrize("shape", [(7, 8), (40,)])
@pytest.mark.parametrize("frames", REPLICAS)
def test_differences_under_a_pan_by_fractions_are_unbiased_to_2_percent(frames, shape) -> None:
    found = rendered(shape, frames, keeping, REPLICAS[frames])
    assert [*found] == [PRIMAL, "dx", "dy"][: 1 + len(shape)]
    for name, (estimates, truth) in found.items():
        mean, error = probe(estimates, truth)
        assert error < SEEN, name
        assert abs(mean) < 0.02, name


@pytest.mark.claims("GPT-A02", "GPT-A05", part="differences to 2%, a camera that stands still")
@pytest.mark.parametrize("shape", [(7, 8), (40,)])
@pytest.mark.parametrize("frames", [5, 20])
@pytest.mark.parametrize("follow", [keeping, MOVED], ids=["kept", "moved"])
def test_differences_under_a_camera_that_stands_still_are_unbiased_to_2_percent(follow, frames, shape) -> None:
    for name, (estimates, truth) in rendered(shape, frames, follow, 160, pan=STILL).items():
        mean, error = probe(estimates, truth)
        assert error < SEEN, name
        assert abs(mean) < 0.02, name


def clamped(X, cap):
    """A mistake: weights of history are clamped against fireflies."""
    Y = capped(X, cap)
    return replace(Y, W=np.minimum(Y.W, 2.0))


@pytest.mark.parametrize("follow", [keeping, MOVED], ids=["kept", "moved"])
def test_clamped_history_is_noticed_in_the_differences_of_a_camera_that_stands_still(follow, monkeypatch) -> None:
    monkeypatch.setattr("restir_ref.gradient_loop.capped", clamped)
    found = rendered((7, 8), 5, follow, 160, pan=STILL)
    for name in ("dx", "dy"):
        mean, error = probe(*found[name])
        assert abs(mean) > 0.02 + 4 * error, name


class Everything(Squares):
    """A mistake: samples outside of the square are kept as well."""

    def within(self, index, x, column):
        return column != NOWHERE


def test_differences_that_keep_all_samples_are_noticed(monkeypatch) -> None:
    monkeypatch.setattr("restir_ref.squares.Squares", Everything)
    found = rendered((7, 8), 5, keeping, 160)
    for name in ("dx", "dy"):
        mean, error = probe(*found[name])
        assert abs(mean) > 0.02 + 4 * error, name
