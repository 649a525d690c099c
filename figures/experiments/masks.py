"""Masks of white and of blue noise: the same values in random order, and after swaps that lower an energy.  [MCMC 3.3]

The energy is that of the thesis, after Georgiev and Fajardo 2016; swaps are accepted by simulated annealing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import prod

import numpy as np

from restir_ref.batch import Array
from restir_ref.decorrelation import annealed, energy
from restir_ref.metrics import MAP, ROW, Axes

REACH, GAP, HOT = 3, 8, 0.05
"""How far energies reach, distance of sites that are swapped at once, so that no two share neighbours, temperature."""


@dataclass(frozen=True)
class Kind:
    """Masks of a shape, and sweeps until swaps gain little."""

    shape: tuple[int, ...]
    sweeps: int

    @property
    def axes(self) -> Axes:
        """Of a row or of a map."""
        return ROW if len(self.shape) == 1 else MAP


def white(shape: Sequence[int], count: int, rng: np.random.Generator) -> Array:
    """(count, n): all values (k + 1/2) / n in random order."""
    n = prod(shape)
    return rng.permuted(np.tile((np.arange(n) + 0.5) / n, (count, 1)), axis=1)


def swapped(masks: Array, kind: Kind, rng: np.random.Generator) -> Array:
    """The same after swaps of sites, at a temperature that falls to 0; masks go on round their ends.

    Many at once: a site of one lattice of period GAP with one of another, half a period aside.
    """
    masks, shape = masks.copy(), kind.shape
    place = np.stack(np.unravel_index(np.arange(prod(shape)), shape))
    steps = np.array([step for step in product(range(-REACH, REACH + 1), repeat=len(shape)) if any(step)]).T
    near = np.ravel_multi_index(tuple(place[:, :, None] + steps[:, None]), shape, mode="wrap")
    distance, lattice = np.sqrt((steps**2).sum(axis=0)), place[:, (place % GAP == 0).all(axis=0)]
    aside = [step for step in product((0, 1), repeat=len(shape)) if any(step)]
    rounds = kind.sweeps * GAP ** len(shape)
    for k in range(rounds):
        first = lattice + rng.integers(0, GAP, (len(shape), 1))
        second = first + GAP // 2 * np.array(aside[rng.integers(len(aside))])[:, None]
        a, b = (np.ravel_multi_index(tuple(sites), shape, mode="wrap") for sites in (first, second))
        b = rng.permutation(b)
        v = np.stack([masks[:, a], masks[:, b]])
        around = np.stack([masks[:, near[a]], masks[:, near[b]]])
        e, e_new = (energy(distance, each[..., None] - around).sum(axis=(0, -1)) for each in (v, v[::-1]))
        done = rng.random(e.shape) < annealed(e, e_new, HOT * (1 - k / rounds))
        masks[:, a], masks[:, b] = np.where(done, v[::-1], v)
    return masks
