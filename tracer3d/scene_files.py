"""Scenes from TOML files: camera, materials, meshes, spheres, triangles, rectangles and lights.

`tracer3d/examples/vase.toml` shows every table and key.  What is wrong in a file is named with its place in it.
"""

import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from hashlib import file_digest, sha256
from inspect import getdoc
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.materials import Layer, Material, check
from restir_ref.transport.scene import Ball, Facet, Scene, scene
from tracer3d import meshes, scene_keys
from tracer3d.names import known
from tracer3d.scenes import SCENES, Setting, setting
from tracer3d.space import SOLID
from tracer3d.tables import LARGEST, at, fields

SUFFIX = ".toml"

PARALLEL = 1e-6
"""A rectangle's third corner may be off by this share of its size; it is put where it belongs."""

MOST = 500_000
"""Triangles of a scene."""

SECONDS, BYTES = 1.8e-7, 1500
"""What compiling S triangles takes, in all times S^1.5 and each, as measured with up to 80 000."""


@dataclass(frozen=True, eq=False)
class Opened:
    """A scene, what it is in words, and what was left out of it."""

    title: str
    setting: Setting
    notes: Sequence[str] = ()


@cache
def opened(name: str, content: str | None) -> Opened:
    """The scene of that name, or of a file whose name ends in .toml and whose `digest` is `content`.

    Raises ValueError for an unknown name, a file that has changed, and whatever is wrong in it; OSError for one that
    cannot be read.
    """
    if not name.endswith(SUFFIX):
        make = known(SCENES, name, "scene (a file ends in .toml)" if "." in name else "scene")
        return Opened((getdoc(make) or "").splitlines()[0], setting(name))
    found = read(Path(name))
    if digest(name) != content:
        raise ValueError(f"{name}, or a mesh of it, has changed since the command began: say it again.")
    return found


def digest(name: str) -> str | None:
    """16 hex digits of a scene file and the meshes that it names; None for a scene that is no file."""
    if not name.endswith(SUFFIX):
        return None
    path = Path(name)
    found = sha256(path.read_bytes())
    rows = _parsed(path).get("mesh")
    for row in rows if isinstance(rows, list) else []:
        file = row.get("file") if isinstance(row, dict) else None
        if isinstance(file, str) and file.isprintable() and (path.parent / file).is_file():
            with (path.parent / file).open("rb") as mesh:
                found.update(file_digest(mesh, "sha256").digest())
    return found.hexdigest()[:16]


def read(path: Path) -> Opened:
    """The scene of a file.  Raises as `opened` does."""
    table = fields(_parsed(path), scene_keys.FILE, str(path))
    camera = fields(table["camera"], scene_keys.CAMERA, f"{path}, [camera]")
    materials = {name: _material(each, f"{path}, [material.{name}]") for name, each in table["material"].items()}
    parts = [*_parts(table, [*materials], path)]
    facets = [facet for part in parts for facet in part.facets]
    balls = [ball for part in parts for ball in part.balls]
    built = at(str(path), scene, SOLID, [*materials.values()], facets, balls)
    there = at(f"{path}, [camera]", _setting, built, camera, table["depth"])
    title = table["title"] or f"{len(facets)} triangles, {len(balls)} spheres"
    return Opened(title, there, [note for part in parts for note in part.notes])


def _parsed(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path} is no TOML: {error}.") from error


def _setting(built: Scene, c: Mapping[str, Any], depth: int) -> Setting:
    """What a camera sees of a scene; its crop is on the film."""
    half = float(np.tan(np.radians(c["field_of_view"] / 2)))
    there = Setting(built, c["position"], c["target"], c["crop"], depth, half, c["up"], c["motion"])
    there.pinhole()
    return there


# ---------------------------------------------------------------- materials


def _material(table: Any, where: str) -> Material:
    """Lobes over an index of refraction; they are chosen by their mean colours unless weights are given."""
    m = fields(table, scene_keys.MATERIAL, where)
    layers = [_layer(lobe, f"{where}, lobe {k}") for k, lobe in enumerate(m["lobes"], 1)]
    made = Material(layers, m["eta"])
    at(where, check, made, 3)
    return made


def _layer(lobe: Mapping[str, Any], where: str) -> Layer:
    kind = lobe.get("kind")
    keys = at(where, known, scene_keys.LOBE, kind, "kind of lobe") if isinstance(kind, str) else scene_keys.ROUGH
    l = fields(lobe, keys, where)
    weight = l["weight"] or float(np.mean(l["colour"])) or 1.0
    return Layer(l["kind"], l["colour"], l.get("roughness", 1.0), weight)


# ---------------------------------------------------------------- shapes


@dataclass(frozen=True)
class Part:
    """What one table of a shape has given."""

    facets: Sequence[Facet] = ()
    balls: Sequence[Ball] = ()
    notes: Sequence[str] = ()


def _parts(table: Mapping[str, Any], materials: Sequence[str], path: Path) -> Iterator[Part]:
    """Every table of every shape, in the order of SHAPES.  Raises ValueError for too many triangles."""
    total, numbered = 0, {name: k for k, name in enumerate(materials)}
    for shape, build in SHAPES.items():
        for k, row in enumerate(table[shape], 1):
            where = f"{path}, [[{shape}]] number {k}"
            values = fields(row, scene_keys.SHAPES[shape], where)
            material = at(where, known, numbered, values["material"], "material")
            part = at(where, build, values, material, path.parent)
            total += len(part.facets)
            at(where, _check_count, total)
            yield part


def _check_count(triangles: int) -> None:
    """Raise ValueError, with time and memory that it would take, for more triangles than a scene may have."""
    if triangles > MOST:
        raise ValueError(
            f"with it the scene has {triangles} triangles, more than {MOST}: only to compile it would take about "
            f"{SECONDS * triangles**1.5 / 60:.1f} minutes and {BYTES * triangles / 2**30:.1f} GiB. Simplify the mesh."
        )


def _mesh(row: Mapping[str, Any], material: int, folder: Path) -> Part:
    """A file's triangles where they belong, without those that have no area."""
    path = folder / row["file"]
    try:
        corners = at(str(path), meshes.load, path)
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}.") from error
    _check_count(len(corners))
    corners = meshes.placed(corners, meshes.Placement(row["units"], row["scale"], row["rotate"], row["translate"]))
    if not np.abs(corners).max() <= LARGEST:
        raise ValueError(f"{path} reaches out to {np.abs(corners).max():g}: say smaller units or scale.")
    seen = meshes.with_area(corners)
    if not seen.any():
        raise ValueError(f"none of the {len(seen)} triangles of {path} has an area.")
    lost = f"{(~seen).sum()} of the {len(seen)} triangles of {path} have no area and are left out."
    return Part(_facets(corners[seen], material, row["emission"]), notes=[] if seen.all() else [lost])


def _polygon(row: Mapping[str, Any], material: int, folder: Path) -> Part:
    """A triangle, or two that make a rectangle or parallelogram; they may shine."""
    corners = np.array(row["corners"])
    if len(corners) == 4:
        a, b, c, d = corners
        if not np.abs(b + d - a - c).max() <= PARALLEL * np.ptp(corners, axis=0).max():
            raise ValueError("the four corners must go round a rectangle or parallelogram, but do not.")
        corners = np.array([[a, b, b + d - a], [a, b + d - a, d]])
    corners = corners.reshape(-1, 3, 3)
    if not meshes.with_area(corners).all():
        raise ValueError("it has no area: its corners are in one line or place.")
    return Part(_facets(corners, material, row.get("emission", ())))


def _sphere(row: Mapping[str, Any], material: int, folder: Path) -> Part:
    return Part(balls=[Ball(row["centre"], row["radius"], material)])


def _facets(corners: Array, material: int, emission: Sequence[float]) -> list[Facet]:
    return [Facet(three, material, emission) for three in corners.tolist()]


SHAPES: Mapping[str, Callable[[Mapping[str, Any], int, Path], Part]] = MappingProxyType(
    {"mesh": _mesh, "sphere": _sphere, "triangle": _polygon, "rectangle": _polygon, "light": _polygon}
)
