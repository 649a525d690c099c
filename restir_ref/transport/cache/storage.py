"""Volumes as files: NPZ without pickle, written whole or not at all, and refused for another scene."""

import json
import os
from dataclasses import fields, is_dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.maps import Maps
from restir_ref.transport.cache.volume import Volume, Weighting
from restir_ref.transport.scene import Scene

SURFACES = "surfaces"
"""The field of a scene that only says how rays are answered."""


def digest(s: Scene) -> str:
    """SHA-256 of what light can meet in a scene: facets, balls, materials and emission."""
    found = sha256()
    for part in fields(s):
        if part.name not in (SURFACES, "space"):
            _add(found, part.name, getattr(s, part.name))
    return found.hexdigest()


def _add(found: Any, name: str, value: Any) -> None:
    """A value's name, shape and numbers; dataclasses part by part."""
    if is_dataclass(value):
        for part in fields(value):
            _add(found, f"{name}.{part.name}", getattr(value, part.name))
    elif isinstance(value, np.ndarray):
        found.update(f"{name} {value.dtype} {value.shape}".encode())
        found.update(np.ascontiguousarray(value).tobytes())
    else:
        found.update(f"{name} {value!r}".encode())


def save(v: Volume, s: Scene, path: Path) -> None:
    """Write a volume of a scene to a file, which is the old one until the new one is whole."""
    grid = {name: getattr(v.grid, name) for name in ("origin", "spacing", "counts")}
    told = json.dumps({"scene": digest(s), "grid": grid, "frames": v.frames})
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with unfinished.open("wb") as file:
            np.savez(file, told=np.array(told), E=v.E, r=v.r, active=v.active)
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def load(path: Path, s: Scene, maps: Maps, weighting: Weighting | None = None) -> Volume:
    """The volume in a file, of the scene s.  How directions are divided, and probes weighted, is not stored.

    Raises ValueError for a file that is no volume, one of another scene, or one with other maps.
    """
    try:
        with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            told = json.loads(str(file["told"]))
            E, r, active = file["E"], file["r"], file["active"]
            of, grid, frames = (
                told["scene"],
                Grid(**{k: tuple(each) for k, each in told["grid"].items()}),
                told["frames"],
            )
    except (BadZipFile, KeyError, EOFError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is no volume of probes: {error}. Compute it again, and `save` it.") from error
    if of != digest(s):
        raise ValueError(
            f"{path} holds probes of another scene ({of[:12]}) than this one ({digest(s)[:12]}): their light would be "
            "wrong here. Load it with its own scene, or compute it again."
        )
    expected = (s.C, grid.P, maps.irradiance.K), (2, grid.P, maps.depth.K), (grid.P,)
    if (E.shape, r.shape, active.shape) != expected:
        raise ValueError(
            f"{path} holds maps of shape {E.shape} and {r.shape}, but with these directions they have {expected[0]} "
            f"and {expected[1]}: load it with the maps that it was made with."
        )
    return Volume(grid, maps, E, r, active, frames, weighting or Weighting())
