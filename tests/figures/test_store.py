"""Laws of stored arrays: bytes depend on contents alone, nothing is pickled, no half file is ever seen."""

import os
import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra import numpy as hnp

from figures.claims.errors import FigureError
from figures.engine import disk, store

ARRAYS = {"b": np.arange(6.0).reshape(2, 3).T, "a": np.array("text"), "none": np.zeros((0, 2))}
KEY = store.canonical({"figure": "DEMO-F01", "seed": 1})


def saved(folder, arrays=ARRAYS, key=KEY, name="x.npz"):
    path = folder / name
    store.save(path, arrays, key)
    return path


@given(hnp.arrays(hnp.scalar_dtypes(), hnp.array_shapes(min_dims=0, min_side=0)))
def test_what_is_saved_is_loaded(tmp_path_factory, array):
    found = store.load(saved(tmp_path_factory.mktemp("store"), {"x": array}), KEY)
    assert found.state == "ours"
    assert found.arrays["x"].dtype == array.dtype
    assert found.arrays["x"].tobytes() == array.tobytes()


def test_numpy_reads_the_files_without_pickle(tmp_path):
    with np.load(saved(tmp_path), allow_pickle=False) as found:
        assert sorted(found) == ["__key__", "a", "b", "none"]
        assert np.array_equal(found["b"], ARRAYS["b"])


def test_bytes_depend_on_contents_alone(tmp_path, monkeypatch):
    first = saved(tmp_path).read_bytes()
    monkeypatch.setattr("time.time", lambda: 2e9)
    backwards = dict(reversed(ARRAYS.items()))
    assert saved(tmp_path, backwards, name="y.npz").read_bytes() == first


def test_other_contents_have_other_bytes(tmp_path):
    assert saved(tmp_path).read_bytes() != saved(tmp_path, key="{}", name="y.npz").read_bytes()


@pytest.mark.parametrize("array", [np.array([{}]), np.array([(1, None)], dtype="f8,O"), [1, "a", None]])
def test_python_objects_are_refused(array):
    with pytest.raises(TypeError, match="'x' holds Python objects"):
        store.plain({"x": array})


@pytest.mark.parametrize("name", ["", "__key__", "a/b"])
def test_a_name_that_cannot_be_stored_is_refused(name):
    with pytest.raises(ValueError, match="cannot be the name"):
        store.plain({name: 1})


def test_a_chunk_that_is_no_dict_is_refused():
    with pytest.raises(TypeError, match="expected a dict of arrays"):
        store.plain([1, 2])


@pytest.mark.parametrize("data", [float("nan"), {1, 2}, np.float64(1).reshape(1), object()])
def test_a_key_is_plain_data(data):
    with pytest.raises((TypeError, ValueError)):
        store.canonical({"x": data})


# ---------------------------------------------------------------- files that are not sound


def test_nothing_is_absent(tmp_path):
    assert store.load(tmp_path / "x.npz", KEY).state == "absent"


@pytest.mark.parametrize("length", [0, 1, 30, 200, 700])
def test_a_truncated_file_is_damaged(tmp_path, length):
    path = saved(tmp_path)
    path.write_bytes(path.read_bytes()[:length])
    assert store.load(path, KEY).state == "damaged"


def test_every_flipped_byte_is_harmless_or_noticed(tmp_path):
    path = saved(tmp_path, {"x": np.arange(3.0)})
    whole = path.read_bytes()
    for place in range(len(whole)):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x11]) + whole[place + 1 :])
        found = store.load(path, KEY)
        same = list(found.arrays) == ["x"] and np.array_equal(found.arrays["x"], np.arange(3.0))
        assert found.state != "ours" or same


class Bomb:
    """Leaves a trace when it is unpickled."""

    def __reduce__(self):
        return os.mkdir, ("exploded",)


def pickled_npz(path):
    np.savez(path, __key__=np.array([KEY, ""]), x=np.array([Bomb()], dtype=object), allow_pickle=True)


def pickled_member(path):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("__key__.npy", pickle.dumps(Bomb()))


def bare_pickle(path):
    path.write_bytes(pickle.dumps(Bomb()))


@pytest.mark.parametrize("write", [pickled_npz, pickled_member, bare_pickle])
def test_a_pickle_is_never_loaded(tmp_path, monkeypatch, write):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "x.npz")
    assert store.load(tmp_path / "x.npz", KEY).state == "damaged"
    assert not Path("exploded").exists()


def test_the_bombs_above_would_explode(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pickle.loads(pickle.dumps(Bomb()))
    assert Path("exploded").exists()


@pytest.mark.parametrize(
    ("key", "words"),
    [
        (store.canonical({"figure": "DEMO-F01", "seed": 2}), "seed is 2 there and 1 now"),
        (store.canonical({"figure": "DEMO-F01"}), "seed is null there and 1 now"),
        ("no JSON", "not one of this program's"),
        ("[]", "not one of this program's"),
    ],
)
def test_another_key_is_foreign_and_the_difference_is_told(tmp_path, key, words):
    found = store.load(saved(tmp_path, key=key), KEY)
    assert (found.state, found.arrays) == ("foreign", {})
    assert words in found.trouble


def test_somebody_elses_arrays_are_foreign(tmp_path):
    np.savez(tmp_path / "x.npz", x=np.ones(3))
    assert store.load(tmp_path / "x.npz", KEY).state == "foreign"


def test_a_folder_in_the_place_of_a_file_is_foreign(tmp_path):
    assert store.load(tmp_path, KEY).state == "foreign"


# ---------------------------------------------------------------- one step


def test_a_write_that_fails_leaves_what_was_there(tmp_path):
    path = saved(tmp_path)
    before = path.read_bytes()

    def broken(file):
        file.write(b"half")
        raise OSError(28, "No space left on device")

    with pytest.raises(FigureError, match=r"cannot write .*x\.npz: No space left on device.*--out"):
        disk.replace(path, broken)
    assert path.read_bytes() == before


def test_leftovers_of_killed_runs_are_swept_and_nothing_else(tmp_path):
    path = saved(tmp_path)
    (tmp_path / ".x.npz.abc.part").write_bytes(b"half")
    disk.sweep(tmp_path)
    assert list(tmp_path.iterdir()) == [path]
