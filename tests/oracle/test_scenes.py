"""The oracle's scenes are those that its numbers elsewhere were found on, cell by cell."""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.oracle.cells import Cells, cells
from restir_ref.oracle.scenes import (
    normalised,
    paired,
    random_scene,
    reference_scene,
    three_pixel_scene,
    two_technique_scene,
)

NAMES = ("v", "f", "p_hat", "pdf", "shifts", "proposal")
SCENES = {
    "reference": reference_scene().now.cells,
    "three pixels": three_pixel_scene().now.cells,
    "two techniques": two_technique_scene().now.cells,
}
SUMS: dict[str, dict[str, tuple[float, ...]]] = {
    "reference": {
        "v": (4, 4, 52.153724427),
        "f": (4, 4, 76.088549098),
        "p_hat": (4, 4, 74.674335536),
        "pdf": (1, 4, 4, 12.286496073),
        "shifts": (4, 4, 4, 317.908890032),
        "proposal": (4, 4, 11.898075556),
    },
    "three pixels": {
        "v": (3, 3, 22.903079964),
        "f": (3, 3, 30.945428559),
        "p_hat": (3, 3, 30.945428559),
        "pdf": (1, 3, 3, 7.428653209),
        "shifts": (3, 3, 3, 63.346465252),
    },
    "two techniques": {
        "v": (2, 3, 12.493514009),
        "f": (2, 3, 17.467890794),
        "p_hat": (2, 3, 17.467890794),
        "pdf": (2, 2, 3, 10.924967384),
        "shifts": (2, 2, 3, 15.663721105),
    },
}


def weighed(table: Array) -> tuple[float, ...]:
    """The size of a table and a sum in which every entry has its own weight."""
    return (*table.shape, round(float(table.ravel() @ np.sqrt(np.arange(2, table.size + 2))), 9))


def sums(cells: Cells) -> dict[str, tuple[float, ...]]:
    tables = {name: getattr(cells, name) for name in NAMES}
    return {name: weighed(table) for name, table in tables.items() if table is not None}


every_scene = pytest.mark.parametrize("name", SCENES)


@every_scene
def test_a_scene_is_the_one_that_was_measured(name) -> None:
    assert sums(SCENES[name]) == SUMS[name]


@every_scene
@pytest.mark.parametrize("table", NAMES[:5])
def test_a_scene_with_two_cells_swapped_is_another(name, table) -> None:
    old = getattr(SCENES[name], table)
    flat = old.ravel().copy()
    k = int(np.flatnonzero(flat[1:] != flat[:-1])[0])
    flat[[k, k + 1]] = flat[[k + 1, k]]
    assert sums(replace(SCENES[name], **{table: flat.reshape(old.shape)})) != SUMS[name]


def test_frames_of_a_scene_are_numbered_and_share_its_tables() -> None:
    for scene, frames, n in ((reference_scene(), 2, 2), (three_pixel_scene(), 1, 3), (two_technique_scene(), 1, 2)):
        assert [(each.t, each.n) for each in scene.frames] == [(t, n) for t in range(frames)]
        assert scene.now is scene.frames[-1]
        rows = slice((frames - 1) * n, frames * n)
        assert scene.v.tolist() == scene.now.cells.v[rows].tolist()
        assert scene.p_hat.tolist() == scene.now.cells.p_hat[rows].tolist()
        assert scene.support.tolist() == (scene.now.cells.p_hat[rows] > 0).tolist()


def test_normalised_densities_are_in_proportion_to_their_weights_and_integrate_to_1() -> None:
    assert normalised([[1, 3, 0]], [[2, 1, 5]]).tolist() == [[[0.2, 0.6, 0.0]]]


def test_shifts_have_their_inverses_and_leave_a_pixel_in_its_place() -> None:
    shifts = paired(2, 3, {(0, 1): (2, -1, 0)})
    assert shifts.tolist() == [[[0, 1, 2], [2, -1, 0]], [[2, -1, 0], [0, 1, 2]]]
    assert paired(3, 2, {})[0, 2].tolist() == [-1, -1]


# ---------------------------------------------------------------- random scenes


def drawn(count: int = 300) -> list[Cells]:
    rng = np.random.default_rng(5)
    return [random_scene(two_technique_scene(), rng=rng).now.cells for _ in range(count)]


def test_random_scenes_have_the_shares_of_zeros_holes_and_volumes_that_they_name() -> None:
    """Of 1800 targets, 3600 densities and 900 images; cells with light for certain are a third of either."""
    many = drawn()
    f, pdf = np.concatenate([each.f for each in many]), np.concatenate([each.pdf for each in many])
    v, holes = np.concatenate([each.v for each in many]), np.concatenate([each.shifts[0, 1] < 0 for each in many])
    assert np.unique(v).tolist() == [0.25, 0.5, 1.0, 2.0]
    assert np.unique(f).tolist() == [0.0, 0.5, 1.0, 3.0]
    assert (f == 0).mean() == pytest.approx(2 / 3 / 4, abs=0.04)
    assert (pdf == 0).mean() == pytest.approx(2 / 3 / 7, abs=0.02)
    assert holes.mean() == pytest.approx(1 / 3, abs=0.05)


def test_random_scenes_light_a_cell_of_every_pixel_that_all_techniques_reach() -> None:
    assert all(((each.f == 1) & (each.pdf > 0).all(axis=0)).any(axis=1).all() for each in drawn())


def test_random_scenes_are_of_the_size_of_their_model() -> None:
    rng = np.random.default_rng(1)
    for like in (reference_scene(), three_pixel_scene(), two_technique_scene()):
        found = random_scene(like, rng=rng)
        assert [(each.t, each.n) for each in found.frames] == [(each.t, each.n) for each in like.frames]
        assert found.now.cells.pdf.shape == like.now.cells.pdf.shape
        assert (found.now.cells.proposal == 1 / like.v.shape[1]).all()


def test_densities_of_random_scenes_are_as_one_two_and_four() -> None:
    for each in drawn(50):
        for row in each.pdf.reshape(-1, each.pdf.shape[-1]):
            shares = row[row > 0] / row.max()
            assert (np.isclose(shares[:, None], [0.25, 0.5, 1]).any(axis=1)).all()


@pytest.mark.parametrize(("name", "what"), [("v", "volume v"), ("pdf", "density pdf"), ("f", "integrand f")])
def test_a_negative_table_is_refused_by_its_name(name, what) -> None:
    of = reference_scene().now.cells
    tables = {each: getattr(of, each).copy() for each in ("v", "f", "pdf", "shifts")}
    tables[name][(0,) * tables[name].ndim] = -1
    with pytest.raises(ValueError, match=rf"the {what}.*Columns here are cells"):
        cells(**tables)
