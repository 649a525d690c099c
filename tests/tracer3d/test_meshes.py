"""Meshes: OBJ and PLY are read whole or refused by name, fronts stay outside, and only triangles with area count."""

import struct
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from restir_ref.batch import Array
from restir_ref.transport.scene import Facet, scene
from tracer3d import meshes
from tracer3d.meshes import FLAT, SPECK, Placement, load, placed, with_area
from tracer3d.scenes import grey, matte
from tracer3d.shapes import lamp
from tracer3d.space import SOLID
from tracer3d.tables import SMALLEST, number

pytest.importorskip("trimesh", reason="needs the extra `mesh`")

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
HEADER = (
    "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
    "element face {}\nproperty list uchar int vertex_indices\nend_header\n"
)


def obj(first: int = 1) -> bytes:
    """The cube; `first` is what its vertex 0 is called, 1, or -8 from the end."""
    rows = [f"v {x:g} {y:g} {z:g}" for x, y, z in CUBE]
    return "\n".join([*rows, *("f " + " ".join(str(k + first) for k in side) for side in SIDES)]).encode()


def ply() -> bytes:
    rows = [" ".join(map(str, row)) for row in [*CUBE.tolist(), *((4, *side) for side in SIDES)]]
    return (HEADER.format("ascii", 8, 6) + "\n".join(rows) + "\n").encode()


def binary(order: str) -> bytes:
    faces = b"".join(struct.pack(f"{order}B4i", 4, *side) for side in SIDES)
    name = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    return HEADER.format(name, 8, 6).encode() + CUBE.astype(f"{order}f4").tobytes() + faces


CUBES = {
    "obj": (".obj", obj()),
    "relative": (".obj", obj(-8)),
    "windows": (".OBJ", obj().replace(b"\n", b"\r\n")),
    "indented": (".obj", obj().replace(b"f ", b"  f\t").replace(b"v ", b" v ")),
    "commented": (".obj", b"mtllib x.mtl\n" + obj().replace(b"\n", b" # a remark\n")),
    "coloured": (".obj", obj().replace(b"\nf", b" 1 0.5 0\nf", 1)),
    "continued": (".obj", obj().replace(b"f 1 2", b"f 1 \\\n2")),
    "faces first": (".obj", b"\n".join(sorted(obj().split(b"\n"), key=lambda row: row[:1]))),
    "ply": (".ply", ply()),
    "little-endian ply": (".ply", binary("<")),
    "big-endian ply": (".ply", binary(">")),
}


def loaded(folder: Path, suffix: str, data: bytes) -> Array:
    path = folder / f"mesh{suffix}"
    path.write_bytes(data)
    return load(path)


def volume(corners: Array) -> float:
    """Signed by the side that is the front: positive if that is outside."""
    return float(np.linalg.det(corners).sum() / 6)


def area(corners: Array) -> float:
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(n, axis=1).sum() / 2)


@pytest.mark.parametrize("name", CUBES)
def test_every_way_to_write_a_cube_is_a_cube(tmp_path, name):
    corners = loaded(tmp_path, *CUBES[name])
    assert corners.shape == (12, 3, 3)
    assert volume(corners) == pytest.approx(1)
    assert area(corners) == pytest.approx(6)


def test_a_cube_without_a_side_or_inside_out_is_noticed(tmp_path):
    corners = loaded(tmp_path, *CUBES["obj"])
    assert area(corners[:-2]) == pytest.approx(5)
    assert volume(corners[:, ::-1]) == pytest.approx(-1)


def test_seams_normals_and_materials_of_an_obj_move_no_triangle(tmp_path):
    plain = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n"
    dressed = (
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\nusemtl a\nf 1/1/1 2/2/1 3/1/1\n"
        "usemtl b\nf 1/2/1 3/2/1 4/1/1\n"
    )
    found = [loaded(tmp_path, ".obj", text.encode()) for text in (plain, dressed)]
    assert (found[0] == found[1]).all()


def test_a_pentagon_is_a_fan(tmp_path):
    turn = 2 * np.pi * np.arange(5) / 5
    rows = [f"v {np.cos(t)} {np.sin(t)} 0" for t in turn]
    corners = loaded(tmp_path, ".obj", "\n".join([*rows, "f 1 2 3 4 5", "f 1 2 3"]).encode())
    assert len(corners) == 4
    assert area(corners[:3]) == pytest.approx(2.5 * np.sin(2 * np.pi / 5))


# ---------------------------------------------------------------- in its place

X = np.array([[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]])


@pytest.mark.parametrize(
    ("at", "wanted"),
    [
        (Placement(), X[0]),
        (Placement(units=0.01), 0.01 * X[0]),
        (Placement(scale=(2, 3, 4)), np.diag([2, 3, 4])),
        (Placement(rotate=(90, 0, 0)), [[1, 0, 0], [0, 0, 1], [0, -1, 0]]),
        (Placement(rotate=(0, 90, 0)), [[0, 0, -1], [0, 1, 0], [1, 0, 0]]),
        (Placement(rotate=(0, 0, 90)), [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
        (Placement(rotate=(90, 90, 0)), [[0, 0, -1], [1, 0, 0], [0, -1, 0]]),
        (Placement(0.5, (2, 1, 1), (0, 0, 90), (1, 2, 3)), [[1, 3, 3], [0.5, 2, 3], [1, 2, 3.5]]),
    ],
)
def test_axes_go_where_they_are_sent(at, wanted):
    assert placed(X, at)[0] == pytest.approx(np.array(wanted, dtype=float), abs=1e-12)


@pytest.mark.parametrize("size", [1e-12, 1.0, 1e6])
def test_whether_a_triangle_has_area_goes_by_its_shape_and_not_by_its_size_down_to_a_speck(size):
    height = size * np.array([2 * FLAT, 0.5 * FLAT, 1.0])
    thin = [[[0.0, 0, 0], [size, 0, 0], [0, h, 0]] for h in height]
    assert with_area(np.array(thin)).tolist() == [True, False, True]


def test_a_small_triangle_beside_a_large_one_has_an_area():
    corners = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    assert with_area(np.concatenate([1e-9 * corners, 1e9 * corners, 0 * corners])).tolist() == [True, True, False]


@pytest.mark.parametrize(("side", "found"), [(2 * SPECK, True), (0.5 * SPECK, False)])
def test_what_is_smaller_than_a_speck_has_no_area(side, found):
    assert with_area(side * np.array([[[0.0, 0, 0], [1, 0, 0], [0, 0, 0.7]]])).tolist() == [found]


@pytest.mark.parametrize("x", [0.5 * SMALLEST, SMALLEST, 2 * SMALLEST])
def test_corners_of_meshes_are_0_where_numbers_of_scene_files_are(x):
    assert (placed(np.full((1, 3, 3), x), Placement()) == number("").read(x)).all()


@pytest.mark.parametrize("scale", [(2, 1, 1), (-2, 1, 1), (1, -1, 3), (-1, -1, -1)])
def test_fronts_stay_outside_however_a_mesh_is_mirrored(tmp_path, scale):
    corners = loaded(tmp_path, *CUBES["obj"])
    assert volume(placed(corners, Placement(scale=scale, rotate=(10, 20, 30)))) == pytest.approx(abs(np.prod(scale)))
    assert volume(corners * scale) == pytest.approx(np.prod(scale))


# ---------------------------------------------------------------- no area


def test_triangles_in_a_line_or_a_place_have_no_area():
    a, b = np.zeros(3), np.array([1.0, 2.0, 3.0])
    flat = [(a, b, b), (a, a, a), (a, b, 2 * b), (a, b, 0.3 * b), (1e-20 * b, a, 1e-20 * b[::-1])]
    assert not with_area(np.array(flat)).any()


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_slivers_and_small_ones_have_one(size):
    sliver = size * np.array([[[0.0, 0, 0], [1, 0, 0], [0.5, 1e-6, 0]]])
    assert with_area(sliver).all()


@settings(max_examples=60)
@given(st.lists(st.floats(-1, 1), min_size=6, max_size=6), st.floats(0, 1), st.floats(-1e-7, 1e-7))
def test_what_has_an_area_can_be_compiled(ends, share, off):
    a, b = np.reshape(ends, (2, 3))
    corners = np.array([[a, b, a + share * (b - a) + off * np.roll(b - a, 1)]])
    for order in (0, 1, 2):
        if with_area(corners).all():
            facets = [Facet(np.roll(corners[0], order, axis=0).tolist()), *lamp((0, 0), (1, 1), 2, 1.0)]
            assert scene(SOLID, [matte(grey(0.5))], facets).S == 3


# ---------------------------------------------------------------- damage

V = "v 0 0 0\nv 1 0 0\nv 1 1 0\n"
P = "0 0 0\n1 0 0\n1 1 0\n"
DAMAGE = {
    "an empty file": (".obj", "", "it has no faces"),
    "points only": (".obj", V, "it has no faces"),
    "no OBJ at all": (".obj", "hello\nworld", "it has no faces"),
    "NaN": (".obj", "v 0 nan 0\n" + V + "f 1 2 3", "line 1: a vertex needs three finite numbers, but is '0 nan 0'"),
    "two coordinates": (".obj", V + "v 1 2\nf 1 2 3", "line 4: a vertex needs three finite numbers"),
    "a word for a number": (".obj", V + "v 1 x 0\nf 1 2 3", "line 4: a vertex needs three finite"),
    "an index out of range": (".obj", V + "f 1 2 4", "line 4: there is no vertex '4'; there are 3, counted from 1"),
    "an index of 0": (".obj", V + "f 0 1 2", "line 4: there is no vertex '0'"),
    "a relative index too far back": (".obj", V + "f -4 -2 -1", "line 4: there is no vertex '-4'"),
    "a broken index": (".obj", V + "f 1 2 1.5", "no vertex '1.5'"),
    "a face of two corners": (".obj", V + "f 1 2", "line 4: a face needs at least 3 corners, but has 2"),
    "far too large": (".obj", "v 1e30 0 0\n" + V + "f 1 2 3", "vertex 1 is [1e+30, 0.0, 0.0]; up to 1e+09"),
    "no PLY at all": (".ply", "hello", "its header has no end"),
    "a PLY without faces": (".ply", HEADER.format("ascii", 3, 0) + P, "names no vertices, or no faces"),
    "a PLY without vertices": (".ply", HEADER.format("ascii", 0, 1) + "3 0 1 2", "names no vertices, or no faces"),
    "a word in a PLY": (".ply", HEADER.format("ascii", 3, 1) + P + "3 0 x 2", "face 1 must be a count >= 3"),
    "text without a row": (".ply", HEADER.format("ascii", 3, 2) + P + "3 0 1 2\n", "promises 5 rows, but 4 follow"),
    "a promise of too much": (".ply", HEADER.format("ascii", 3, 10**12) + P, "promises 1000000000003 rows, but 19 by"),
    "a row cut off": (".ply", HEADER.format("ascii", 3, 1) + P + "3 0 1", "face 1 must be a count >= 3"),
    "a PLY index out of range": (".ply", HEADER.format("ascii", 3, 1) + P + "3 0 1 3", "of the 3 vertices, counted fr"),
    "a negative PLY index": (".ply", HEADER.format("ascii", 3, 1) + P + "3 0 1 -1", "but is '3 0 1 -1'"),
    "a NaN of a PLY": (
        ".ply",
        HEADER.format("ascii", 3, 1) + P.replace("1 1", "nan 1") + "3 0 1 2",
        "vertex 3 is [nan",
    ),
    "no list of corners": (
        ".ply",
        HEADER.format("ascii", 3, 1).replace("list uchar ", "") + P + "3 0 1 2",
        "it has no faces",
    ),
    "binary cut off": (".ply", binary("<")[:-5], "trimesh cannot read it (ValueError: PLY is unexpected length!)"),
    "a binary index out of range": (".ply", binary("<")[:-4] + b"\x09\0\0\0", "6 faces 12 triangles can be read, with"),
    "a binary index of no vertex": (".ply", binary("<")[:-4] + b"\xff\xff\xff\xff", "with corners -1 .. 7 of 8"),
    "another format": (".stl", "solid", "there is no mesh format '.stl': there are .obj, .ply"),
}


@pytest.mark.parametrize(("suffix", "data", "said"), DAMAGE.values(), ids=DAMAGE)
def test_damage_is_told(tmp_path, suffix, data, said):
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        loaded(tmp_path, suffix, data if isinstance(data, bytes) else data.encode())
    assert said in str(refused.value)


def test_the_largest_number_of_a_file_can_be_read(tmp_path):
    corners = loaded(tmp_path, ".obj", b"v 1e9 0 0\nv -1e9 0 0\nv 0 1e9 0\nf 1 2 3")
    assert np.abs(corners).max() == 1e9


def test_a_file_of_absurd_size_is_refused_unread_with_the_estimate(tmp_path):
    path = tmp_path / "big.obj"
    with path.open("wb") as file:
        file.truncate(2**30)  # a hole, which takes no room
    with pytest.raises(ValueError, match=r"1024 MiB, more than 100: .* 8.9 minutes and 24.0 GiB. Simplify the mesh"):
        load(path)


def test_a_file_that_is_not_there_is_an_error_of_the_system():
    with pytest.raises(FileNotFoundError, match=r"nowhere.obj"):
        load(Path("nowhere.obj"))


def test_without_trimesh_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(ValueError, match="install restir-ref with its extra 'mesh'"):
        loaded(tmp_path, *CUBES["obj"])


anything = settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
edits = st.lists(st.tuples(st.integers(0, 10**4), st.binary(max_size=3), st.integers(0, 9)), max_size=4)


@anything
@given(st.sampled_from([*CUBES.values()]), edits)
def test_no_bytes_of_a_mesh_end_in_anything_but_triangles_or_a_refusal(tmp_path, cube, edits):
    suffix, data = cube
    for place, new, gone in edits:
        at = place % (len(data) + 1)
        data = data[:at] + new + data[at + gone :]
    try:
        corners = loaded(tmp_path, suffix, data)
    except ValueError:
        return
    assert np.isfinite(corners).all()
    assert corners.shape[1:] == (3, 3)
    assert len(corners)


def test_a_face_that_trimesh_drops_is_noticed(tmp_path, monkeypatch):
    right = meshes._by_trimesh
    monkeypatch.setattr(meshes, "_by_trimesh", lambda *given: (right(*given)[0], right(*given)[1][1:]))
    with pytest.raises(ValueError, match=r"of its 6 faces 11 triangles can be read"):
        loaded(tmp_path, *CUBES["obj"])


def test_of_binary_faces_all_or_none_are_fans_of_as_many_triangles():
    head = b"ply\nformat binary_little_endian 1.0\nelement vertex 4\nelement face 2\nend_header"
    complete = meshes._ply(head + bytes(60)).complete
    assert [read for read in range(7) if complete(read)] == [2, 4, 6]
