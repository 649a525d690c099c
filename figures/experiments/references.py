"""Reference images of scenes of both worlds: long path tracing, or a closed form, with their standard errors.

`make evidence` makes them, by its jobs `references`, `indirect references` and `space references`.  Each carries a
fingerprint of its scene, sensor and depth: a scene that has changed since has no reference.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from figures.claims.errors import FigureError
from figures.claims.figure import Arrays
from figures.engine import store
from figures.experiments.views import in_space, setting, standard
from restir_ref.transport.lobes import KINDS
from restir_ref.transport.paths import Sensor
from restir_ref.transport.scene import Scene

PATH = Path(__file__).with_suffix(".npz")
KEY = store.canonical({"what": "reference images of flatland", "format": 1})
INDIRECT = "indirect"
"""Light that ReSTIR DI does not stand for: all but what comes from a light by way of x_1 alone."""
DIGITS = 12
"""Digits that count: sines and tangents in scenes end differently on other machines."""


@dataclass(frozen=True, eq=False)
class Reference:
    """The image seen by the scene's standard sensor, (n,), the mean of its channels.

    error    standard error of each pixel (n,), and `image_error` that of the image's mean
    samples  per pixel, 0 where nothing is sampled;  how  in words
    """

    mean: NDArray[np.float64]
    error: NDArray[np.float64]
    image_error: float
    samples: int
    how: str


def reference(name: str, light: str = "", path: Path = PATH) -> Reference:
    """The reference of one scene, of all light or of INDIRECT light alone.

    Raises FigureError if there is none, or if the scene is another one now.
    """
    stored, key = stored_at(path), key_of(name, light)
    if f"{key}.mean" not in stored:
        raise FigureError(
            f"{path.name} holds no reference of the scene {name!r}{light and f', {light}'}; {remedy(name, light)}"
        )
    if str(stored[f"{key}.scene"]) != fingerprint(name):
        raise FigureError(f"the scene {name!r} has changed since its reference was computed; {remedy(name, light)}")
    mean, error = stored[f"{key}.mean"], stored[f"{key}.error"]
    return Reference(
        mean, error, float(stored[f"{key}.image_error"]), int(stored[f"{key}.samples"]), str(stored[f"{key}.how"])
    )


def remedy(name: str, light: str = "") -> str:
    """How to make a reference."""
    job = "space references" if in_space(name) else f"{light} references".strip()
    return f"run: make evidence ARGS={job}" if " " not in job else f"run: make evidence ARGS=\"'{job}'\""


def key_of(name: str, light: str = "") -> str:
    """The name under which a reference is stored: the scene, and the light if it is not all."""
    return f"{name}.{light}" if light else name


def stored_at(path: Path) -> Arrays:
    """Everything in a file of references, none if there is no file; raises FigureError if it is damaged."""
    found = store.load(path, KEY)
    if found.state in ("ours", "absent"):
        return found.arrays
    raise FigureError(f"{path.name} cannot be used ({found.trouble}); restore it from git, or {remedy('')}")


def save(references: Mapping[str, Reference], path: Path = PATH) -> None:
    """Write references of today's scenes, by `key_of`, into the file, in one step; one that is better stays."""
    arrays = stored_at(path)
    for name, each in references.items():
        scene = fingerprint(name.partition(".")[0])
        stays = str(arrays.get(f"{name}.scene")) == scene and arrays[f"{name}.image_error"] < each.image_error
        if not stays:
            values: dict[str, Any] = {**vars(each), "scene": scene}
            arrays |= {f"{name}.{field}": np.asarray(value) for field, value in values.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    store.save(path, arrays, KEY)


def fingerprint(name: str) -> str:
    """`digest` of the scene of that name, seen by its standard sensor."""
    of = setting(name)
    return digest(of.scene, standard(name), of.depth)


def digest(scene: Scene, sensor: Sensor, depth: int) -> str:
    """SHA-256, shortened, over what the image depends on: shapes, materials, lights, sensor and depth."""
    table = scene.materials
    kinds = [KINDS[kind] for kind in table.kind]
    total = hashlib.sha256(repr((sensor, depth, kinds)).encode())
    shapes = (scene.corners, scene.centres, scene.radii, scene.material, scene.emission)
    for array in (*shapes, table.roughness, table.colour, table.weight, table.eta):
        values = np.round(np.asarray(array, dtype=float), DIGITS) + 0.0
        total.update(repr(values.shape).encode() + values.tobytes())
    return total.hexdigest()[:16]
