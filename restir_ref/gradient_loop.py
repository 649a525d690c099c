"""Frames of a gradient renderer: the image and its pairs, each part with a reservoir of its own.  [GPT 4.1-4.4, Fig. 2]

A `Group` is what reuses among itself: the pixels (one part, "primal"), the pairs of one direction (two parts,
"positive" and "negative", or one, "magnitude").  Then every part reuses in time, by area reservoirs, and in space.

One tree per pixel is drawn and read by all of them, which is ours: the paper draws for pairs anew, in a pass of their
own.  It saves their rays; image and differences then share noise, and each pair has the candidates of both its pixels.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from restir_ref.area import MOVED, Film, Following
from restir_ref.batch import Array, joined, take
from restir_ref.chance import Chance
from restir_ref.gradient import MAGNITUDE, SIGNS, Drawn, Pairs, Part
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import Around, Preset
from restir_ref.mis import WEIGHTS
from restir_ref.resampling import Input, gris
from restir_ref.restir import capped, entering, resample, shade

PRIMAL = "primal"

PARTS: Mapping[str, Part] = MappingProxyType({**SIGNS, "magnitude": MAGNITUDE})

Partners = Mapping[str, tuple[str, ...]]
"""For every part of a pair that has a reservoir, the parts whose reservoirs it reuses."""

SAME_SIGN: Partners = MappingProxyType({"positive": ("positive",), "negative": ("negative",)})
"""r_+ from r_+, r_- from r_-.  [GPT 4.4]"""

ACROSS_SIGNS: Partners = MappingProxyType(dict.fromkeys(SIGNS, ("positive", "negative")))
"""Each sign from both.  [GPT 4.4; Chang 2023]"""

UNSIGNED: Partners = MappingProxyType({"magnitude": ("magnitude",)})
"""One reservoir for both signs.  [GPT Eq. 19]"""


@dataclass(frozen=True)
class GradientPreset:
    """Parameters of a gradient renderer: of its pixels, of its pairs, and the parts these have.

    Pairs read the trees of the pixels, so that the number of their own does not count.
    """

    pixels: Preset
    pairs: Preset
    partners: Partners = field(default_factory=lambda: SAME_SIGN)


GRADIENT = GradientPreset(
    Preset(trees=1, rounds=1, neighbours=2, radius=20, cap=20),
    Preset(trees=1, rounds=1, neighbours=1, radius=20, cap=20),
)
"""One tree; 2 neighbours for pixels and 1 for pairs [GPT 5]; cap and radius, which it leaves open, of [GRIS 8.3]."""


@dataclass(frozen=True, eq=False)
class Group:
    """Pixels or pairs of one frame that reuse among themselves.

    of      the integrals of every part
    shape   (rows, columns) of the image they form, or (n,) in a row
    by      (film, n) where the previous frame showed each, in pixels from where it is; inf where there is no history
    around  how neighbours are chosen
    active  which (n,) reuse in space
    follow  how history follows the motion

    Raises ValueError where these are not of as many pixels or pairs as the integrals, or of none.
    """

    of: Mapping[str, Film]
    shape: Sequence[int]
    by: Array
    around: Around
    active: Array
    follow: Following = MOVED

    def __post_init__(self) -> None:
        size = int(np.prod(self.shape))
        for part, of in self.of.items():
            fits = of.n == self.by.shape[-1] == len(self.active) > 0 and size > 0 and of.n % size == 0
            if not fits:
                raise ValueError(
                    f"a group of {of.n} {part} integrals needs motion and activity of as many, and whole images: its "
                    f"shape is {tuple(self.shape)}, `by` has {self.by.shape[-1]} columns, `active` {len(self.active)}."
                )

    @property
    def n(self) -> int:
        """Number of pixels or pairs."""
        return len(self.active)


View = Mapping[str, Group]
"""One frame: the pixels under `PRIMAL`, and the pairs under the name of each direction."""

Parts = Mapping[str, Reservoirs]
"""The reservoirs of one group, by part."""

History = Mapping[str, Parts]
"""The reservoirs of all groups."""


def step(
    view: View,
    chance: Chance,
    preset: GradientPreset,
    replicas: int = 1,
    last: tuple[View, History] | None = None,
) -> History:
    """One frame after the `last` one: sample once, then every part reuses in time and in space.  [GPT Fig. 2b]"""
    drawn = sampled(view[PRIMAL].of[PRIMAL], chance, preset.pixels.trees, replicas)
    found = {}
    for name, group in view.items():
        chosen, partners = (preset.pixels, {PRIMAL: (PRIMAL,)}) if name == PRIMAL else (preset.pairs, preset.partners)
        X = first(group, np.arange(replicas * group.n), drawn, chance)
        if last is not None:
            X = in_time(group, X, (last[0][name], last[1][name]), chosen, partners, chance)
        for _ in range(chosen.rounds):
            X = in_space(group, X, chosen, partners, chance)
        found[name] = X
    return found


def sampled(image: Film, chance: Chance, trees: int, replicas: int) -> list[Drawn]:
    """Candidates of all pixels, drawn once for every reservoir that reads them."""
    index = np.arange(replicas * image.n)
    return [(x, mW / trees) for _ in range(trees) for x, mW in image.candidates(index, chance)]


def first(group: Group, index: Array, drawn: Sequence[Drawn], chance: Chance) -> Parts:
    """RIS of the same candidates in every part; pairs are shifted once for all of theirs.  [GPT 4.4]"""
    some = next(iter(group.of.values()))
    offered = list(some.offered(index, drawn)) if isinstance(some, Pairs) else drawn
    return {part: resample(offered, Pixels(of, index), chance) for part, of in group.of.items()}


def in_time(
    group: Group,
    X: Parts,
    last: tuple[Group, Parts],
    preset: Preset,
    partners: Partners,
    chance: Chance,
) -> Parts:
    """Every part with its partners' history in the previous pixels that it overlaps.  [GPT 4.3.1]"""
    before, Y = last
    if tuple(before.shape) != tuple(group.shape) or before.n != group.n:
        raise ValueError(
            f"history of {before.n} pixels or pairs, shape {tuple(before.shape)}, has no places for {group.n} of shape "
            f"{tuple(group.shape)}: keep the image's size, or start anew without history."
        )
    index = np.arange(columns_of(X))
    inputs_of, found = group.follow(before.shape, group.by, index, chance), {}
    for part, of in group.of.items():
        past = [(before.of[partner], capped(Y[partner], preset.cap)) for partner in partners[part]]
        inputs = inputs_of(of, X[part], past)
        found[part] = gris(inputs, inputs[0].at, WEIGHTS[preset.along], chance)
    return found


def in_space(group: Group, X: Parts, preset: Preset, partners: Partners, chance: Chance) -> Parts:
    """Every active pixel or pair with its partners around it; the others keep what they have.  [GPT 4.3.2]"""
    columns = np.flatnonzero(np.resize(group.active, columns_of(X)))
    found = dict(X)
    for part, of in group.of.items() if len(columns) else ():
        here = Pixels(of, columns)
        near = group.around(of, columns, preset.neighbours, preset.radius, chance)
        inputs = [Input(take(X[part], columns), here)]
        for partner in partners[part]:
            others = near if partner == part else [here, *near]
            inputs += [entering(X[partner], Pixels(group.of[partner], each.index)) for each in others]
        found[part] = replaced(X[part], columns, gris(inputs, here, WEIGHTS[preset.across], chance))
    return found


def columns_of(X: Parts) -> int:
    """How many columns the reservoirs of every part have."""
    return len(next(iter(X.values())).W)


def replaced(X: Reservoirs, columns: Array, Y: Reservoirs) -> Reservoirs:
    """X with Y in some of its columns."""
    order = np.arange(len(X.W))
    order[columns] = len(X.W) + np.arange(len(columns))
    return take(joined([X, Y]), order)


def shaded(group: Group, X: Parts) -> Array:
    """The estimate of every pixel or pair, all parts together; (C, N).  [GPT Eq. 17, 24]"""
    return np.asarray(sum(shade(X[part], Pixels(of, np.arange(len(X[part].W)))) for part, of in group.of.items()))


def pairs_of(image: Film, ends: Array, partners: Partners) -> dict[str, Film]:
    """The pairs of one direction, by part."""
    return {part: Pairs(image, ends, PARTS[part]) for part in partners}


def forward(shape: Sequence[int], crops: int = 1) -> dict[str, tuple[Array, tuple[int, ...]]]:
    """Ends (2, E) and shape of the pairs of every direction, "dx" along the last axis, "dy" along the first of two.

    A pair is (next pixel, this pixel), so that its difference I_i - I_j is the forward difference.
    Raises ValueError where a direction has no pairs.
    """
    if not shape or min(*shape, 2) < 2 or crops < 1:
        raise ValueError(
            f"{crops} images of shape {tuple(shape)} have a direction without neighbours, so no pairs: gradients need "
            "2 pixels or more along every axis.  Give a single row as (n,), and render a single pixel without them."
        )
    pixel = np.arange(crops * int(np.prod(shape))).reshape(crops, *shape)
    found = {"dx": (pixel[..., 1:], pixel[..., :-1])}
    if len(shape) == 2:
        found["dy"] = (pixel[:, 1:], pixel[:, :-1])
    return {name: (np.stack([i.ravel(), j.ravel()]), i.shape[1:]) for name, (i, j) in found.items()}


def nearer(by: Array, depth: Array, ends: Array) -> Array:
    """The motion (film, E) of pairs: that of the nearer pixel, so that what is in front stays there.  [GPT 4.3.1]"""
    i, j = ends
    return by[:, np.where(depth[i] <= depth[j], i, j)]
