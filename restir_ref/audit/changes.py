"""Changed scenes: the same estimator on tables in which one thing that can go wrong is absent.

A stranger's estimator has a scene built in, so the scene's own tables are exchanged while it runs and put back
afterwards.  If its bias is gone where no shift is undefined, say, then the bias *needs* undefined shifts.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.oracle.cells import Cells
from restir_ref.oracle.enumeration import scattered

FAR = 2.0**20
"""Far enough for any cut-off that is of the scene's size to be left behind; a power of two, so nothing is rounded."""


@contextmanager
def standing_in(tables: Cells, other: Cells) -> Iterator[None]:
    """Let all frames of `tables` read `other` for a while; no estimator that looks tables up can tell.

    Hazard: the one place where something frozen changes.  Strangers close over frames, and frames over tables.
    """
    before = {each.name: getattr(tables, each.name) for each in fields(Cells)}
    try:
        for name in before:
            object.__setattr__(tables, name, getattr(other, name))
        yield
    finally:
        for name, values in before.items():
            object.__setattr__(tables, name, values)


@dataclass(frozen=True)
class Change:
    """Another scene of the same size, tables(cells, n), and in words what is absent there."""

    absent: str
    tables: Callable[[Cells, int], Cells]


# ---------------------------------------------------------------- pieces


def with_mass(old: Cells, v: Array, mass: Array) -> Cells:
    """Volumes v (I, K), and techniques that reach every cell with these probabilities (T, I, K), up to a factor."""
    whole = ratio(mass, mass.sum(axis=-1, keepdims=True))
    return replace(old, v=v, pdf=ratio(whole, np.broadcast_to(v, whole.shape)))


def mass_of(old: Cells) -> Array:
    """The probability of every cell, (T, I, K)."""
    return np.asarray(old.pdf * old.v)


def identity(old: Cells) -> Array:
    """Shifts (I, I, K) that keep the number of the cell."""
    return np.broadcast_to(np.arange(old.v.shape[-1]), old.shifts.shape).copy()


def copied(old: Cells, of: Array) -> Cells:
    """Every integral a copy of integral of[i] (I,)."""
    return replace(old, v=old.v[of], f=old.f[of], p_hat=old.p_hat[of], pdf=old.pdf[:, of])


def last_frame(old: Cells, n: int) -> Array:
    """The integral of the same pixel in the last frame, (I,)."""
    count = len(old.v)
    return np.asarray(count - n + np.arange(count) % n)


# ---------------------------------------------------------------- what is absent


def lit(old: Cells, n: int) -> Cells:
    """Every technique reaches every cell, and no target is 0."""
    reached = with_mass(old, old.v, np.where(old.pdf > 0, mass_of(old), 0.25))
    return replace(reached, f=np.where(old.f > 0, old.f, 1.0), p_hat=np.where(old.p_hat > 0, old.p_hat, 1.0))


def without_holes(old: Cells, n: int) -> Cells:
    """Every shift keeps the number of the cell, so that none is undefined."""
    return replace(old, shifts=identity(old))


def equal_volumes(old: Cells, n: int) -> Cells:
    """All volumes 1, so that every Jacobian is 1; cells are as probable as before."""
    return with_mass(old, np.ones(old.v.shape), mass_of(old))


def flat_target(old: Cells, n: int) -> Cells:
    """Every target is 1 or 0, and every sample as likely as the next one."""
    flat = with_mass(old, old.v, np.where(old.pdf > 0, old.v, 0.0))
    return replace(flat, f=np.where(old.f > 0, 1.0, 0), p_hat=np.where(old.p_hat > 0, 1.0, 0))


def frames_alike(old: Cells, n: int) -> Cells:
    """Earlier frames are copies of the last one, pixel by pixel."""
    of = last_frame(old, n)
    same = (of[:, None] == of)[..., None]
    return replace(copied(old, of), shifts=np.where(same, identity(old), old.shifts[of][:, of]))


def all_alike(old: Cells, n: int) -> Cells:
    """All pixels of all frames are copies of the last one, and shifts keep the number of the cell."""
    return replace(copied(old, np.full(len(old.v), len(old.v) - 1)), shifts=identity(old))


def no_shifts(old: Cells, n: int) -> Cells:
    """No sample can be shifted to another integral."""
    same = np.eye(len(old.v), dtype=bool)[..., None]
    return replace(old, shifts=np.where(same, old.shifts, -1))


def times_target(factor: float) -> Callable[[Cells, int], Cells]:
    """All targets times a factor."""
    return lambda old, n: replace(old, f=old.f * factor, p_hat=old.p_hat * factor)


def times_volume(factor: float) -> Callable[[Cells, int], Cells]:
    """All volumes times a factor, and so all contribution weights; cells are as probable as before."""
    return lambda old, n: with_mass(old, old.v * factor, mass_of(old))


def techniques_apart(old: Cells, n: int) -> Cells:
    """No cell is reached by two techniques: each has those that are most likely under it, or are left to it."""
    mass = mass_of(old)
    place = np.arange(old.v.shape[-1]) % len(mass)
    mine = np.arange(len(mass))[:, None, None] == place
    return with_mass(old, old.v, np.where(mine, np.maximum(mass, 0.25), 0))


CHANGES: Mapping[str, Change] = MappingProxyType(
    {
        "lit": Change("dark samples", lit),
        "no holes": Change("undefined shifts", without_holes),
        "equal volumes": Change("Jacobians (J = 1)", equal_volumes),
        "flat target": Change("differences between samples", flat_target),
        "frames alike": Change("differences between frames", frames_alike),
        "all alike": Change("differences between pixels and frames", all_alike),
        "no shifts": Change("shifted samples", no_shifts),
        "bright": Change("small targets (all times 2^20)", times_target(FAR)),
        "dim": Change("large targets (all times 2^-20)", times_target(1 / FAR)),
        "large W": Change("small W (all times 2^20)", times_volume(FAR)),
        "small W": Change("large W (all times 2^-20)", times_volume(1 / FAR)),
        "techniques apart": Change("cells that two techniques reach", techniques_apart),
    }
)
"""By name, one thing absent each."""

SCALES = ("bright", "dim", "large W", "small W")
"""Those that change nothing but sizes."""


def applies(name: str, old: Cells, n: int) -> bool:
    """Whether a change can change anything: frames where there are several, techniques likewise."""
    return {"frames alike": len(old.v) > n, "techniques apart": len(old.pdf) > 1}.get(name, True)


# ---------------------------------------------------------------- who is read


def stirred(old: Cells, mask: Array) -> Cells:
    """Other targets and densities in the integrals of a mask (I,); what was 0 stays 0."""
    by = 2.0 ** np.floor(4 * scattered(np.arange(old.v.size), 91).reshape(old.v.shape) - 1)
    f, p_hat = (np.where(mask[:, None], each * by, each) for each in (old.f, old.p_hat))
    mass = np.where(mask[:, None], mass_of(old) * by[:, ::-1], mass_of(old))
    return replace(with_mass(old, old.v, mass), f=f, p_hat=p_hat)


def other_pixels(old: Cells, n: int, pixel: int) -> Cells:
    """All pixels but one stirred, in the last frame."""
    number = np.arange(len(old.v))
    return stirred(old, (number >= len(old.v) - n) & (number % n != pixel))


def earlier_frames(old: Cells, n: int) -> Cells:
    """All frames but the last stirred."""
    return stirred(old, np.arange(len(old.v)) < len(old.v) - n)


def other_density(old: Cells, technique: int) -> Cells:
    """One technique's densities stirred."""
    new = stirred(old, np.ones(len(old.v), dtype=bool)).pdf
    which = (np.arange(len(old.pdf)) == technique)[:, None, None]
    return replace(old, pdf=np.where(which, new, old.pdf))


def renumbered(old: Cells) -> Cells:
    """The same scene with its cells numbered anew: cell x is cell x + 1, and the last one cell 0."""
    K = old.v.shape[-1]
    back = np.roll(old.shifts, 1, axis=-1)
    moves = None if old.proposal is None else np.roll(old.proposal, (1, 1), axis=(0, 1))
    return replace(
        old,
        v=np.roll(old.v, 1, axis=-1),
        f=np.roll(old.f, 1, axis=-1),
        p_hat=np.roll(old.p_hat, 1, axis=-1),
        pdf=np.roll(old.pdf, 1, axis=-1),
        shifts=np.where(back >= 0, (back + 1) % K, -1),
        proposal=moves,
    )
