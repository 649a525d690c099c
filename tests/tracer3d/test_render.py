"""Pictures: every method has the mean of path tracing, an ended run goes on where it was, files hold what they say."""

from collections import Counter
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from matplotlib.image import imread

from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.restir import initial
from restir_ref.transport.counting import counted
from restir_ref.transport.restir_pt import PathIntegrals
from tests.tracer3d.views import mean_and_error
from tracer3d import compare, files
from tracer3d.methods import METHODS, PRESETS, Memory, Shot, recalled, traced
from tracer3d.motion import motion
from tracer3d.render import Job, Picture, blank, render

SMALL = Job("matte_cornell", "path", size=(8, 8), crop=(928, 668), depth=3)


def chances(seed: int):
    return lambda frame: Live(np.random.default_rng((seed, frame)))


def pictures(job: Job, frames: int, begun: Picture | None = None, seed: int = 1) -> list[Picture]:
    """After every frame."""
    return list(render(job, chances(seed), frames, begun or blank(job), job.setting(0).scene))


def image_means(job: Job, chains: int, frames: int) -> np.ndarray:
    """Mean light of the pictures of independent runs, (chains,)."""
    return np.array([pictures(job, frames, seed=k)[-1].mean.mean() for k in range(chains)])


LARGER = replace(SMALL, size=(20, 20))


@cache
def path_traced() -> np.ndarray:
    """Means of 16 independent images by path tracing, of 8 trees per pixel."""
    t = LARGER.tracer(0, LARGER.setting(0).scene)
    L = traced(t, np.tile(np.arange(t.sensor.n), 128), Live(np.random.default_rng(9)))
    return np.asarray(L.mean(axis=0).reshape(16, -1).mean(axis=1))


def change(method: str, wrong: float = 1.0) -> tuple[float, float]:
    """z of a method's mean against path tracing, and its standard error relative to it."""
    found, truth = wrong * image_means(replace(LARGER, method=method), 6, 2), path_traced()
    (a, error_a), (b, error_b) = mean_and_error(found), mean_and_error(truth)
    error = np.hypot(error_a, error_b)
    return (a - b) / error, error / b


@pytest.mark.parametrize("method", [name for name in METHODS if name != "path"])
def test_every_method_has_the_mean_of_path_tracing_where_all_is_matte(method):
    z, error = change(method)
    assert error < 0.03
    assert abs(z) < 4


def test_a_method_that_loses_a_fifth_of_the_light_is_noticed():
    z, _ = change("restir-pt", wrong=0.8)
    assert z < -8


def test_pictures_of_a_still_camera_are_means_and_of_a_moving_one_last_frames():
    still, moving = (pictures(replace(SMALL, moving=way), 3) for way in (0.0, 1.0))
    assert not np.allclose(still[-1].mean, still[0].mean)
    last = pictures(replace(SMALL, moving=1.0), 3, Picture(np.ones((3, 8, 8)), 2))
    assert np.allclose(moving[-1].mean, last[-1].mean)
    assert len(last) == 1


def test_an_ended_run_goes_on_to_the_same_bytes():
    whole, ended = pictures(SMALL, 4)[-1], pictures(SMALL, 2)[-1]
    assert (pictures(SMALL, 4, ended)[-1].sum == whole.sum).all()
    assert not (pictures(SMALL, 4, ended, seed=2)[-1].sum == whole.sum).all()


def test_offline_frames_know_nothing_of_each_other(monkeypatch):
    cheaper = {name: replace(preset, trees=2, neighbours=1, radius=2) for name, preset in PRESETS.items()}
    monkeypatch.setattr("tracer3d.render.PRESETS", cheaper)
    job = replace(SMALL, method="restir-pt", preset="offline", size=(4, 4))
    ended = pictures(job, 1)[-1]
    assert (pictures(job, 2, ended)[-1].sum == pictures(job, 2)[-1].sum).all()
    realtime = replace(job, preset="realtime")
    assert (pictures(realtime, 2, pictures(realtime, 1)[-1])[-1].sum != pictures(realtime, 2)[-1].sum).any()


def test_history_comes_from_where_the_previous_camera_saw_the_point():
    now, before = (Shot(replace(SMALL, moving=1.0).tracer(k, SMALL.setting(0).scene), chances(1)(k)) for k in (4, 0))
    here = Pixels(PathIntegrals(before.tracer), before.pixels)
    _, found = recalled(Memory(before, here, initial(here, before.chance)), now)
    m = motion(now.tracer.scene, now.tracer.sensor, before.tracer.sensor)
    assert (found[0].index == m.source).all()
    assert (found[0].index != now.pixels).any()
    assert recalled(None, now) == (None, [])


# ---------------------------------------------------------------- files

L = np.random.default_rng(1).random((3, 4, 6)).astype(np.float32).astype(float)


@pytest.mark.parametrize("channels", [1, 3])
def test_a_pfm_is_read_as_it_was_written(tmp_path, channels):
    files.write_pfm(tmp_path / "a.pfm", L[:channels])
    assert (files.read_pfm(tmp_path / "a.pfm") == L[:channels]).all()
    assert (files.read_pfm(tmp_path / "a.pfm") != L[:channels, ::-1]).any()


def test_a_pfm_begins_with_the_bottom_row_in_little_endian(tmp_path):
    files.write_pfm(tmp_path / "a.pfm", L)
    data = (tmp_path / "a.pfm").read_bytes()
    assert data.startswith(b"PF\n6 4\n-1.0\n")
    assert np.frombuffer(data[12:24], "<f4") == pytest.approx(L[:, -1, 0])


@pytest.mark.parametrize(
    ("data", "said"),
    [(b"P6\n1 1\n255\n...", "no PFM picture"), (b"PF", "no PFM"), (b"PF\n2 2\n-1.0\n123", "holds 3 bytes")],
)
def test_what_is_no_pfm_is_refused_by_name(tmp_path, data, said):
    (tmp_path / "b.pfm").write_bytes(data)
    with pytest.raises(ValueError, match=rf"b.pfm.*{said}"):
        files.read_pfm(tmp_path / "b.pfm")


def test_tones_are_the_standard_s_and_clipped():
    assert files.tone(np.array([0.0, 0.5, 1.0, 9.0]), 1.0) == pytest.approx([0, 0.7354, 1, 1], abs=1e-4)
    assert files.tone(np.array(0.002), 1.0) == pytest.approx(12.92 * 0.002)
    assert files.exposure(np.zeros(4)) == 1
    assert files.exposure(np.array([0.0, 2.0])) == pytest.approx(0.4)


def test_white_is_white_and_grey_pictures_have_equal_channels(tmp_path):
    files.write_shown(tmp_path / "w.png", np.array([[[1.0, 0.5]]]))
    assert imread(tmp_path / "w.png")[0, :, :3] == pytest.approx(np.array([[1.0] * 3, [128 / 255] * 3]))


def test_a_saved_run_is_loaded_and_other_settings_are_refused(tmp_path):
    out, picture = tmp_path / "deep" / "p.png", pictures(SMALL, 2)[-1]
    files.save(out, SMALL, picture)
    found = files.load(out, SMALL)
    assert found is not None
    assert (found.sum == picture.sum).all()
    assert found.frames == 2
    assert {path.suffix for path in out.parent.iterdir()} == {".png", ".pfm", ".npz"}
    with pytest.raises(ValueError, match=r"other settings \(depth 3 -> 2, seed 1 -> 7\): say another --out, or --anew"):
        files.load(out, replace(SMALL, depth=2, seed=7))
    assert files.load(tmp_path / "none.png", SMALL) is None


# ---------------------------------------------------------------- budgets


def test_a_budget_of_rays_is_spent_and_not_by_more_than_a_frame():
    *_, before, last = compare.spend(SMALL, compare.Budget(rays=100), chances(1))
    assert before.rays < 100 <= last.rays
    asked = Counter[str]()
    scene = counted(SMALL.setting(0).scene, asked)
    list(render(SMALL, chances(1), last.picture.frames, blank(SMALL), scene))
    assert sum(asked.values()) == last.rays * 64


def test_a_budget_of_time_is_spent_by_the_clock_that_is_given():
    ticks = iter(range(100))
    rows = list(compare.spend(SMALL, compare.Budget(seconds=5), chances(1), lambda: next(ticks)))
    assert [row.seconds for row in rows] == [1, 2, 3, 4, 5]


def test_errors_are_those_of_channel_means():
    R = np.stack([np.full((2, 2), c) for c in (0.5, 1.0, 1.5)])
    found = compare.errors(1.1 * R, R)
    assert found["RMSE"] == pytest.approx(0.1)
    assert found["MAPE"] == pytest.approx(0.1 / 1.01)
    assert compare.errors(R[::-1], R)["RMSE"] == 0


def test_path_reuse_is_asked_for_whole_tiles_of_4_by_4_pixels_one_after_the_other(monkeypatch):
    tiles = []

    def path_reuse(t, pixel, chance, K):
        tiles.extend(pixel.reshape(-1, K))
        return np.zeros((t.scene.C, len(pixel)))

    monkeypatch.setattr("tracer3d.methods.path_reuse", path_reuse)
    pictures(replace(SMALL, method="path-reuse", size=(12, 8)), 1)
    found = np.array(tiles)
    row, column = found // 12, found % 12
    assert np.array_equal(np.sort(found.ravel()), np.arange(96))
    assert (np.ptp(row, axis=1) == 3).all()
    assert (np.ptp(column, axis=1) == 3).all()
    assert (row.min(axis=1) % 4 == 0).all()
    assert (column.min(axis=1) % 4 == 0).all()
