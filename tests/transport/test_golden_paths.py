"""Golden vectors of paths: the files are what today's code gives, far from every boundary, and headers say the same."""

import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import flatland2d.golden as plane
import tracer3d.golden as solid
from flatland2d.space import PLANE
from restir_ref.transport.paths import trace
from restir_ref.transport.proofs.golden import differences, header, make, margins
from restir_ref.transport.proofs.golden.sketch import not_float32
from restir_ref.transport.proofs.golden.terms import Chosen, first_points, numbers, records
from tracer3d.space import SOLID

WORLDS = {"plane": (plane, PLANE), "space": (solid, SOLID)}


def shipped(world) -> dict:
    """The file of a world."""
    return json.loads(world.SHIPPED.read_text(encoding="utf-8"))


SCENES = [(name, k) for name, (world, _) in WORLDS.items() for k in range(len(world.SKETCHES))]
each_scene = pytest.mark.parametrize(("name", "k"), SCENES, ids=str)


@pytest.mark.parametrize("name", WORLDS)
def test_the_files_are_what_todays_code_gives(name):
    world, space = WORLDS[name]
    assert make.stale(world.SHIPPED, make.untolerant(world.SKETCHES, space)) == []


def test_a_file_with_one_other_number_is_stale(tmp_path):
    file = shipped(plane)
    file["scenes"][1]["expected"]["shifts"]["J"][3] *= 1 + 1e-6
    (tmp_path / "golden.json").write_text(make.text(file))
    fresh = json.loads(plane.SHIPPED.read_text())
    assert make.stale(tmp_path / "golden.json", fresh) == ["glossy.expected.shifts.J"]


def chosen_of(scene) -> Chosen:
    """The inputs of a scene; those without columns are numbers of pixels all the same."""
    given = {key: np.array(value) for key, value in scene["inputs"].items()}
    return Chosen(
        **{key: value if value.size or key == "dark_u" else value.astype(int) for key, value in given.items()}
    )


@each_scene
def test_all_inputs_are_the_same_in_float32(name, k):
    scene = shipped(WORLDS[name][0])["scenes"][k]
    assert not_float32({"scene": scene["scene"], "inputs": scene["inputs"]}) == []


def test_a_number_that_float32_does_not_have_is_named():
    assert not_float32({"eyes": [(0.5, 0.1)]}) == ["eyes[0][1] = 0.1"]


@each_scene
def test_every_choice_is_far_from_falling_the_other_way(name, k):
    world, space = WORLDS[name]
    t = world.SKETCHES[k].tracer(space)
    chosen = chosen_of(shipped(world)["scenes"][k])
    assert (make.margin_of_paths(t, chosen.u, chosen.pixel) > make.MARGIN).all()
    assert (make.margin_of_shifts(t, chosen) > make.MARGIN).all()
    assert (make.margin_of_darkness(t, chosen.dark_u, chosen.dark_pixel) > make.MARGIN).all()


@each_scene
def test_every_difference_is_of_its_sign_beyond_doubt(name, k):
    world, space = WORLDS[name]
    t = world.SKETCHES[k].tracer(space)
    chosen = chosen_of(shipped(world)["scenes"][k])
    x, own = records(t, chosen), chosen.pixel[chosen.path]
    assert (differences.margin_of_pairs(t, x, own, chosen.to) > make.MARGIN).all()
    assert (differences.margin_of_signs(t, x, own, chosen.differences) > make.MARGIN).all()


def test_a_difference_of_equal_paths_is_of_no_sign_and_that_of_no_light_cannot_be_wrong():
    light = np.array([2.0, 2.0, 0.0])
    assert differences.doubt(np.array([[0.0, -1.0, 0.0]]), light).tolist() == [0.0, 0.5, np.inf]


def test_a_path_that_reaches_its_last_vertex_does_not_go_dark():
    t = plane.SKETCHES[1].tracer(PLANE)
    given = shipped(plane)["scenes"][1]["inputs"]
    assert (make.margin_of_darkness(t, np.array(given["u"]), np.array(given["pixel"])) == 0).all()


@each_scene
def test_moving_every_ray_by_less_than_the_margin_meets_the_same_primitives(name, k):
    """A witness of the margins that asks only what rays meet."""
    world, space = WORLDS[name]
    t = world.SKETCHES[k].tracer(space)
    given = shipped(world)["scenes"][k]["inputs"]
    u, pixel = np.array(given["u"]), np.array(given["pixel"])
    tree = trace(t, u, pixel)
    x_0, rng = first_points(t, pixel), np.random.default_rng(1)
    for v in tree.x:
        w = v.x - x_0
        for _ in range(8):
            _, prim = t.scene.intersect(x_0, w + 1e-4 * np.abs(w).max() * rng.uniform(-1, 1, w.shape))
            assert (prim == v.prim).all()
        x_0 = v.x


def test_a_ray_past_an_edge_has_a_small_margin():
    t = plane.SKETCHES[0].tracer(PLANE)
    start, edge = np.array([[0.5625], [0.25]]), np.array([[0.5], [0.5]])  # the end of the screen
    far = start + (edge - start) / (edge - start)[1] * 0.75
    assert margins.of_rays(t.scene, start, far)[0] < 1e-9
    assert margins.of_rays(t.scene, start, start + np.array([[0.0], [0.1875]]))[0] > 0.1


@each_scene
def test_the_files_hold_shifts_of_every_sort(name, k):
    scene = shipped(WORLDS[name][0])["scenes"][k]
    shifts, given = scene["expected"]["shifts"], scene["inputs"]
    c = np.array(shifts["record"]["c"])
    assert {0} < set(c.tolist())
    assert {0, 1} == set(given["nee"])
    assert (np.array(scene["expected"]["mutations"]["T"]) > 0).any()
    assert len(set(scene["expected"]["pass"]["s"])) > 1


def by_light(scene) -> np.ndarray:
    """Which mutations move x_c where light sampling leaves it."""
    given, c = scene["inputs"], np.array(scene["expected"]["shifts"]["record"]["c"])
    k, nee = (np.array(given[name]) for name in ("k", "nee"))
    return ((nee == 1) & (c == k))[given["mutated"]]


@each_scene
def test_the_files_hold_mutations_where_light_sampling_leaves_x_c(name, k):
    scene = shipped(WORLDS[name][0])["scenes"][k]
    T, F = (np.array(scene["expected"]["mutations"][term]) for term in ("T", "F"))
    lit = by_light(scene)
    assert lit.any()
    assert (T[lit] == 1).all()
    assert F[:, lit].any() or name == "plane"


def test_some_mutation_moves_x_c_out_of_the_light_and_some_into_nothing():
    """The first are taken, the second are not."""
    found = [
        (by_light(s), s["expected"]["mutations"]) for world, _ in WORLDS.values() for s in shipped(world)["scenes"]
    ]
    assert any((lit & (np.array(m["T"]) == 1) & ~np.array(m["F"]).any(axis=0)).any() for lit, m in found)
    assert any((~lit & (np.array(m["T"]) == 0)).any() for lit, m in found)


@pytest.mark.parametrize(("name", "k"), [each for each in SCENES if each[1] > 0], ids=str)
def test_the_files_hold_paths_that_go_dark_at_several_vertices(name, k):
    scene = shipped(WORLDS[name][0])["scenes"][k]
    dark, depth = scene["expected"]["dark"], scene["scene"]["depth"]
    n = np.array(dark["vertices"])
    assert len(set(n.tolist())) > 1
    assert (n <= depth).all()
    assert not np.array(dark["F"])[2 * depth].any()


@pytest.mark.parametrize("name", WORLDS)
def test_the_files_hold_differences_of_every_sort(name):
    """Either sign chosen or null, from every input, with and without offset paths."""
    found = [scene["expected"]["differences"] for scene in shipped(WORLDS[name][0])["scenes"]]
    assert {s for each in found for row in each["s"] for s in row} == {0, 1, 2}
    assert any((np.array(each["J"]) == 0).any() for each in found)
    assert any(((np.array(each["J"]) > 0) & (np.array(each["J_offset"]) == 0)).any() for each in found)
    null = [(np.array(each["W_Y"]) == 0).any() for each in found]
    assert any(null) == (name == "plane")  # in colour both parts have a share of everything
    for each in found:
        assert np.array(each["difference"]) == pytest.approx(np.array(each["estimate"]).sum(axis=0))


def test_some_shift_is_undefined_in_each_world():
    for world, _ in WORLDS.values():
        assert any(0 in scene["expected"]["shifts"]["defined"] for scene in shipped(world)["scenes"])


# ---------------------------------------------------------------- tolerances


@each_scene
def test_tolerances_are_small(name, k):
    for kind, most in (("float32", 5e-3), ("float64", 1e-11)):
        assert max(shipped(WORLDS[name][0])["scenes"][k]["tolerance"][kind].values()) < most


def test_a_sketch_with_other_numbers_is_refused():
    odd = replace(plane.SKETCHES[0], eyes=[((0.5, 0.1), (0.25, 0.0))])
    with pytest.raises(ValueError, match=r"matte: float32 has no eyes\.start\[0\]\[1\] = 0\.1"):
        make.vectors([odd], PLANE)


# ---------------------------------------------------------------- headers


def read_header(text: str) -> dict[str, list[float]]:
    """The arrays of a header by a regular expression."""
    arrays = re.findall(r"static const \w+ (\w+)\[(\d+)\] = \{(.*?)\};", text, re.DOTALL)
    read = {name: [float(each.strip().rstrip("f")) for each in body.split(",")] for name, _, body in arrays}
    assert all(len(read[name]) == int(size) for name, size, _ in arrays)
    return read


@pytest.mark.parametrize("language", header.LANGUAGES)
@pytest.mark.parametrize("name", WORLDS)
def test_a_header_holds_the_numbers_of_the_file_in_float32(name, language):
    file = shipped(WORLDS[name][0])
    read = read_header(header.header(file, header.LANGUAGES[language], "G"))
    for scene in file["scenes"]:
        for where, values in numbers({key: scene[key] for key in ("inputs", "expected")}).items():
            if not values.size:
                continue  # neither language has empty arrays
            got = read[re.sub(r"\W+", "_", f"golden{file['d']}.{scene['name']}.{where}")]
            np.testing.assert_allclose(got, values.ravel(), rtol=1e-8, atol=0, err_msg=where)


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_a_compiler_takes_the_headers_of_both_worlds_together(tmp_path):
    for name, (world, _) in WORLDS.items():
        (tmp_path / f"{name}.h").write_text(header.header(shipped(world), header.c_array, f"G_{name}"))
    (tmp_path / "main.c").write_text(
        '#include "plane.h"\n#include "space.h"\n#include <stdio.h>\n'
        'int main(void) { printf("%d %.9g", golden2_matte_inputs_u_N, golden3_glossy_expected_shifts_J[2]); return 0; }'
    )
    subprocess.run(["cc", "-Wall", "-o", "main", "main.c"], cwd=tmp_path, check=True)
    n, J = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout.split()
    assert int(n) == np.size(shipped(plane)["scenes"][0]["inputs"]["u"])
    assert np.float32(J) == np.float32(shipped(solid)["scenes"][1]["expected"]["shifts"]["J"][2])


def test_what_is_no_file_of_golden_paths_has_no_header(tmp_path, capsys):
    (tmp_path / "other.json").write_text('{"format": "restir-ref dump"}')
    for path in (tmp_path / "other.json", tmp_path / "absent.json", Path(__file__)):
        assert header.main([str(path)]) == 2
    assert "'restir-ref dump'" in capsys.readouterr().err


def test_the_commands_check_and_write(tmp_path, capsys):
    written = tmp_path / "new" / "golden.json"
    assert make.main(plane.SKETCHES[:1], PLANE, written, ["--check"]) == 1
    assert "golden.json" in capsys.readouterr().out
    assert make.main(plane.SKETCHES[:1], PLANE, plane.SHIPPED, [str(written)]) == 0
    assert make.main(plane.SKETCHES[:1], PLANE, written, ["--check"]) == 0
    assert json.loads(written.read_text())["scenes"] == shipped(plane)["scenes"][:1]
