"""Scene files: they say what scenes of the house say, and every mistake in one is named with its place."""

import copy
import re
import tomllib
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tracer3d import cli, scene_files, scene_keys
from tracer3d.render import Job
from tracer3d.scene_files import digest, opened, read
from tracer3d.scenes import SCENES, Setting
from tracer3d.sensors import FILM

EXAMPLE = Path(scene_files.__file__).parent / "examples" / "vase.toml"
needs_trimesh = pytest.mark.skipif(find_spec("trimesh") is None, reason="needs the extra `mesh`")

ROOM = """
depth = 2
[camera]
position = [0.5, 0.5, 2]
target = [0.5, 0.4, 0]
field_of_view = 60
[material.grey]
lobes = [{ kind = "lambert", colour = 0.5 }]
[material.glossy]
lobes = [{ kind = "lambert", colour = 0.4 }, { kind = "ggx", colour = 0.5, roughness = 0.3 }]
[[sphere]]
centre = [0.5, 0.3, 0.5]
radius = 0.2
material = "glossy"
[[triangle]]
corners = [[0, 0, 0], [1, 0, 0], [0.5, 1, 0]]
material = "grey"
[[rectangle]]
corners = [[0, 0, 1], [1, 0, 1], [1, 0, 0], [0, 0, 0]]
material = "grey"
[[light]]
corners = [[0.3, 1, 0.3], [0.7, 1, 0.3], [0.7, 1, 0.7], [0.3, 1, 0.7]]
emission = 9
material = "grey"
"""
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
MESH = '[[mesh]]\nfile = "a.obj"\nmaterial = "grey"\nunits = 0.2\n'
SMALL = ["--size", "8x8", "--method", "path"]


def written(folder: Path, text: str, mesh: str | None = TETRAHEDRON) -> Path:
    path = folder / "my.toml"
    path.write_text(text, encoding="utf-8")
    if mesh is not None:
        (folder / "a.obj").write_text(mesh, encoding="utf-8")
    return path


def run(*words) -> int:
    return cli.main([str(word) for word in words])


# ---------------------------------------------------------------- what a file says


def toml(at: Setting) -> str:
    """A scene of the house as a file: its facets as triangles and lights, in their order."""
    s, m = at.scene, at.scene.materials
    half = 2 * np.degrees(np.arctan(at.half))
    rows = [f"depth = {at.depth}", "[camera]", f"position = {[*at.eye]}", f"target = {[*at.towards]}"]
    rows += [f"up = {[*at.up]}", f"crop = {[*at.crop]}", f"field_of_view = {half!r}"]
    kinds = [*scene_keys.LOBE]
    for k in range(len(m.roughest)):
        rows += [f"[material.m{k}]", f"eta = {m.eta[2 * k * m.L + 1]!r}", "lobes = ["]
        for row in range(k * m.L, (k + 1) * m.L):
            rough = f"roughness = {m.roughness[row]!r}, " if kinds[m.kind[row]] == "ggx" else ""
            colour, weight = m.colour[:, row].tolist(), m.weight[row % m.L, k]
            lobe = f'kind = "{kinds[m.kind[row]]}", {rough}colour = {colour}, weight = {weight!r}'
            rows += [f"{{ {lobe} }},"] if weight else []
        rows += ["]"]
    for corners, light, k in zip(np.moveaxis(s.corners, -1, 0), s.emission.T, s.material, strict=False):
        rows += ["[[light]]", f"emission = {light.tolist()}"] if light.any() else ["[[triangle]]"]
        rows += [f"corners = {corners.tolist()}", f'material = "m{k}"']
    for centre, (radius,), k in zip(s.centres.T, s.radii, s.material[s.S :], strict=True):
        rows += ["[[sphere]]", f"centre = {centre.tolist()}", f"radius = {radius}", f'material = "m{k}"']
    return re.sub(r"np\.float64\(([^)]*)\)", r"\1", "\n".join(rows))


def told_apart(a: Setting, b: Setting) -> list[str]:
    """What two settings differ in, with facets in any order."""
    pairs = {name: (getattr(a, name), getattr(b, name)) for name in ("eye", "towards", "up", "half", "depth", "crop")}
    for name in ("kind", "roughness", "colour", "weight", "eta"):
        pairs[name] = getattr(a.scene.materials, name), getattr(b.scene.materials, name)
    pairs["facets"] = facets(a), facets(b)
    pairs["balls"] = (a.scene.centres, b.scene.centres)
    pairs["radii"] = (a.scene.radii, b.scene.radii)
    return [name for name, (one, other) in pairs.items() if not np.allclose(one, other, rtol=1e-12, atol=0)]


def facets(at: Setting) -> list[list[float]]:
    s = at.scene
    rows = np.concatenate([s.corners.reshape(9, -1), s.emission[:, : s.S], s.material[None, : s.S]])
    return sorted(rows.T.tolist())


@pytest.mark.parametrize("name", ["cornell", "matte_cornell", "glass_ball", "ajar_ceiling"])
def test_a_file_says_all_that_a_scene_of_the_house_is(tmp_path, name):
    right = SCENES[name]()
    text = toml(right)
    assert told_apart(read(written(tmp_path, text)).setting, right) == []
    dimmer = re.sub(r"emission = \[[\d.]+", "emission = [3.25", text, count=1)
    assert told_apart(read(written(tmp_path, dimmer)).setting, right) == ["facets"]


def test_what_is_left_out_has_the_values_that_the_example_names(tmp_path):
    at = read(written(tmp_path, ROOM.replace("depth = 2\n", ""))).setting
    assert (at.depth, at.up, at.pace, at.crop) == (4, (0, 1, 0), (2.5, 0.5), (928, 508))
    assert at.half == pytest.approx(np.tan(np.radians(30)))
    assert at.scene.materials.weight[:, 1] == pytest.approx([4 / 9, 5 / 9])


def test_a_camera_slides_as_its_file_says(tmp_path):
    at = read(written(tmp_path, ROOM.replace("field", "motion = [7, -3]\nfield"))).setting
    target = np.array([at.towards]).T
    moved = at.at(1).pinhole().project(target) - at.pinhole().project(target)
    assert moved[:, 0] == pytest.approx([-7, -3], abs=1e-6)


def test_a_rectangle_is_two_triangles_with_its_corners_round_its_front(tmp_path):
    s = read(written(tmp_path, ROOM)).setting.scene
    floor = np.moveaxis(s.corners, -1, 0)[1:3]
    assert {tuple(corner) for corner in floor.reshape(-1, 3)} == {(0, 0, 1), (1, 0, 1), (1, 0, 0), (0, 0, 0)}
    assert s.normals[:, 1:3].T.tolist() == [[0, 1, 0]] * 2
    moved = read(written(tmp_path, ROOM.replace("[[0, 0, 1], [1, 0, 1]", "[[0.1, 0, 1], [1.1, 0, 1]"))).setting.scene
    assert np.moveaxis(moved.corners, -1, 0)[1].tolist() == [[0.1, 0, 1], [1.1, 0, 1], [1, 0, 0]]


def test_a_black_material_is_one(tmp_path):
    s = read(written(tmp_path, ROOM.replace("colour = 0.5 }]", "colour = 0 }]"))).setting.scene
    assert s.materials.colour[:, 0].tolist() == [0, 0, 0]
    assert s.materials.weight[:, 0].tolist() == [1, 0]


@needs_trimesh
def test_a_mesh_stands_where_it_is_put_and_shines_if_told(tmp_path):
    text = ROOM + MESH + "rotate = [0, 0, 90]\ntranslate = [0.5, 0.6, 0.5]\nemission = [1, 2, 3]\n"
    s = read(written(tmp_path, text)).setting.scene
    last = np.moveaxis(s.corners, -1, 0)[:4]  # meshes come first
    assert last.reshape(-1, 3).min(axis=0) == pytest.approx([0.3, 0.6, 0.5])
    assert last.reshape(-1, 3).max(axis=0) == pytest.approx([0.5, 0.8, 0.7])
    assert s.emission[:, :4].T.tolist() == [[1, 2, 3]] * 4


# ---------------------------------------------------------------- the example


def unshown(text: str) -> set[str]:
    """Keys and kinds of lobes that the example does not name."""
    keys = [scene_keys.FILE, scene_keys.CAMERA, scene_keys.MATERIAL, scene_keys.ROUGH, *scene_keys.SHAPES.values()]
    words = {word for family in keys for word in family} | set(scene_keys.LOBE)
    return {word for word in words if not re.search(rf"(^|[\"\[{{,#] ?){word}\b", text, re.MULTILINE)}


def test_the_example_shows_every_key():
    text = EXAMPLE.read_text(encoding="utf-8")
    assert unshown(text) == set()
    assert unshown(text.replace("translate =", "").replace('"mirror"', "")) == {"translate", "mirror"}


@needs_trimesh
def test_the_example_is_seen_and_its_mesh_is_closed_but_for_its_mouth():
    found = opened(str(EXAMPLE), digest(str(EXAMPLE)))
    assert found.notes == []
    s = found.setting.scene
    vase = np.moveaxis(s.corners, -1, 0)[s.material[: s.S] == 2]
    assert np.linalg.det(vase - [[-0.12, 0, -0.05]]).sum() > 0
    assert len(vase) == 304


# ---------------------------------------------------------------- mistakes

MISTAKES = {
    "a key misspelt": ("radius", "raduis", "[[sphere]] number 1: there is no key 'raduis': did you mean 'radius'?"),
    "a table misspelt": ("[[sphere]]", "[[spheer]]", "my.toml: there is no key 'spheer': did you mean 'sphere'?"),
    "a key of the camera misspelt": ("target", "tarjet", "[camera]: there is no key 'tarjet': did you mean 'target'?"),
    "a missing key": ("radius = 0.2", "", "[[sphere]] number 1: the key 'radius' is missing; it must be a positive n"),
    "no camera": ("[camera]", "[material.camera]", "my.toml: the key 'camera' is missing"),
    "one bracket": ("[[sphere]]", "[sphere]", "my.toml: sphere must be tables, each under a line with its name"),
    "two brackets": ("[camera]", "[[camera]]", "my.toml: camera must be a table of keys, but is [{"),
    "no TOML": ("depth = 2", "depth = ", "my.toml is no TOML: Invalid value (at line 2, column 9)"),
    "words for a number": ("radius = 0.2", 'radius = "big"', "radius must be a positive number, but is 'big'"),
    "a truth for a number": ("depth = 2", "depth = true", "depth must be a whole number from 1 to 100, but is True"),
    "a depth of 0": ("depth = 2", "depth = 0", "depth must be a whole number from 1 to 100, but is 0"),
    "a broken depth": ("depth = 2", "depth = 2.0", "depth must be a whole number from 1 to 100, but is 2.0"),
    "NaN": ("radius = 0.2", "radius = nan", "radius must be a positive number, but is nan"),
    "NaN in a corner": ("[0.5, 1, 0]]", "[nan, 1, 0]]", "[[triangle]] number 1: corners must be three corners of thr"),
    "infinity": ("emission = 9", "emission = inf", "[[light]] number 1: emission must be a number >= 0, or three of t"),
    "a huge integer": ("radius = 0.2", "radius = 1" + 400 * "0", "radius must be a positive number, but is 1000"),
    "a negative radius": ("radius = 0.2", "radius = -0.2", "radius must be a positive number, but is -0.2"),
    "two numbers for three": ("[0.5, 0.3, 0.5]", "[0.5, 0.3]", "centre must be three numbers, but is [0.5, 0.3]"),
    "an unknown material": ('"glossy"', '"glosy"', "number 1: there is no material 'glosy': did you mean 'glossy'?"),
    "an unknown lobe": ('"ggx"', '"gxx"', "[material.glossy], lobe 2: there is no kind of lobe 'gxx': did you mea"),
    "no kind": ('kind = "ggx", ', "", "[material.glossy], lobe 2: the key 'kind' is missing"),
    "a kind of numbers": ('"ggx"', "3", "[material.glossy], lobe 2: kind must be words in quotes, on one line"),
    "no lobe": ('[{ kind = "lambert", colour = 0.5 }]', "[]", "[material.grey]: "),
    "roughness of a matte lobe": ("colour = 0.4", "colour = 0.4, roughness = 1", "lobe 1: there is no key 'roughness'"),
    "roughness 0": ("roughness = 0.3", "roughness = 0", "roughness must be a perceptual roughness from 0.001 to 1 (0"),
    "roughness above 1": ("roughness = 0.3", "roughness = 1.5", "lobe 2: roughness must be a perceptual roughness"),
    "a colour above 1": ("colour = 0.4", "colour = 1.4", "colour must be a number from 0 to 1, or three of them, but"),
    "colours above 1 in sum": ("colour = 0.4", "colour = 0.6", "[material.glossy]: the colours of "),
    "a triangle without area": ("[0.5, 1, 0]]", "[0.5, 0, 0]]", "[[triangle]] number 1: it has no area: its corners"),
    "a crooked rectangle": ("[0, 0, 0]]", "[0, 0, 0.1]]", "[[rectangle]] number 1: the four corners must go round"),
    "a bent rectangle": ("[0, 0, 0]]", "[0, 0.1, 0]]", "[[rectangle]] number 1: the four corners must go round"),
    "no light": ("emission = 9", "emission = 0", "my.toml: the scene has no light"),
    "a camera along its up": ("up = ", "up = ", "[camera]: the pinhole looks along its own up"),
    "a camera in the dark": ("[0.5, 0.4, 0]", "[0.5, 0.4, 4]", "[camera]: "),
    "a crop off the film": ("field", "crop = [1900, 3]\nfield", "[camera]: a crop needs columns of the film"),
    "a crop nowhere near": ("field", "crop = [5000, 3]\nfield", "[camera]: crop must be a column and a row of"),
    "a view of 180 degrees": ("= 60", "= 180", "field_of_view must be an angle from 0.01 to 179 degrees, but is 180"),
    "two lines of title": ("depth", 'title = "a\\nb"\ndepth', "title must be words in quotes, on one line, but is"),
    "an odd file of a mesh": ("[[light]]", MESH.replace("a.obj", "a.stl") + "[[light]]", "there is no mesh format '"),
    "a missing mesh": ("[[light]]", MESH.replace("a.", "b.") + "[[light]]", "b.obj cannot be read: No such file"),
    "a number for a file": ("[[light]]", MESH.replace('"a.obj"', "3") + "[[light]]", "[[mesh]] number 1: file must be"),
    "a scale of 0": ("[[light]]", MESH + "scale = [1, 0, 1]\n[[light]]", "[[mesh]] number 1: scale must be a number o"),
}  # fmt: skip


@needs_trimesh
@pytest.mark.parametrize(("old", "new", "said"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_named_with_its_place_and_nothing_is_written(tmp_path, capsys, old, new, said):
    text = ROOM.replace("field", "up = [0, 0.2, 4]\nfield") if old == "up = " else ROOM
    assert old in text
    path = written(tmp_path, text.replace(old, new, 1))
    assert run("render", path, *SMALL, "--out", tmp_path / "p.png") == 2
    assert said in capsys.readouterr().err
    assert {each.suffix for each in tmp_path.iterdir()} == {".toml", ".obj"}


def test_without_mistakes_there_is_a_picture(tmp_path):
    assert run("render", written(tmp_path, ROOM), *SMALL, "--frames", 1, "--out", tmp_path / "p.png") == 0


def test_the_second_of_two_tables_is_named_as_such(tmp_path):
    with pytest.raises(ValueError, match=r"my.toml, \[\[sphere\]\] number 2: there is no key 'colour'"):
        read(written(tmp_path, ROOM + '[[sphere]]\ncentre = [0, 0, 0]\nradius = 1\ncolour = 1\nmaterial = "grey"'))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("my.tom", "there is no scene (a file ends in .toml) 'my.tom': there are cornell"),
        ("nowhere.toml", "No such file or directory: 'nowhere.toml'"),
    ],
)
def test_what_is_no_scene_file_is_refused(capsys, name, said):
    for command in ("render", "list", "compare"):
        assert run(command, name) == 2
        assert said in capsys.readouterr().err


# ---------------------------------------------------------------- meshes that are odd


@needs_trimesh
def test_triangles_without_area_are_left_out_with_a_count(tmp_path, capsys):
    path = written(tmp_path, ROOM + MESH, TETRAHEDRON + "f 1 1 2\nf 3 3 3\n")
    assert run("render", path, *SMALL, "--frames", 1, "--out", tmp_path / "p.png") == 0
    assert (
        f"note: 2 of the 6 triangles of {tmp_path / 'a.obj'} have no area and are left out." in capsys.readouterr().err
    )
    assert read(path).setting.scene.S == 4 + 5
    assert read(written(tmp_path, ROOM + MESH)).notes == []


@needs_trimesh
@pytest.mark.parametrize(
    ("mesh", "more", "said"),
    [
        (TETRAHEDRON[:32] + "f 1 1 2\nf 3 3 3\n", "", "none of the 2 triangles of "),
        ("", "", "a.obj: it has no faces"),
        (TETRAHEDRON, "translate = [1e9, 0, 0]\n", "a.obj reaches out to 1e+09: say smaller units or scale"),
        (TETRAHEDRON.replace("f 1 3 2", "f 1 3 9"), "", "a.obj: line 5: there is no vertex '9'; there are 4"),
    ],
)
def test_a_mesh_that_cannot_be_used_is_named_with_its_place(tmp_path, mesh, more, said):
    with pytest.raises(ValueError, match=r"my.toml, \[\[mesh\]\] number 1: ") as refused:
        read(written(tmp_path, ROOM + MESH + more, mesh))
    assert said in str(refused.value)


@needs_trimesh
def test_a_mesh_of_absurd_size_is_refused_with_the_time_it_would_take(tmp_path, monkeypatch):
    monkeypatch.setattr(scene_files, "MOST", 8)
    path = written(tmp_path, ROOM + MESH)
    with pytest.raises(
        ValueError, match=r"number 1: with it the scene has 9 triangles, more than 8.* 0.0 minutes and 0.0 GiB"
    ):
        read(path)
    monkeypatch.setattr(scene_files, "MOST", 9)
    assert read(path).setting.scene.S == 9


# ---------------------------------------------------------------- going on


@needs_trimesh
@pytest.mark.parametrize("changed", ["my.toml", "a.obj"])
def test_a_run_goes_on_only_while_its_files_stay_what_they_are(tmp_path, capsys, changed):
    path = written(tmp_path, ROOM + MESH)
    command = ["render", path, *SMALL, "--out", tmp_path / "p.png", "--frames"]
    assert run(*command, 1) == run(*command, 2) == 0
    touched = tmp_path / changed
    touched.write_text(touched.read_text(encoding="utf-8") + "# a remark\n", encoding="utf-8")
    before = (tmp_path / "p.npz").read_bytes()
    assert run(*command, 3) == 2
    assert "(the scene file or a mesh of it has changed): say another --out, or --anew" in capsys.readouterr().err
    assert (tmp_path / "p.npz").read_bytes() == before
    assert run(*command, 3, "--anew") == 0


def test_a_file_that_changes_while_it_is_read_is_refused(tmp_path):
    path = written(tmp_path, ROOM)
    with pytest.raises(ValueError, match="has changed since the command began"):
        Job(str(path), "path", content="0123")


def test_a_job_keeps_the_scene_that_it_began_with(tmp_path):
    job = Job(str(written(tmp_path, ROOM)), "path")
    first = job.setting(0)
    written(tmp_path, ROOM.replace("depth = 2", "depth = 3"))
    assert replace(job, seed=2).setting(0) is first
    assert Job(job.scene, "path").setting(0).depth == 3


def test_list_and_compare_know_files(tmp_path, capsys):
    path = written(tmp_path, 'title = "A room"' + ROOM)
    assert run("list", path) == 0
    said = capsys.readouterr().out
    assert "A room" in said
    assert "5 triangles (2 shine), 1 spheres, 2 materials" in said
    assert "seen from (0.5, 0.5, 2.0) towards (0.5, 0.4, 0.0), depth 2, inset at (928, 508)" in said
    out = tmp_path / "c.png"
    assert run("compare", path, "--rays", 20, "--trees", 2, "--size", "8x8", "--crop", "--out", out) == 0
    assert out.exists()


# ---------------------------------------------------------------- any bytes

anything = settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
words = st.text(alphabet='ab0.-="#[]{}, \n\0é\u2028', max_size=20)
numbers = st.one_of(st.integers(), st.floats(), st.sampled_from([0, 0.5, 1, -1, 1e-9, 1e9, 1e-160, 1e160]))
values = st.recursive(
    st.one_of(numbers, st.booleans(), words, st.dates()),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(words, inner, max_size=2)),
    max_leaves=6,
)


@anything
@given(st.one_of(st.binary(max_size=40), words.map(str.encode)), st.integers(0, len(ROOM)))
def test_no_bytes_of_a_scene_file_end_in_a_traceback(tmp_path, new, place):
    path = tmp_path / "my.toml"
    path.write_bytes(ROOM[:place].encode() + new + ROOM[place + len(new) :].encode())
    told(path)


def told(path: Path) -> None:
    """A scene, or a refusal that names the file."""
    try:
        found = read(path)
    except ValueError as refusal:
        said = str(refusal)
    else:
        said, film = f"{path} is a scene", found.setting.pinhole().film
        assert film == FILM
    assert said.startswith(str(path))


def places(value, at=()):
    """Where something could be replaced, and by which numbers."""
    yield at
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in inner:
        yield from places(part, (*at, key))


GIVEN = tomllib.loads(ROOM)
PLACES = [at for at in places(GIVEN) if at]


@anything
@given(st.sampled_from(PLACES), st.one_of(numbers, values))
def test_no_value_of_any_key_ends_in_a_traceback(tmp_path, at, value):
    changed = copy.deepcopy(GIVEN)
    inner = changed
    for key in at[:-1]:
        inner = inner[key]
    inner[at[-1]] = value
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scene_files, "_parsed", lambda path: changed)
        told(tmp_path / "my.toml")


def test_brackets_in_brackets_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"my.toml is no TOML"):
        read(written(tmp_path, "a = " + 5000 * "["))


@pytest.mark.parametrize("kind", ["COLOUR", "EMISSION", "SCALE"])
def test_one_number_stands_for_three_equal_ones(kind):
    read = getattr(scene_keys, kind).read
    for x in (0.25, 1):
        assert read(x) == read([x, x, x]) == (x, x, x)
    with pytest.raises((TypeError, ValueError)):
        read([0.25, 0.25])


@needs_trimesh
def test_a_mesh_of_too_many_triangles_is_refused_before_one_of_them_is_placed(tmp_path, monkeypatch):
    monkeypatch.setattr(scene_files, "MOST", 3)
    monkeypatch.setattr(scene_files.meshes, "placed", lambda *_: pytest.fail("placed"))
    with pytest.raises(ValueError, match="4 triangles, more than 3"):
        read(written(tmp_path, ROOM + MESH))


@pytest.mark.parametrize("shape", ["mesh", "sphere"])
def test_an_empty_list_of_a_shape_is_as_good_as_none(tmp_path, shape):
    none = ROOM.partition("[[sphere]]")[0] + "[[triangle]]" + ROOM.partition("[[triangle]]")[2]
    assert "sphere" not in none
    empty = read(written(tmp_path, f"{shape} = []\n{none}")).setting.scene
    assert (empty.corners == read(written(tmp_path, none)).setting.scene.corners).all()
    assert empty.radii.size == 0
