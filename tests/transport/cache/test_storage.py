"""Laws of volumes as files: what is read is what was written, and of this scene."""

from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

import tracer3d.directions
from flatland2d.directions import MAPS, Bins
from flatland2d.probe_rooms import PROBE_ROOMS, lamp_beside_probe, open_room, probes
from restir_ref.transport.cache import storage
from restir_ref.transport.cache.storage import digest, load, save
from restir_ref.transport.cache.update import Updating, update
from restir_ref.transport.cache.volume import Weighting, unlit
from tests.transport.cache.worlds import live

SCENE = open_room().scene
VOLUME = update(unlit(SCENE, probes(open_room(), 4), MAPS), SCENE, Updating(), live(1))


def test_a_volume_comes_back_to_the_last_bit(tmp_path):
    save(VOLUME, SCENE, tmp_path / "v.npz")
    back = load(tmp_path / "v.npz", SCENE, MAPS)
    assert (back.grid, back.frames, back.maps) == (VOLUME.grid, 1, MAPS)
    for name in ("E", "r", "active"):
        np.testing.assert_array_equal(getattr(back, name), getattr(VOLUME, name))
    x = np.array([[0.3], [0.4]])
    np.testing.assert_array_equal(back.irradiance(x, x, x, x), VOLUME.irradiance(x, x, x, x))


def test_nothing_else_is_left_in_the_folder(tmp_path):
    for _ in range(2):
        save(VOLUME, SCENE, tmp_path / "v.npz")
    assert [path.name for path in tmp_path.iterdir()] == ["v.npz"]


def test_a_file_is_the_old_one_until_the_new_one_is_whole(tmp_path, monkeypatch):
    save(VOLUME, SCENE, tmp_path / "v.npz")

    def torn(file, **arrays):
        file.write(b"half")
        raise OSError("disk full")

    monkeypatch.setattr(storage.np, "savez", torn)
    with pytest.raises(OSError, match="disk full"):
        save(VOLUME, SCENE, tmp_path / "v.npz")
    assert [path.name for path in tmp_path.iterdir()] == ["v.npz"]
    assert load(tmp_path / "v.npz", SCENE, MAPS).frames == 1


def test_a_volume_of_another_scene_is_refused(tmp_path):
    save(VOLUME, SCENE, tmp_path / "v.npz")
    with pytest.raises(ValueError, match=r"v\.npz holds probes of another scene .*compute it again"):
        load(tmp_path / "v.npz", lamp_beside_probe().scene, MAPS)


def test_other_maps_are_refused(tmp_path):
    save(VOLUME, SCENE, tmp_path / "v.npz")
    for maps in (replace(MAPS, depth=Bins(32)), replace(MAPS, irradiance=Bins(16)), tracer3d.directions.MAPS):
        with pytest.raises(
            ValueError, match=r"shape \(1, 16, 32\) and \(2, 16, 64\), but .*maps that it was made with"
        ):
            load(tmp_path / "v.npz", SCENE, maps)


@pytest.mark.parametrize("content", [b"", b"no zip", b"PK\x03\x04 torn"])
def test_a_file_that_is_no_volume_is_named(tmp_path, content):
    (tmp_path / "v.npz").write_bytes(content)
    with pytest.raises(ValueError, match=r"v\.npz is no volume of probes: .*Compute it again"):
        load(tmp_path / "v.npz", SCENE, MAPS)


def test_an_archive_without_probes_is_named(tmp_path):
    np.savez(tmp_path / "v.npz", E=np.zeros(3))
    with pytest.raises(ValueError, match="is no volume of probes"):
        load(tmp_path / "v.npz", SCENE, MAPS)


# ---------------------------------------------------------------- digests


def parts(value, path=()):
    """Paths to the arrays and numbers of nested dataclasses."""
    for part in fields(value):
        if part.name in ("surfaces", "space"):
            continue
        held = getattr(value, part.name)
        if is_dataclass(held):
            yield from parts(held, (*path, part.name))
        else:
            yield (*path, part.name), held


def altered(value, path, held):
    """The dataclass with another number at the path."""
    name, *rest = path
    if rest:
        return replace(value, **{name: altered(getattr(value, name), rest, held)})
    other = (
        held + 1 if isinstance(held, int | float) else (*held, ()) if isinstance(held, tuple) else np.append(held, 0)
    )
    if isinstance(held, np.ndarray) and held.size:
        other = held.copy()
        other.flat[-1] += 1
    return replace(value, **{name: other})


def test_every_number_of_a_scene_is_in_its_digest():
    changed = {path: digest(altered(SCENE, path, held)) for path, held in parts(SCENE)}
    assert len(changed) > 15
    assert [path for path, found in changed.items() if found == digest(SCENE)] == []


def test_a_scene_made_twice_or_asked_in_another_way_is_the_same_scene():
    assert digest(SCENE) == digest(open_room().scene)
    assert len({digest(make().scene) for make in PROBE_ROOMS.values()}) == len(PROBE_ROOMS)


def test_weights_are_not_stored_but_given(tmp_path):
    save(VOLUME, SCENE, tmp_path / "v.npz")
    weighting = Weighting(crush=lambda weight: weight)
    assert load(tmp_path / "v.npz", SCENE, MAPS, weighting).weighting is weighting
    assert load(tmp_path / "v.npz", SCENE, MAPS).weighting == Weighting()
