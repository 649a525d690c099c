"""Meshes from OBJ and PLY files, as triangles that are put in their place.

The optional package trimesh reads them, and lets much pass: rows that are cut off, indices that point nowhere, indented
lines.  So a file is looked through first, and what trimesh made of it is counted.
"""

import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from itertools import takewhile
from pathlib import Path
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array
from tracer3d.names import known
from tracer3d.sensors import Point
from tracer3d.tables import LARGEST, SMALLEST

FLAT, SPECK = 1e-9, 1e-15
"""Twice the area of a triangle over its longest side squared, and that side, below which it has none."""


MOST = 100 * 2**20
"""Bytes of a file."""

READING, HOLDING = 5e-7, 24
"""Seconds and bytes of memory for each byte of an OBJ, as measured with 330 000 triangles; PLY needs less."""


@dataclass(frozen=True)
class Placement:
    """x -> R_z R_y R_x diag(scale) units x + translate, with turns about the axes, `rotate` degrees each."""

    units: float = 1.0
    scale: Point = (1.0, 1.0, 1.0)
    rotate: Point = (0.0, 0.0, 0.0)
    translate: Point = (0.0, 0.0, 0.0)


def placed(corners: Array, at: Placement) -> Array:
    """Triangles (T, 3, 3), corner by corner, in their place; where the scale mirrors them, fronts stay outside."""
    S = at.units * np.diag(at.scale)
    x, y, z = (_turn(axis, degrees) for axis, degrees in enumerate(at.rotate))
    moved = corners @ (z @ y @ x @ S).T + at.translate
    moved = np.where(np.abs(moved) > SMALLEST, moved, 0.0)
    return moved[:, ::-1] if np.prod(np.sign(at.scale)) < 0 else moved


def _turn(axis: int, degrees: float) -> Array:
    """The rotation about an axis of space, counterclockwise seen from its tip."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.roll([[1, 0, 0], [0, c, -s], [0, s, c]], (axis, axis), (0, 1))


def with_area(corners: Array) -> Array:
    """Which triangles (T, 3, 3) have an area that can be told from 0, (T,)."""
    sides = corners - np.roll(corners, 1, axis=1)
    longest2 = (sides**2).sum(axis=2).max(axis=1)
    n = np.cross(sides[:, 1], sides[:, 2])
    return np.asarray((np.linalg.norm(n, axis=1) > FLAT * longest2) & (longest2 > SPECK**2))


def load(path: Path) -> Array:
    """The triangles (T, 3, 3) of a file, corner by corner, T > 0; faces with more corners become fans.

    Raises OSError, and ValueError for what is no mesh, in part or whole, and where trimesh is missing.
    """
    kind = path.suffix.lower()
    prepare, size = known(FORMATS, kind, "mesh format"), path.stat().st_size
    if size > MOST:
        raise ValueError(
            f"it has {size / 2**20:.0f} MiB, more than {MOST / 2**20:.0f}: only to read it could take "
            f"{READING * size / 60:.1f} minutes and {HOLDING * size / 2**30:.1f} GiB. Simplify the mesh."
        )
    ready = prepare(path.read_bytes())
    vertices, faces = _by_trimesh(ready.data, kind)
    if not len(faces):
        raise ValueError("it has no faces; points and lines cannot be seen.")
    bad = np.flatnonzero(~(np.abs(vertices) <= LARGEST).all(axis=1))
    if bad.size:
        raise ValueError(f"vertex {bad[0] + 1} is {vertices[bad[0]].tolist()}; up to {LARGEST:g} is possible.")
    if not ready.complete(len(faces)) or faces.min() < 0 or faces.max() >= len(vertices):
        raise ValueError(
            f"of its {ready.faces} faces {len(faces)} triangles can be read, with corners {faces.min()} .. "
            f"{faces.max()} of {len(vertices)}: it is cut off, or has binary faces of unequal sizes; write it as text."
        )
    return np.asarray(vertices[faces], dtype=float)


def _by_trimesh(data: bytes, kind: str) -> tuple[Array, Array]:
    """Vertices (V, 3) and faces (T, 3)."""
    try:
        from trimesh import load_mesh  # noqa: PLC0415
    except ImportError:
        raise ValueError("meshes need the package trimesh: install restir-ref with its extra 'mesh'.") from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            warnings.filterwarnings("error", message="string or file could not be read")
            mesh = load_mesh(BytesIO(data), file_type=kind[1:], process=False, skip_materials=True, fix_texture=False)
            vertices, faces = np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.int64)
    except Exception as error:  # of any kind: trimesh meets damage where it happens to
        raise ValueError(f"trimesh cannot read it ({type(error).__name__}: {str(error)[:120]}).") from error
    return vertices.reshape(-1, 3), faces.reshape(-1, 3)


@dataclass(frozen=True)
class Ready:
    """What trimesh is given, the faces it should find, and whether so many triangles are all of theirs."""

    data: bytes
    faces: int
    complete: Callable[[int], bool]


# ---------------------------------------------------------------- OBJ


def _obj(data: bytes) -> Ready:
    """An OBJ's vertices and faces and nothing else, faces by absolute numbers."""
    rows = [*_rows(data.decode("utf-8", "replace").replace("\r\n", "\n").replace("\\\n", " ").split("\n"))]
    total, before = sum(words[0] == "v" for _, words in rows), 0
    plain, triangles = [], 0
    for line, (kind, *words) in rows:
        if kind == "v":
            before += 1
            plain.append(" ".join(["v", *_vertex(line, words)]))
        else:
            numbers = [_corner(line, word, before, total) for word in words]
            if len(numbers) < 3:
                raise ValueError(f"line {line}: a face needs at least 3 corners, but has {len(numbers)}.")
            triangles += len(numbers) - 2
            plain.append(" ".join(["f", *map(str, numbers)]))
    return Ready("\n".join(plain).encode(), len(rows) - total, lambda read: read == triangles)


def _rows(lines: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Number and words of every line of a vertex or face, without comments."""
    for number, line in enumerate(lines, 1):
        words = line.partition("#")[0].split()
        if words and words[0] in ("v", "f"):
            yield number, words


def _vertex(line: int, words: list[str]) -> list[str]:
    """Three finite numbers; colours may follow."""
    try:
        finite = len(words) >= 3 and bool(np.isfinite([float(word) for word in words[:3]]).all())
    except ValueError:
        finite = False
    if not finite:
        raise ValueError(f"line {line}: a vertex needs three finite numbers, but is {' '.join(words)[:60]!r}.")
    return [repr(float(word)) for word in words[:3]]


def _corner(line: int, word: str, before: int, total: int) -> int:
    """The number of a vertex, counted from 1; -1 is the last one before the face."""
    index = word.partition("/")[0]
    number = int(index) if re.fullmatch(r"-?[0-9]{1,18}", index) else 0
    number = before + 1 + number if number < 0 else number
    if not 1 <= number <= total:
        raise ValueError(f"line {line}: there is no vertex {word[:40]!r}; there are {total}, counted from 1.")
    return number


# ---------------------------------------------------------------- PLY


def _ply(data: bytes) -> Ready:
    """A PLY as it is.  Rows of text are looked at one by one; binary faces have equally many corners or are refused."""
    head, end, body = data.partition(b"end_header")
    if not end:
        raise ValueError("its header has no end.")
    counts = {name.decode(): int(count) for name, count in ELEMENT.findall(head)}
    if not counts.get("vertex") or not counts.get("face"):
        raise ValueError("its header names no vertices, or no faces.")
    if sum(counts.values()) > len(body):
        raise ValueError(
            f"its header promises {sum(counts.values())} rows, but {len(body)} bytes follow: it is cut off."
        )
    faces = counts["face"]
    if not re.search(rb"^format +ascii", head, re.MULTILINE):
        return Ready(data, faces, lambda read: read >= faces and read % faces == 0)
    triangles = _triangles_in(body.decode("utf-8", "replace").splitlines()[1:], counts)
    return Ready(data, faces, lambda read: read == triangles)


ELEMENT = re.compile(rb"^element +([a-z]+) +([0-9]{1,15})\s*$", re.MULTILINE)


def _triangles_in(rows: list[str], counts: Mapping[str, int]) -> int:
    """How many triangles make up the faces, each a row with a count, and so many corners."""
    if len(rows) < sum(counts.values()):
        raise ValueError(f"its header promises {sum(counts.values())} rows, but {len(rows)} follow: it is cut off.")
    first = sum(counts[name] for name in takewhile("face".__ne__, counts))
    triangles = 0
    for k, row in enumerate(rows[first : first + counts["face"]], 1):
        n, *corners = [int(word) if re.fullmatch("[0-9]{1,18}", word) else -1 for word in row.split()] or [0]
        if not 3 <= n <= len(corners) or not all(0 <= corner < counts["vertex"] for corner in corners[:n]):
            raise ValueError(
                f"face {k} must be a count >= 3 and so many of the {counts['vertex']} vertices, counted from 0, but is "
                f"{row[:60]!r}."
            )
        triangles += n - 2
    return triangles


FORMATS: Mapping[str, Callable[[bytes], Ready]] = MappingProxyType({".obj": _obj, ".ply": _ply})
