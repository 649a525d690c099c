"""Pictures do not depend on how many columns are looked at together, and memory does not grow with them."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from restir_ref import windows
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.loop import OFFLINE, REAL_TIME, Preset, frame
from restir_ref.restir import shade
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.windows import windowed
from tests.core.test_windows import OfItsOwn
from tests.tracer3d.views import tracer
from tracer3d import methods
from tracer3d.methods import METHODS, Shot, around
from tracer3d.render import Job

PRESETS = {"real time": REAL_TIME, "offline": replace(OFFLINE, trees=2, rounds=1)}
SIDE = 20
WHOLE = SIDE**2


def images(preset: Preset, window: int, moving: float = 0.0, method: str = "restir-pt") -> bytes:
    """Two frames of a scene with rough and smooth lobes."""
    job = Job("glossy_cornell", method, size=(SIDE, SIDE), crop=(928, 668), moving=moving, depth=2)
    shots = (Shot(job.tracer(k, job.compiled()), Live(np.random.default_rng(k)), window) for k in range(2))
    return b"".join(image.tobytes() for image in METHODS[method].frames(shots, preset, (SIDE, SIDE)))


@pytest.mark.parametrize("moving", [0.0, 1.0], ids=["still", "moving"])
@pytest.mark.parametrize("preset", PRESETS)
def test_pictures_are_the_same_bytes_in_windows_of_any_size(preset, moving):
    whole = images(PRESETS[preset], WHOLE, moving)
    assert all(images(PRESETS[preset], size, moving) == whole for size in (60, 150))


@pytest.mark.parametrize("method", ["path-reuse", "restir-di", "restir-gi"])
def test_so_are_those_of_every_method_that_holds_frames(method):
    assert images(REAL_TIME, 100, 1.0, method) == images(REAL_TIME, WHOLE, 1.0, method)


def test_paths_are_the_same_bytes_in_blocks_of_any_size(monkeypatch):
    whole = images(REAL_TIME, WHOLE, method="path")
    monkeypatch.setattr(methods, "BLOCK", 60)
    assert images(REAL_TIME, WHOLE, method="path") == whole


def test_a_window_with_random_numbers_of_its_own_is_noticed(monkeypatch):
    whole = images(REAL_TIME, WHOLE)
    monkeypatch.setattr(windows, "Columns", OfItsOwn)
    assert images(REAL_TIME, 200) != whole


# ---------------------------------------------------------------- memory


def peak(preset: Preset, size: int, window: int) -> int:
    """The most bytes that a frame of size x size pixels holds at once, reservoirs and image included."""
    here = Pixels(PathIntegrals(tracer("crease", size=size)), np.arange(size**2))
    tracemalloc.start()
    try:
        X = frame(here, Live(np.random.default_rng(1)), preset, around(preset)((size, size)), passes=windowed(window))
        shade(X, here)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def held(size: int) -> int:
    """Bytes of the reservoirs of a frame."""
    here = Pixels(PathIntegrals(tracer("crease", size=size)), np.arange(size**2))
    X = windowed(64).initial(here, Live(np.random.default_rng(1)))
    leaves: list[Array] = [*vars(X.x).values(), X.W, X.c]
    return sum(leaf.nbytes for leaf in leaves)


def growth(preset: Preset, window: int | None = None) -> float:
    """Bytes for every further pixel, in reservoirs."""
    small, large = 16, 32
    more = peak(preset, large, window or large**2) - peak(preset, small, window or small**2)
    return more / (held(large) - held(small))


@pytest.mark.parametrize("preset", PRESETS)
def test_beside_a_window_a_frame_holds_its_reservoirs_old_and_new_and_little_else(preset):
    assert growth(PRESETS[preset], window=128) < 4


@pytest.mark.parametrize("preset", PRESETS)
def test_a_whole_frame_at_once_holds_many_times_as_much(preset):
    assert growth(PRESETS[preset]) > 8
