"""The command: what it writes, what it says of mistakes, and that Ctrl-C keeps what is done."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.image import imread

from tracer3d import cli, compare, files, methods
from tracer3d.methods import METHODS
from tracer3d.render import Job, blank, render
from tracer3d.scenes import SCENES

SMALL = ["--size", "8x8", "--crop", "--depth", "2"]


def run(*words) -> int:
    return cli.main([str(word) for word in words])


def test_render_writes_a_picture_in_three_files(tmp_path, capsys):
    assert run("render", "cornell", "--frames", 2, *SMALL, "--out", tmp_path / "a.png") == 0
    assert files.read_pfm(tmp_path / "a.pfm").shape == (3, 8, 8)
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert "2 of 2 frames" in capsys.readouterr().out


def test_the_same_command_with_more_frames_goes_on(tmp_path):
    first, both = tmp_path / "a.png", tmp_path / "b.png"
    for frames in (2, 5):
        assert run("render", "crease", "--method", "path", "--frames", frames, *SMALL, "--out", first) == 0
    assert run("render", "crease", "--method", "path", "--frames", 5, *SMALL, "--out", both) == 0
    assert first.with_suffix(".pfm").read_bytes() == both.with_suffix(".pfm").read_bytes()


def test_frames_that_are_done_are_not_rendered_again(tmp_path, monkeypatch):
    right, rendered = methods.traced, []
    monkeypatch.setattr(methods, "traced", lambda *asked: rendered.append(1) or right(*asked))
    for frames, sofar in ((2, 2), (5, 5), (5, 5), (4, 5)):
        run("render", "crease", "--method", "path", "--frames", frames, *SMALL, "--out", tmp_path / "a.png")
        assert len(rendered) == sofar
    run("render", "crease", "--method", "path", "--frames", 1, "--anew", *SMALL, "--out", tmp_path / "a.png")
    assert len(rendered) == 6


def interrupted_at(monkeypatch, frame: int) -> None:
    """Ctrl-C is pressed while that frame is rendered."""
    right = methods.traced

    def traced(t, pixel, chance):
        if next(count) == frame:
            raise KeyboardInterrupt
        return right(t, pixel, chance)

    count = iter(range(100))
    monkeypatch.setattr(methods, "traced", traced)


def test_ctrl_c_keeps_what_is_done_and_the_same_command_finishes_it(tmp_path, monkeypatch, capsys):
    command = ["render", "crease", "--method", "path", "--frames", 5, *SMALL, "--out"]
    with monkeypatch.context() as patch:
        interrupted_at(patch, 3)
        assert run(*command, tmp_path / "a.png") == 130
    said = capsys.readouterr().out
    assert "3 of 5 frames" in said
    assert "the same command goes on from there" in said
    assert run(*command, tmp_path / "a.png") == run(*command, tmp_path / "b.png") == 0
    assert (tmp_path / "a.pfm").read_bytes() == (tmp_path / "b.pfm").read_bytes()


def test_ctrl_c_in_the_first_frame_leaves_nothing(tmp_path, monkeypatch, capsys):
    interrupted_at(monkeypatch, 0)
    assert run("render", "crease", "--method", "path", *SMALL, "--out", tmp_path / "a.png") == 130
    assert not [*tmp_path.iterdir()]
    assert "before the first frame" in capsys.readouterr().err


def test_errors_against_a_reference_stand_in_the_bar(tmp_path, capsys):
    picture = tmp_path / "a.png"
    run("render", "crease", "--method", "path", "--frames", 3, *SMALL, "--out", picture)
    run("render", "crease", "--frames", 1, *SMALL, "--out", tmp_path / "b.png", "--reference", tmp_path / "a.pfm")
    assert "MAPE 0." in capsys.readouterr().err


def test_compare_prints_a_table_and_draws_a_sheet(tmp_path, capsys):
    words = ["compare", "crease", "--methods", "path,restir-pt", "--rays", 60, "--trees", 8, *SMALL]
    assert run(*words, "--out", tmp_path / "c.png") == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["method", "frames", "rays/px", "seconds", "MAPE", "relMSE", "RMSE"]
    assert [line.split()[0] for line in lines[1:3]] == ["path", "restir-pt"]
    assert all(float(line.split()[2]) >= 60 for line in lines[1:3])
    assert (tmp_path / "c.png").exists()


def test_list_names_every_scene_and_method(capsys):
    assert run("list") == 0
    said = capsys.readouterr().out
    assert all(name in said for name in [*SCENES, *METHODS])


@pytest.mark.parametrize(("names", "shape"), [(["crease"], (90, 160)), (["crease", "furnace", "crease"], (180, 320))])
def test_thumbnails_are_drawn_two_in_a_row(tmp_path, names, shape):
    assert cli._thumbnails(names, tmp_path / "t.png", trees=1) == 0
    assert imread(tmp_path / "t.png").shape == (*shape, 4)


def test_the_camera_stands_unless_told_to_move():
    parse = cli.parser().parse_args
    assert parse(["render", "crease"]).moving == parse(["render", "crease", "--still"]).moving == 0
    assert parse(["render", "crease", "--moving"]).moving == 1


MISTAKES = {
    "a misspelt scene": (["corneli"], "no scene 'corneli': did you mean 'cornell'?"),
    "an unknown method": (["crease", "--method", "pth"], "no method 'pth': did you mean 'path'?"),
    "an unknown preset": (["crease", "--preset", "fast"], "no preset 'fast': there are realtime, offline."),
    "a crop off the film": (["crease", "--crop", "1900,0"], "begins at 1900 and has 64"),
    "a size of nothing": (["crease", "--size", "0x4"], "is 0. Say --size 64x64."),
    "an absurd size": (
        ["crease", "--size", "20000x20000"],
        "needs about 827.0 GiB, more than 4, and 1.2 hours a frame",
    ),
    "an absurd size by path": (["crease", "--method", "path", "--size", "20000x20000"], "about 74.5 GiB, more than 4"),
    "a depth without end": (["crease", "--depth", "1000000"], "the path depth is 1000000, more than 100"),
    "a camera that leaves": (["ajar", "--moving", "--frames", "99"], "frame 99 of the moving camera"),
    "a depth of 0": (["crease", "--depth", "0"], "the path depth must be a whole number >= 1, but is 0"),
    "tiles that do not fill it": (["crease", "--method", "path-reuse", "--size", "10x8"], "multiples of 4"),
    "a missing reference": (["crease", "--reference", "nowhere.pfm"], "nowhere.pfm"),
}


@pytest.mark.parametrize(("words", "said"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_named_and_nothing_is_written(tmp_path, capsys, words, said):
    assert run("render", *words, "--out", tmp_path / "a.png") == 2
    assert said in capsys.readouterr().err
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--size", "64"], "'64' is not a size, columns x rows, such as 64x48"),
        (["--crop", "a,b"], "'a,b' is not a column and a row"),
        (["--frames", "-1"], "'-1' is not a whole number"),
        (["--frames", "0"], "'0' is none: at least 1 is needed"),
        (["--still", "--moving"], "not allowed with"),
    ],
)
def test_words_that_are_no_numbers_are_refused(capsys, words, said):
    with pytest.raises(SystemExit, match="2"):
        run("render", "crease", *words)
    assert said in capsys.readouterr().err


NUMBERS = {
    "render": {"frames": "3", "depth": "3", "seed": "3"},
    "compare": {"trees": "3", "rays": "2.5", "seconds": "0.5", "depth": "3", "seed": "3"},
}


@pytest.mark.parametrize(("command", "option"), [(c, option) for c, options in NUMBERS.items() for option in options])
def test_every_number_is_read_as_one_and_words_instead_of_it_are_refused(capsys, command, option):
    word = NUMBERS[command][option]
    assert getattr(cli.parser().parse_args([command, "crease", f"--{option}", word]), option) == float(word)
    with pytest.raises(SystemExit, match="2"):
        cli.parser().parse_args([command, "crease", f"--{option}", "many"])
    assert "'many' is not a" in capsys.readouterr().err


def test_a_reference_of_another_size_and_a_comparison_without_budget_are_refused(tmp_path, capsys):
    files.write_pfm(tmp_path / "r.pfm", np.ones((3, 4, 6)))
    assert run("render", "crease", *SMALL, "--reference", tmp_path / "r.pfm", "--out", tmp_path / "a.png") == 2
    assert "has 6 x 4 pixels, but the picture 8 x 8." in capsys.readouterr().err
    assert run("compare", "crease", *SMALL) == 2
    assert "say --rays 1000, or --seconds 10" in capsys.readouterr().err
    assert run("compare", "crease", *SMALL, "--rays", "10", "--moving") == 2
    assert "a comparison needs a camera that stands" in capsys.readouterr().err


def test_a_frame_that_fails_leaves_those_before_it(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(cli, "_check_camera", lambda job, frames: None)
    words = ["--method", "path", "--size", "8x8", "--depth", "1", "--moving"]
    assert run("render", "ajar", *words, "--frames", "99", "--out", tmp_path / "a.png") == 2
    said = capsys.readouterr()
    done = int(said.out.split()[0])
    assert 1 < done < 99
    assert f"frame {done + 1}: " in said.err
    assert run("render", "ajar", *words, "--frames", str(done), "--out", tmp_path / "b.png") == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_run_of_other_settings_is_not_overwritten(tmp_path, capsys):
    command = ["render", "crease", "--method", "path", "--frames", 1, *SMALL, "--out", tmp_path / "a.png"]
    assert run(*command) == 0
    before = (tmp_path / "a.pfm").read_bytes()
    assert run(*command, "--seed", 9) == 2
    assert "seed 1 -> 9" in capsys.readouterr().err
    assert (tmp_path / "a.pfm").read_bytes() == before
    assert run(*command, "--seed", 9, "--anew") == 0
    assert (tmp_path / "a.pfm").read_bytes() != before


# ---------------------------------------------------------------- what methods and sheets are made of


@pytest.mark.parametrize("method", METHODS)
def test_every_method_renders_a_picture_with_light(tmp_path, method):
    assert run("render", "crease", "--method", method, "--frames", 1, *SMALL, "--out", tmp_path / "a.png") == 0
    assert files.read_pfm(tmp_path / "a.pfm").max() > 0


def test_thumbnails_make_their_folders(tmp_path):
    assert cli._thumbnails(["crease"], tmp_path / "new" / "and below" / "t.png", trees=1) == 0
    assert (tmp_path / "new" / "and below" / "t.png").exists()


def rows_of_two() -> list[SimpleNamespace]:
    """Two methods' pictures of 4 x 6 pixels, the second one wrong by a tenth."""
    bright = np.linspace(0.5, 2, 24).reshape(1, 4, 6)
    made = [("path", bright), ("restir-pt", 1.1 * bright)]
    return [SimpleNamespace(method=m, picture=SimpleNamespace(mean=L, frames=3), rays=5, seconds=2) for m, L in made]


def test_a_sheet_shows_every_picture_upright_and_its_error_below(tmp_path, monkeypatch):
    sheets, rows = [], rows_of_two()
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda self, *_, **__: sheets.append(self))
    compare.sheet(tmp_path / "s.png", rows, rows[0].picture.mean)
    axes = np.array(sheets[0].axes).reshape(2, 3)
    assert [len(ax.images) for ax in axes.flat] == [1, 1, 1, 0, 1, 1]
    assert [ax.images[0].get_array().shape for ax in axes[0]] == [(4, 6, 3)] * 3
    right, wrong = (np.asarray(ax.images[0].get_array()) for ax in axes[1, 1:])
    assert (right == 0).all()
    assert ((wrong > 0.09) & (wrong < 0.1)).all()
    assert sheets[0].get_figwidth() == pytest.approx(2.4 * 3)


def test_a_table_tells_the_errors_of_every_method():
    rows = rows_of_two()
    lines = compare.table(rows, rows[0].picture.mean).splitlines()
    assert [float(each) for each in lines[1].split()[4:]] == [0, 0, 0]
    assert all(float(each) > 0 for each in lines[2].split()[4:])
    assert len(lines[2].split()) == 7
    R = rows[0].picture.mean[0]
    assert float(lines[2].split()[4]) == pytest.approx((0.1 * R / (0.01 * R.mean() + R)).mean(), abs=1e-4)


def test_our_own_reference_shares_no_random_numbers_with_what_is_held_against_it():
    job = Job("crease", "path", size=(8, 8), depth=2)
    *_, same = render(job, cli._chances(job.seed), 2, blank(job), job.compiled())
    *_, again = render(job, cli._chances(job.seed), 2, blank(job), job.compiled())
    assert np.array_equal(same.mean, again.mean)
    assert (cli._path_traced(job, 2) == same.mean).mean() < 0.1
