"""Pictures on disk: what is linear is read as it was written, and what cannot be measured or kept is refused first."""

import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from restir_ref.batch import Array
from tracer3d import cli, compare, files

needs_exr = pytest.mark.skipif(find_spec("OpenEXR") is None, reason="needs the extra `exr`")
LINEAR = [pytest.param(".pfm"), pytest.param(".exr", marks=needs_exr)]
L = (1000 * np.random.default_rng(1).random((3, 4, 6))).astype(np.float32).astype(float)
SMALL = ["--size", "8x8", "--crop", "--depth", "2"]


def run(*words) -> int:
    return cli.main([str(word) for word in words])


def kept(path: Path, picture: Array) -> Array:
    """A picture as it comes back from a file."""
    _, write = files.LINEAR[path.suffix]
    write(path, picture)
    return files.read_linear(path)


@pytest.mark.parametrize("suffix", LINEAR)
def test_linear_pictures_come_back_to_the_bit(tmp_path, suffix):
    assert (kept(tmp_path / f"a{suffix}", L) == L).all()
    assert (kept(tmp_path / f"b{suffix}", L[:1]) == L[0]).all()
    assert (kept(tmp_path / f"c{suffix}", L[:, ::-1]) != L).any()


@needs_exr
def test_an_exr_can_be_asked_for_and_holds_what_a_pfm_does(tmp_path):
    for name in ("a.exr", "b.png"):
        assert run("render", "crease", *SMALL, "--method", "path", "--frames", 2, "--out", tmp_path / name) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"a.exr", "a.png", "a.npz", "b.pfm", "b.png", "b.npz"}
    assert (files.read_linear(tmp_path / "a.exr") == files.read_linear(tmp_path / "b.pfm")).all()
    assert imread(tmp_path / "a.png").shape == (8, 8, 4)


@needs_exr
def test_of_an_exr_with_four_channels_three_are_read(tmp_path):
    import OpenEXR  # noqa: PLC0415  (an extra)

    pixels = np.arange(24, dtype=np.float32).reshape(2, 3, 4)
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, {"RGBA": pixels}).write(
        str(tmp_path / "a.exr")
    )
    assert (files.read_linear(tmp_path / "a.exr") == pixels[:, :, :3].transpose(2, 0, 1)).all()


@needs_exr
def test_a_grey_exr_is_read_as_one_channel(tmp_path):
    import OpenEXR  # noqa: PLC0415  (an extra)

    pixels = np.arange(6, dtype=np.float32).reshape(2, 3)
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, {"Y": pixels}).write(
        str(tmp_path / "a.exr")
    )
    assert (files.read_linear(tmp_path / "a.exr") == pixels[None]).all()
    assert files.read_linear(tmp_path / "a.exr").shape == (1, 2, 3)


@needs_exr
def test_errors_against_an_exr_are_those_against_a_pfm(tmp_path, capsys):
    said = []
    for suffix in (".exr", ".pfm"):
        kept(tmp_path / f"r{suffix}", np.ones((3, 8, 8)))
        words = ["--reference", tmp_path / f"r{suffix}", "--out", tmp_path / f"c{suffix}.png", "--rays", 8]
        assert run("compare", "crease", *SMALL, "--methods", "path", *words) == 0
        said.append(capsys.readouterr().out.splitlines()[1].split()[4:])
    assert said[0] == said[1]


@needs_exr
@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda data: data[:300], "cannot be read as EXR"),
        (lambda data: b"PF" + data, "is no EXR with channels R, G and B, or Y, but has none"),
        (lambda data: b"", "is no EXR"),
    ],
)
def test_a_damaged_exr_is_refused_by_name(tmp_path, damage, said):
    path = tmp_path / "r.exr"
    kept(path, L)
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(ValueError, match=rf"r.exr.*{said}"):
        files.read_linear(path)


def test_without_openexr_the_extra_is_named_before_anything_is_rendered(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    for words in (["--out", tmp_path / "a.exr"], ["--out", tmp_path / "a.png", "--reference", "r.exr"]):
        assert run("render", "crease", *SMALL, *words) == 2
        assert "needs the package OpenEXR: install restir-ref with its extra 'exr'" in capsys.readouterr().err
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("r.png", "r.png is tone mapped and cannot be measured: give the PFM or EXR beside it"),
        ("r.hdr", "there is no format of a reference '.hdr': there are .pfm, .exr"),
        ("r.pfm", "r.pfm has 1 values that are not finite"),
        ("wide.pfm", "wide.pfm has 6 x 4 pixels, but the picture 8 x 8"),
    ],
)
@pytest.mark.parametrize("command", ["render", "compare"])
def test_a_reference_that_tells_nothing_is_refused(tmp_path, capsys, command, name, said):
    files.write_pfm(tmp_path / "wide.pfm", L)
    files.write_pfm(tmp_path / "r.pfm", np.where(np.arange(192).reshape(3, 8, 8) == 5, np.nan, 1.0))
    words = ["--rays", 8] if command == "compare" else []
    out = tmp_path / "new" / "a.png"
    assert run(command, "crease", *SMALL, *words, "--reference", tmp_path / name, "--out", out) == 2
    assert said in capsys.readouterr().err
    assert not out.parent.exists()


def test_a_place_where_nothing_can_be_written_is_refused_first(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    for command in (["render", "crease"], ["compare", "crease", "--rays", "9"], ["list"]):
        assert run(*command, "--out", tmp_path / "file" / "a.png") == 2
        assert f"nothing can be written to {tmp_path / 'file' / 'a.png'}" in capsys.readouterr().err


def test_a_state_that_is_none_is_refused_and_dropped_on_demand(tmp_path, capsys):
    (tmp_path / "a.npz").write_bytes(b"PK\x03\x04 no archive")
    command = ["render", "crease", "--method", "path", "--frames", 1, *SMALL, "--out", tmp_path / "a.png"]
    assert run(*command) == 2
    assert "a.npz is not what a run has left, or is damaged: say another --out, or --anew" in capsys.readouterr().err
    assert run(*command, "--anew") == run(*command) == 0


def test_ctrl_c_keeps_the_methods_that_are_done_and_says_which_are_left(tmp_path, monkeypatch, capsys):
    right = compare.spend

    def spend(job, *given):
        if job.method == "restir-di":
            raise KeyboardInterrupt
        return right(job, *given)

    monkeypatch.setattr(compare, "spend", spend)
    command = ["compare", "crease", "--rays", 8, "--trees", 1, *SMALL, "--out", tmp_path / "c.png", "--methods"]
    assert run(*command, "path,restir-di,restir-pt") == 130
    said = capsys.readouterr().out
    assert said.splitlines()[1].startswith("path ")
    assert "to go on, say --methods restir-di,restir-pt" in said
    assert (tmp_path / "c.png").exists()
    assert run(*command, "restir-di,path") == 130
    assert "stopped before anything was done" in capsys.readouterr().err


def test_a_misspelt_method_of_a_comparison_is_named_whichever_it_is(capsys):
    assert run("compare", "crease", "--rays", 9, "--methods", "path,restir-p") == 2
    assert "there is no method 'restir-p': did you mean 'restir-pt'?" in capsys.readouterr().err
