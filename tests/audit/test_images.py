"""Frames against a reference: biased where and by how much, unbiased to what, or undecided, and never by chance."""

import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imsave

from restir_ref.audit import BadImages, audit_images, audit_ladder
from restir_ref.audit.__main__ import main
from restir_ref.audit.image_files import DECODERS, images, srgb
from restir_ref.audit.images import FEWEST, TILE, edges, place, tiles, units

H, W = 24, 24
TRUTH = 1 + 0.5 * np.sin(np.arange(W) / 4)[None] * np.ones((H, 1))


def rendered(bias: np.ndarray | float, spread: float, count: int, seed: int) -> np.ndarray:
    """Frames with gamma noise of a relative standard deviation."""
    k = spread**-2
    return TRUTH * bias * np.random.default_rng(seed).gamma(k, 1 / k, (count, H, W))


def edge() -> np.ndarray:
    """One column of an edge too bright, the next too dark: the mean of the image is right."""
    bias = np.ones((H, W))
    bias[:, 11], bias[:, 12] = 1.1, 0.9
    return bias


def block(size: float) -> np.ndarray:
    """5 % of the pixels, side by side, are off."""
    bias = np.ones((H, W))
    bias[5:10, 5:11] += size
    return bias


def sprinkled(size: float) -> np.ndarray:
    """5 % of the pixels, anywhere."""
    bias = np.ones(H * W)
    bias[np.random.default_rng(3).choice(H * W, 29, replace=False)] += size
    return bias.reshape(H, W)


# ---------------------------------------------------------------- three answers


def test_an_edge_that_errs_both_ways_is_found_with_the_noise_of_both_sides() -> None:
    noisy = TRUTH * (1 + 0.01 * np.random.default_rng(1).standard_normal((H, W)))
    report = audit_images(rendered(edge(), 0.71, 64, 0), noisy, reference_error=0.01)
    assert report.biased
    assert "column 11" in report.answer
    assert "column 12" in report.answer
    assert str(report).splitlines()[1].startswith("where to go on: switch reuse off first")


@pytest.mark.parametrize(
    ("bias", "spread"), [(block(0.01), 0.08), (sprinkled(0.01), 0.025)], ids=["a block", "anywhere"]
)
def test_one_percent_in_a_twentieth_of_the_pixels_is_found_with_256_frames(bias, spread) -> None:
    """The relative noise of a frame's pixel is 8 % or 2.5 %; power of 9 in 10."""
    assert sum(audit_images(rendered(bias, spread, 256, seed), TRUTH).biased for seed in range(10)) >= 8


def test_a_bias_of_the_whole_image_is_found_and_bracketed() -> None:
    report = audit_images(rendered(1.01, 0.5, 256, 2), TRUTH)
    assert report.biased
    whole = next(each for each in report.families if each.family == "whole image")
    low, high = (float((whole.bias + sign * 3.3 * whole.error)[0, 0] / whole.light[0, 0]) for sign in (-1, 1))
    assert 0 < low < 0.01 < high < 0.02


def test_a_right_image_is_unbiased_to_what_its_tiles_show() -> None:
    report = audit_images(rendered(1.0, 0.1, 256, 3), TRUTH)
    assert report.unbiased
    assert report.answer.startswith("UNBIASED to 2.0% in every tile")
    assert report.half_width < 0.02


def test_too_few_frames_are_undecided_with_the_number_that_is_needed() -> None:
    report = audit_images(rendered(1.0, 0.7, 64, 4), TRUTH)
    assert not report.biased
    assert not report.unbiased
    assert report.answer.startswith("UNDECIDED")
    enough = report.frames_needed
    assert 150 < enough < 350
    assert audit_images(rendered(1.0, 0.7, 2 * enough, 5), TRUTH).unbiased


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_the_first_pixel_that_is_not_finite_ends_the_search(value) -> None:
    frames = rendered(1.0, 0.1, 32, 6)
    frames[7, 3, 4] = value
    report = audit_images(frames, TRUTH)
    assert report.biased
    assert "frame 8" in report.answer
    assert "pixel (row 3, column 4)" in report.answer


# ---------------------------------------------------------------- no false alarm

NOISES = {
    "gamma": lambda rng, shape: rng.gamma(2, 0.5, shape),
    "log-normal": lambda rng, shape: np.exp(0.6 * rng.standard_normal(shape) - 0.18),
    "rare": lambda rng, shape: (rng.random(shape) < 0.2) / 0.2,
}


@pytest.mark.parametrize("noise", NOISES)
def test_noise_is_not_called_a_bias(noise) -> None:
    """12 images each; `benchmarks` has the rate over thousands."""
    rng = np.random.default_rng(16)
    for _ in range(12):
        assert not audit_images(TRUTH * NOISES[noise](rng, (64, H, W)), TRUTH).biased


def test_a_pixel_that_no_frame_has_found_yet_is_as_uncertain_as_its_neighbours() -> None:
    """Light that one sample in five finds: 64 frames miss it once in a million pixels, without any variance."""
    frames = TRUTH * NOISES["rare"](np.random.default_rng(1), (64, H, W))
    frames[:, 16, 18] = 0
    report = audit_images(frames, TRUTH)
    assert not report.biased
    assert 3 < abs(report.families[0].z[0, 16 * W + 18]) < 5


def test_the_reference_s_own_noise_is_not_called_a_bias() -> None:
    rng = np.random.default_rng(17)
    renderings = [TRUTH * rng.gamma(2, 0.5, (H, W)) for _ in range(64)]
    frames = TRUTH * rng.gamma(2, 0.5, (64, H, W))
    assert not audit_images(frames, renderings).biased
    assert audit_images(frames, np.mean(renderings, axis=0)).scattered > 1
    assert audit_images(frames * 1.1, renderings).biased


def test_frames_that_share_samples_are_noticed_and_their_errors_widened() -> None:
    rng = np.random.default_rng(18)
    noise, frames = np.ones((H, W)), []
    for _ in range(64):
        noise = 0.9 * noise + 0.1 * rng.gamma(0.2, 5, (H, W))
        frames.append(TRUTH * noise)
    report = audit_images(frames, TRUTH)
    assert report.correlation > 0.5
    assert "frames are not independent" in str(report)
    assert not report.biased


# ---------------------------------------------------------------- pieces


def test_tiles_rows_and_edges_cover_the_image() -> None:
    for name, unit in units(TRUTH[None]).items():
        assert unit.shape == (H, W), name
        assert unit.min() == 0
    step = np.ones((1, 8, 8))
    step[..., 4:] = 3
    np.testing.assert_array_equal(edges(step), [[1, 1, 1, 0, 0, 1, 1, 1]] * 8)


def test_a_pixel_s_own_value_does_not_make_it_an_edge() -> None:
    """Twin: 64 noisy renderings as a reference, whose outliers would gather in one class and look biased."""
    lone = np.ones((1, 9, 9))
    lone[0, 4, 4] = 5
    assert edges(lone)[4, 4] == 1


def test_an_image_of_one_row_is_an_image() -> None:
    frames = rendered(edge(), 0.1, 64, 0)[:, :1]
    assert "column 11" in audit_images(frames, TRUTH[:1]).answer
    assert not audit_images(rendered(1.0, 0.1, 64, 0)[:, :1], TRUTH[:1]).biased


def test_places_are_said_in_words() -> None:
    assert place("pixel", 25, (1, H, W)) == "pixel (row 1, column 1)"
    assert place("tile", 4, (1, H, W)) == "tile of rows 8 to 15, columns 8 to 15"
    assert place("tile between", 0, (1, H, W)) == "tile of rows 0 to 3, columns 0 to 3"
    assert place("column step", 11, (1, H, W)) == "the step from column 11 to column 12"
    y, x = np.mgrid[:H, :W]
    assert tiles(y, x, TILE, 0)[8, 8] == 4


def test_colours_are_tested_channel_by_channel() -> None:
    frames = np.stack([rendered(bias, 0.1, 64, k) for k, bias in enumerate((1.0, 1.05, 1.0))], axis=-1)
    report = audit_images(frames, np.stack([TRUTH] * 3, axis=-1))
    assert report.biased
    assert "channel 1" in report.answer


BAD = {
    "another view": (rendered(1.0, 0.1, 20, 0)[:, :-1], TRUTH, "frame 1 has shape (23, 24)"),
    "too few": (rendered(1.0, 0.1, FEWEST - 1, 0), TRUTH, "there are 15 frames, but at least 16"),
    "a black reference": (rendered(1.0, 0.1, 20, 0), 0 * TRUTH, "the reference is black"),
    "a broken reference": (rendered(1.0, 0.1, 20, 0), TRUTH * np.nan, "not finite"),
    "a flat reference": (rendered(1.0, 0.1, 20, 0), TRUTH[0], "an image has shape (24,)"),
    "no reference": (rendered(1.0, 0.1, 20, 0), [], "there are none"),
}


@pytest.mark.parametrize("name", BAD)
def test_images_that_cannot_be_compared_are_refused(name) -> None:
    frames, reference, said = BAD[name]
    with pytest.raises(BadImages) as refused:
        audit_images(frames, reference)
    assert said in str(refused.value)


# ---------------------------------------------------------------- step by step


def test_the_ladder_names_the_first_wrong_step() -> None:
    steps = {
        "new samples": rendered(1.0, 0.1, 64, 0),
        "temporal": rendered(0.97, 0.1, 64, 1),
        "spatial": rendered(0.94, 0.1, 64, 2),
    }
    found = audit_ladder(steps, TRUTH)
    assert found.first_wrong == "temporal"
    assert str(found).startswith("the first wrong step is 'temporal'; new samples show nothing")
    assert audit_ladder({"new samples": steps["new samples"]}, TRUTH).first_wrong == ""


# ---------------------------------------------------------------- files and commands


def pfm(path: Path, image: np.ndarray) -> None:
    path.write_bytes(b"Pf\n%d %d\n-1.0\n" % (W, H) + image[::-1].astype("<f4").tobytes())


def test_files_and_folders_are_read_in_order(tmp_path) -> None:
    frames = rendered(1.0, 0.1, 3, 0)
    np.save(tmp_path / "stack.npy", frames)
    np.savez(tmp_path / "stack.npz", frames)
    folder = tmp_path / "frames"
    folder.mkdir()
    for k, frame in enumerate(frames):
        pfm(folder / f"{k}.pfm", frame)
    for path in (tmp_path / "stack.npy", tmp_path / "stack.npz", folder):
        np.testing.assert_allclose(np.array(list(images(path))), frames, rtol=1e-6)
    np.save(tmp_path / "one.npy", frames[0])
    assert len(list(images(tmp_path / "one.npy"))) == 1


def test_a_picture_for_screens_is_refused_unless_told(tmp_path) -> None:
    imsave(tmp_path / "a.png", np.full((4, 4, 3), 0.5))
    with pytest.raises(BadImages, match="no mean of light"):
        list(images(tmp_path / "a.png"))
    (coded,) = images(tmp_path / "a.png", DECODERS["srgb"])
    assert coded[0, 0, 0] == pytest.approx(0.2122, abs=2e-3)
    assert srgb(np.array([0.04, 1.0])) == pytest.approx([0.04 / 12.92, 1])


exr = pytest.mark.skipif(find_spec("OpenEXR") is None, reason="needs the extra `exr`")


def write_exr(path: Path, **channels: np.ndarray) -> None:
    import OpenEXR  # noqa: PLC0415  (an extra)

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, channels).write(str(path))


COLOURS = np.random.default_rng(3).random((5, 4, 3)).astype("f4")
GREY, ALPHA = COLOURS[..., 0].copy(), np.ones((5, 4), "f4")
CHANNELS = {
    "colours": ({"RGB": COLOURS}, COLOURS),
    "with alpha": ({"RGBA": np.concatenate([COLOURS, ALPHA[..., None]], axis=-1)}, COLOURS),
    "one by one": ({name: COLOURS[..., k].copy() for k, name in enumerate("RGB")}, COLOURS),
    "with depth": ({"RGB": COLOURS, "Z": ALPHA}, COLOURS),
    "half": ({"RGB": COLOURS.astype("f2")}, COLOURS.astype("f2")),
    "grey": ({"Y": GREY}, GREY),
    "of another name": ({"radiance": GREY}, GREY),
}


@exr
@pytest.mark.parametrize("name", CHANNELS)
def test_an_exr_is_read_as_it_was_written(name, tmp_path) -> None:
    channels, light = CHANNELS[name]
    write_exr(tmp_path / "a.exr", **channels)
    (found,) = images(tmp_path / "a.exr")
    np.testing.assert_array_equal(found, light.astype(float))


@exr
def test_an_exr_whose_channels_are_no_light_is_refused(tmp_path) -> None:
    write_exr(tmp_path / "a.exr", Z=GREY, variance=ALPHA)
    with pytest.raises(BadImages, match=r"a\.exr has channels Z, variance, and none of them is R, G, B or Y"):
        list(images(tmp_path / "a.exr"))


@exr
@pytest.mark.parametrize(("bias", "status"), [(1.0, 0), (1.1, 1)])
def test_frames_and_reference_may_be_exr(bias, status, tmp_path) -> None:
    (tmp_path / "frames").mkdir()
    for k, frame in enumerate(rendered(bias, 0.1, 64, 0)):
        write_exr(tmp_path / "frames" / f"{k:02}.exr", Y=frame.astype("f4"))
    write_exr(tmp_path / "reference.exr", Y=TRUTH.astype("f4"))
    assert main(["images", str(tmp_path / "frames"), str(tmp_path / "reference.exr")]) == status


def test_without_its_reader_an_exr_is_refused_and_the_extra_named(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    (tmp_path / "a.exr").write_bytes(b"v/1\x01")
    assert main(["images", str(tmp_path / "a.exr"), str(tmp_path / "a.exr")]) == 2
    assert "install restir-ref with its extra 'exr'" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["a.npy", "a.pfm", "a.npz", "a.tif", "a.png", "a.exr"])
def test_files_that_are_no_images_are_refused(name, tmp_path) -> None:
    (tmp_path / name).write_bytes(b"PF\nno image")
    with pytest.raises(BadImages, match=name):
        list(images(tmp_path / name))


@pytest.mark.parametrize(
    ("bias", "spread", "status", "said"),
    [(1.0, 0.1, 0, "UNBIASED"), (1.1, 0.1, 1, "BIASED"), (1.0, 0.9, 3, "UNDECIDED")],
)
def test_the_command_says_which_answer_it_is_by_its_status(bias, spread, status, said, tmp_path, capsys) -> None:
    np.save(tmp_path / "frames.npy", rendered(bias, spread, 64, 0))
    np.save(tmp_path / "reference.npy", TRUTH)
    given = [str(tmp_path / "frames.npy"), str(tmp_path / "reference.npy")]
    assert main(["images", *given, "--out", str(tmp_path / "z.png")]) == status
    assert capsys.readouterr().out.startswith(said)
    assert (tmp_path / "z.png").stat().st_size > 1000


def test_the_command_for_steps_names_the_first_wrong_one(tmp_path, capsys) -> None:
    np.save(tmp_path / "reference.npy", TRUTH)
    for k, bias in enumerate((1.0, 1.1)):
        np.save(tmp_path / f"{k}.npy", rendered(bias, 0.1, 64, k))
    steps = [f"new={tmp_path / '0.npy'}", f"reuse={tmp_path / '1.npy'}"]
    assert main(["ladder", str(tmp_path / "reference.npy"), *steps]) == 1
    assert capsys.readouterr().out.startswith("the first wrong step is 'reuse'")
    assert main(["images", str(tmp_path / "no.npy"), str(tmp_path / "reference.npy")]) == 2
    assert main(["ladder", str(tmp_path / "no.npy"), *steps]) == 2
