"""The jobs of `make evidence`: they resume, know what they depend on, run at tiny counts, and see planted mistakes."""

import json
from collections.abc import Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from benchmarks import evidence, jobs
from benchmarks.jobs import (
    averaging,
    baselines,
    comparing,
    extremes,
    gradients,
    indirect_references,
    job,
    map_gradients,
    means,
    mutations,
    offline,
    probes,
    references,
    report,
    retracing,
    roundtrips,
    row_gradients,
    signing,
    space_gradients,
    space_means,
    space_offline,
)
from benchmarks.jobs import tracing as tracing_job
from benchmarks.jobs.comparing import Sums, joined, judged, nothing, spread, spread_by_chance, stored, sums
from benchmarks.jobs.job import Job, Row, parts, run
from benchmarks.jobs.references import lattice
from benchmarks.jobs.roundtrips import Trips
from figures.experiments.references import Reference
from flatland2d import SCENES
from restir_ref.batch import Array, take
from restir_ref.integrals import Pixels, Shifted
from restir_ref.loop import random_in_row
from restir_ref.transport import shifts as shifts_module
from restir_ref.transport.paths import radiance
from restir_ref.transport.restir_pt import PathIntegrals

# ---------------------------------------------------------------- the machine


def counted(asked: list[int], fails_at: int = -1) -> Job:
    """Five chunks of two random numbers; computing one is noted, one may raise."""

    def compute(params, *, rng):
        asked.append(params["part"])
        if params["part"] == fails_at:
            raise KeyboardInterrupt
        return {"x": rng.random(2)}

    def judge(done):
        total = sum(arrays["x"].sum() for _, arrays in done)
        return [Row("", "a sum", float(total), "> 0", bool(total > 0), len(done))]

    return Job("A sum", lambda share: [{"part": part} for part in parts(5, share)], compute, judge, lambda _: "it")


def test_a_run_that_was_ended_goes_on_and_finds_the_same(tmp_path) -> None:
    asked: list[int] = []
    with pytest.raises(KeyboardInterrupt):
        run("job", counted(asked, fails_at=3), 1.0, tmp_path / "a")
    resumed = run("job", counted(asked), 1.0, tmp_path / "a")
    assert asked == [0, 1, 2, 3, 3, 4]
    whole = run("job", counted([]), 1.0, tmp_path / "b")
    assert all((a["x"] == b["x"]).all() for (_, a), (_, b) in zip(resumed, whole, strict=True))


def test_a_smaller_share_is_part_of_a_larger_one(tmp_path) -> None:
    asked: list[int] = []
    assert len(run("job", counted(asked), 0.4, tmp_path)) == 2
    assert len(run("job", counted(asked), 1.0, tmp_path)) == 5
    assert asked == [0, 1, 2, 3, 4]


def test_chunks_and_jobs_have_random_numbers_of_their_own(tmp_path) -> None:
    done = [*run("job", counted([]), 1.0, tmp_path), *run("other", counted([]), 1.0, tmp_path)]
    assert len({arrays["x"][0] for _, arrays in done}) == len(done)


@pytest.mark.parametrize("change", ["another dependence", "a damaged file"])
def test_what_no_longer_holds_is_computed_again(tmp_path, change) -> None:
    asked: list[int] = []
    run("job", counted([]), 1.0, tmp_path)
    if change == "a damaged file":
        (tmp_path / "job" / "2.npz").write_bytes(b"no zip")
        run("job", counted(asked), 1.0, tmp_path)
        assert asked == [2]
    else:
        run("job", replace(counted(asked), identity=lambda _: "something else"), 1.0, tmp_path)
        assert asked == [0, 1, 2, 3, 4]


def plant(root, path: str, text: str) -> None:
    (root / path).parent.mkdir(parents=True, exist_ok=True)
    (root / path).write_text(text, encoding="utf-8")


@pytest.mark.parametrize(
    ("edit", "same"), [("return x * 3", False), ('"""New words."""\n    return x * 2  # so', True)]
)
def test_the_digest_of_code_sees_what_is_reached_by_imports_but_not_words(tmp_path, monkeypatch, edit, same) -> None:
    def digest(body: str) -> str:
        for cached in (job.code, job._imports, job._syntax):
            cached.cache_clear()
        plant(tmp_path, "restir_ref/deep.py", f"def f(x):\n    {body}\n")
        return job.code("benchmarks.one")

    monkeypatch.setattr(job, "ROOT", tmp_path)
    plant(tmp_path, "benchmarks/one.py", "from restir_ref import between")
    plant(tmp_path, "restir_ref/__init__.py", "")
    plant(tmp_path, "restir_ref/between.py", "from restir_ref.deep import f")
    assert (digest('"""Words."""\n    return x * 2') == digest(edit)) is same
    for cached in (job.code, job._imports, job._syntax):
        cached.cache_clear()


# ---------------------------------------------------------------- the command


def main(tmp_path, monkeypatch, *found: Job) -> tuple[int, str, dict]:
    """Exit status, page and JSON of a run of jobs in a checkout of their own."""
    names = {f"job {k}": each for k, each in enumerate(found)}
    monkeypatch.setattr(jobs, "JOBS", MappingProxyType(names))
    folders = [f"--stored={tmp_path / 'out'}", f"--results={tmp_path / 'checkout'}"]
    status = evidence.main([*names, *folders])
    page = (tmp_path / "checkout" / report.TABLE).read_text(encoding="utf-8")
    return status, page, json.loads((tmp_path / "checkout" / report.JSON).read_text(encoding="utf-8"))


def red() -> Job:
    return replace(counted([]), judge=lambda done: [Row("GRIS-A09", "|a sum|", 1.0, "0", holds=False, count=len(done))])


def test_results_are_filed_with_where_they_come_from_and_a_red_one_ends_with_1(tmp_path, monkeypatch) -> None:
    status, page, found = main(tmp_path, monkeypatch, counted([]))
    assert status == 0
    assert found["job 0"]["seed"] == job.SEED
    assert {"commit", "changed", "code", "chunks", "cpu_minutes", "share"} < found["job 0"].keys()
    status, page, found = main(tmp_path, monkeypatch, counted([]), red())
    assert status == 1
    assert "**FAILS**" in page
    assert "\\|a sum\\|" in page
    assert [row["holds"] for each in found.values() for row in each["rows"]] == [True, False]


def test_a_later_run_of_one_job_leaves_the_others_alone(tmp_path, monkeypatch) -> None:
    _, before, _ = main(tmp_path, monkeypatch, counted([]), red())
    _, after, found = main(tmp_path, monkeypatch, counted([]))
    assert found.keys() == {"job 0", "job 1"}
    assert before == after


def other_code() -> Job:
    return replace(counted([]), identity=lambda _: "another code")


def more_chunks() -> Job:
    return replace(counted([]), chunks=lambda share: [{"part": part} for part in parts(6, share)])


STALE = {
    "what was measured": ({"job 0": counted([])}, []),
    "other code": ({"job 0": other_code()}, ["job 0: code or references have changed since it was measured at"]),
    "other chunks": ({"job 0": more_chunks()}, ["job 0: code or references have changed since it was measured at"]),
    "a new job": ({"job 0": counted([]), "job 1": red()}, ["job 1: never measured"]),
    "a job that is gone": ({}, ["job 0: is filed, but no job any more"]),
}


@pytest.mark.parametrize(("today", "said"), STALE.values(), ids=STALE)
def test_stale_evidence_is_named_and_ends_with_1(tmp_path, monkeypatch, capsys, today, said) -> None:
    main(tmp_path, monkeypatch, counted([]))
    monkeypatch.setattr(jobs, "JOBS", MappingProxyType(today))
    capsys.readouterr()
    assert evidence.main(["--stale", f"--results={tmp_path / 'checkout'}"]) == int(bool(said))
    lines = capsys.readouterr().out.splitlines()[: len(said)]
    assert [line[: len(words)] for line, words in zip(lines, said, strict=True)] == said


def test_evidence_at_a_share_of_its_counts_is_stale(tmp_path, monkeypatch) -> None:
    main(tmp_path, monkeypatch, counted([]))
    path = tmp_path / "checkout" / report.JSON
    found = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps({"job 0": found["job 0"] | {"share": 0.1}}), encoding="utf-8")
    assert report.stale({"job 0": counted([])}, tmp_path / "checkout") == ["job 0: measured at 0.1 of its counts only"]


def test_the_digest_of_code_sees_the_numbers_beside_a_module(tmp_path, monkeypatch) -> None:
    def digest(number: float) -> str:
        for cached in (job.code, job._imports, job._syntax):
            cached.cache_clear()
        np.savez(tmp_path / "figures" / "experiments" / "references.npz", mean=number)
        return job.code("benchmarks.one")

    monkeypatch.setattr(job, "ROOT", tmp_path)
    plant(tmp_path, "benchmarks/one.py", "from figures.experiments.references import reference")
    plant(tmp_path, "figures/__init__.py", "")
    plant(tmp_path, "figures/experiments/references.py", "def reference():\n    pass\n")
    assert digest(1.0) == digest(1.0) != digest(2.0)
    for cached in (job.code, job._imports, job._syntax):
        cached.cache_clear()


# ---------------------------------------------------------------- how means are judged


def noise(seed: int, shift=0.0, scale=1.0) -> Sums:
    images = shift + scale * np.random.default_rng(seed).standard_normal((16, 64, 32))
    return joined([stored(sums(each), "images") for each in images], "images")


def test_noise_without_bias_holds_and_bias_or_too_much_noise_fails() -> None:
    def holds(found: Sums) -> bool:
        return judged("", "", found, nothing(32), 1.0, 0.01).holds

    assert all(holds(noise(seed)) for seed in range(8))
    assert not holds(noise(1, shift=0.05))
    assert not holds(noise(1, scale=3.0))


def test_errors_of_both_signs_that_cancel_in_the_mean_are_seen_by_the_spread() -> None:
    found = noise(2, shift=np.tile([0.1, -0.1], 16))
    assert spread(found, nothing(32)) > 1.5 * spread_by_chance(found)
    assert not judged("", "", found, nothing(32), 1.0, 0.01).holds


# ---------------------------------------------------------------- jobs at tiny counts, and planted mistakes


def rows(found: Job, share: float, *only: str) -> list[Row]:
    """What a job says at a tiny share, of chunks that hold these values."""
    chunks = [params for params in found.chunks(share) if set(only) <= set(params.values())]
    done = [(params, found.compute(params, rng=np.random.default_rng(k))) for k, params in enumerate(chunks)]
    return list(found.judge(done))


@pytest.fixture
def few(monkeypatch) -> None:
    """Counts of a second."""
    monkeypatch.setattr(roundtrips, "TRIPS", 4000)
    monkeypatch.setattr(retracing, "TRACED", 4000)
    monkeypatch.setattr(retracing, "DIFFERENCED", 15)
    monkeypatch.setattr(probes, "WATCHED", (1, 2))
    monkeypatch.setattr(probes, "REPLICAS", 8)
    monkeypatch.setattr(probes, "LATTICES", 2)
    monkeypatch.setattr(probes, "lattice", lambda D: lattice(D)[:, ::8])
    monkeypatch.setattr(extremes, "BATCH", 256)
    monkeypatch.setattr(tracing_job, "IMAGES", 10)
    monkeypatch.setattr(tracing_job, "lattice", lambda D: lattice(D)[:, ::32])
    monkeypatch.setattr(references, "PANELS", (4, 8))
    monkeypatch.setattr(references, "FILM", 1)
    monkeypatch.setattr(offline, "FRAMES", 8)
    monkeypatch.setattr(comparing, "FLIPS", 100)


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize(
    "found", [roundtrips.JOB, retracing.JOB, extremes.JOB], ids=["round trips", "re-tracing", "extremes"]
)
def test_shifts_return_are_found_again_and_stay_finite(found) -> None:
    said = rows(found, 0.001, "glossy_cornell")
    assert said
    assert all(row.holds for row in said)


def never(rule, r_x, r_z, distance):
    """A mistake: the replayed prefix is not tested for an earlier connection."""
    return np.zeros(len(distance), dtype=bool)


def unchecked(monkeypatch) -> None:
    right = shifts_module._step

    def step(*args):
        original, shifts_module.connectable = shifts_module.connectable, never
        try:
            return right(*args)
        finally:
            shifts_module.connectable = original

    monkeypatch.setattr(shifts_module, "_step", step)


@pytest.mark.usefixtures("few")
def test_a_missing_test_for_earlier_connections_turns_re_tracing_red(monkeypatch) -> None:
    unchecked(monkeypatch)
    said = rows(retracing.JOB, 0.001, "glossy_cornell", "hybrid")
    assert not said[0].holds
    assert said[0].value > 3


@pytest.mark.usefixtures("few")
def test_an_inverted_jacobian_one_way_turns_round_trips_red(monkeypatch) -> None:
    right = shifts_module.ratio
    monkeypatch.setattr(shifts_module, "ratio", lambda a, b: right(a, b) * 1.01 if np.ndim(a) == 1 else right(a, b))
    said = rows(roundtrips.JOB, 0.001, "cornell")
    assert not any(row.holds for row in said if "replay" not in row.what)


@pytest.mark.usefixtures("few")
def test_a_single_failing_path_is_an_edge_case_and_one_among_failures_is_not(monkeypatch) -> None:
    setting = SCENES["cornell"]()
    t, base = roundtrips.film(setting, "replay"), roundtrips.lit(setting, 64, np.random.default_rng(1))
    x = roundtrips.traced(t, base.u, base.i, base.k, base.nee)
    right, mine = roundtrips.trips, take(x, np.array([0]))

    def fails(where):
        def broken(t, x, i, j) -> Trips:
            found = right(t, x, i, j)
            return replace(found, back=np.where(where(x), 0.0, found.back))

        return broken

    for where, logic in ((lambda x: (x.u == mine.u).all(axis=0), False), (lambda x: x.u[0] >= 0, True)):
        monkeypatch.setattr(roundtrips, "trips", fails(where))
        assert roundtrips.is_logic(t, mine, base.i[0], base.i[0], np.random.default_rng(2)) is logic


@pytest.mark.usefixtures("few")
def test_a_nan_turns_the_extremes_red(monkeypatch) -> None:
    right = extremes.record
    monkeypatch.setattr(
        extremes, "record", lambda t, tree, k, nee, F: replace(right(t, tree, k, nee, F), A=F[0] * np.nan)
    )
    assert not all(row.holds for row in rows(extremes.JOB, 0.001, "cornell"))


def tiny_means(monkeypatch) -> list[Row]:
    monkeypatch.setattr(means, "EPS", 0.02)
    return rows(means.JOB, 0.02, "cornell", "hybrid", "across pixels")


def test_reuse_across_pixels_has_no_bias_at_a_tiny_count(monkeypatch) -> None:
    assert all(row.holds for row in tiny_means(monkeypatch))


def test_the_neighbour_whose_sample_is_brighter_turns_the_means_red(monkeypatch) -> None:
    """A mistake: neighbours chosen by their samples."""
    monkeypatch.setattr(means, "spatial", by_brightness)
    assert not any(row.holds for row in tiny_means(monkeypatch))


def by_brightness(X, here, near, chance):
    left, right = random_in_row(here.of, here.index, 2, 20, chance)
    p_left, p_right = (X.x.F.mean(axis=0)[at.index] * X.W[at.index] for at in (left, right))
    brighter = Pixels(here.of, np.where(p_left > p_right, left.index, right.index))
    return RIGHT(X, here, [brighter], chance)


RIGHT = means.spatial


@pytest.mark.usefixtures("few")
def test_techniques_agree_at_a_tiny_count_and_a_wrong_one_does_not(monkeypatch) -> None:
    monkeypatch.setattr(tracing_job, "EPS", 0.02)
    monkeypatch.setattr(comparing, "SIGMA", 5.0)  # t of 19 degrees of freedom, 16 tests: false alarm .1%
    chunks = [{"of": "techniques", "scene": "clear_coat", "part": part} for part in (0, 1)]

    def said() -> list[Row]:
        done = [tracing_job.compute(params, rng=np.random.default_rng(params["part"])) for params in chunks]
        return tracing_job.each_other("clear_coat", done)

    assert all(row.holds for row in said())
    wrong = {**tracing_job.TECHNIQUES, "light samples alone": lambda *of: tracing_job.by_lights(*of) * 1.1}
    monkeypatch.setattr(tracing_job, "TECHNIQUES", wrong)
    assert not all(row.holds for row in said())


@pytest.mark.parametrize("scene", ["crease", "cornell"])
def test_indirect_light_is_found_another_way_and_a_leaf_too_many_is_seen(monkeypatch, scene) -> None:
    """A mistake: all leaves."""
    monkeypatch.setattr(indirect_references, "PANELS", (30, 60))
    monkeypatch.setattr(indirect_references, "FILM", 4)
    monkeypatch.setattr(indirect_references, "LATTICES", 4)
    monkeypatch.setattr(indirect_references, "QUADRATURE", ((256, 4), (512, 8)))
    monkeypatch.setattr(references, "SIGMA", 10.0)  # t of 3 degrees of freedom: false alarm .2%
    monkeypatch.setattr(references, "EPS", 0.02)
    monkeypatch.setattr(references, "SPREAD", 4.0)

    def holds() -> bool:
        return rows(indirect_references.JOB, 0.001, scene)[-1].holds

    assert holds()
    monkeypatch.setattr(indirect_references, "indirect_light", radiance)
    assert not holds()


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("name", ["path reuse, cornell", "ReSTIR GI, glossy", "ReSTIR DI, 1/Z"])
def test_baselines_run(name) -> None:
    asked = baselines.BASELINES[name]
    arrays = baselines.compute({"of": name, "part": 0}, rng=np.random.default_rng(1))
    assert arrays["images.total"].mean() / baselines.REPLICAS == pytest.approx(
        asked.truth(asked.scene).mean.mean(), rel=0.1
    )


@pytest.mark.usefixtures("few")
def test_offline_frames_and_probes_run() -> None:
    assert offline.compute({"rule": "hybrid", "part": 0}, rng=np.random.default_rng(1))["frames"].shape == (8, 128)
    assert len(rows(probes.JOB, 0.001)) == 5 * len(probes.PROBES)


def scattered(count: int, n: int, spread: float, seed: int) -> Array:
    """Independent normal images of mean 1."""
    return 1 + spread * np.random.default_rng(seed).standard_normal((count, n))


def test_the_error_of_means_falls_like_one_over_their_number_whatever_the_truths_own() -> None:
    frames, own = scattered(256, 400, 0.1, 1), np.full(400, 0.02)
    blurred = scattered(1, 400, 0.02, 2)[0]
    found = [offline.error(frames, comparing.Truth(blurred, own, 0.0), T) * T for T in (1, 64)]
    assert found == pytest.approx([0.01, 0.01], rel=0.25)
    blind = offline.error(frames, comparing.Truth(blurred, 0 * own, 0.0), 64) * 64
    assert blind > 0.03


RULES3 = (space_offline.TRUTH, "reconnection", "hybrid")


def test_frames_in_space_are_judged_by_lattices_of_the_same_pixels(monkeypatch) -> None:
    monkeypatch.setattr(space_offline, "LATTICES", 1)
    monkeypatch.setattr(space_offline, "FRAMES", 2)
    found = {rule: space_offline.compute({"rule": rule}, rng=np.random.default_rng(1))["frames"] for rule in RULES3}
    right = found[space_offline.TRUTH].mean()
    assert [images.mean() for images in found.values()] == pytest.approx([right] * 3, rel=0.05)
    assert {params["rule"] for params in space_offline.chunks(0.01)} == {*RULES3}


def crops_reused(monkeypatch, mode: str) -> Row:
    """What a few images of a case in space say; chance allows any spread of so few chunks."""
    case = "CB3", "hybrid", mode
    monkeypatch.setattr(space_means, "CASES", {case: 4})
    monkeypatch.setattr(space_means, "EPS", 0.02)
    (found,) = rows(space_means.JOB, 1.0)
    return found


BETTER = {
    "across pixels": "the frames' own samples",
    "along time, still": "the reference",
    "along time and across pixels, moving": "the reference",
}
"""After a single frame most samples are still a pixel's own."""


@pytest.mark.parametrize("mode", BETTER)
def test_reuse_in_space_has_no_bias_at_a_tiny_count_and_the_better_truth_judges(monkeypatch, mode) -> None:
    found = crops_reused(monkeypatch, mode)
    assert found.holds
    assert found.what.endswith(f"bias against {BETTER[mode]}")
    assert found.error < float(found.note.rpartition(" ")[2].rstrip("%")) / 100


def test_the_brighter_neighbour_turns_the_means_of_space_red(monkeypatch) -> None:
    """A mistake: neighbours chosen by their samples."""
    right = space_means.spatial

    def by_brightness(X, here, near, chance, mis):
        one, other = (X.x.F.mean(axis=0)[at.index] * X.W[at.index] for at in near[:2])
        brighter = np.where(one > other, near[0].index, near[1].index)
        return right(X, here, [Pixels(here.of, brighter)], chance, mis=mis)

    monkeypatch.setattr(space_means, "spatial", by_brightness)
    assert not crops_reused(monkeypatch, "across pixels").holds


class Dimming(PathIntegrals):
    """A mistake: J is too small by a tenth."""

    def shift(self, x, index, to) -> Shifted:
        y = super().shift(x, index, to)
        return Shifted(y.x, 0.9 * y.J)


def test_a_jacobian_that_is_too_small_turns_moving_frames_red(monkeypatch) -> None:
    right = space_means.view
    monkeypatch.setattr(space_means, "view", lambda *asked: right(*asked, integrals=Dimming))
    assert not crops_reused(monkeypatch, "along time and across pixels, moving").holds


def test_path_reuse_shows_the_crops_where_they_are() -> None:
    params = {"scene": "CB3", "rule": "reconnection", "mode": space_means.TILED, "part": 0}
    found = space_means.compute(params, rng=np.random.default_rng(1))["result.total"][0] / space_means.REPLICAS
    truth = space_means.in_cells(space_means.reference("CB3")).mean
    assert found == pytest.approx(truth, rel=1, abs=truth.mean() / 2)
    assert np.corrcoef(found, truth)[0, 1] > 0.95


def test_a_cell_s_error_is_that_of_independent_pixels() -> None:
    image, noise = np.arange(1152.0).reshape(1, -1), np.random.default_rng(1).standard_normal((4000, 1152))
    truth = space_means.in_cells(Reference(image[0], np.full(1152, 0.3), 0.0, 1, ""))
    assert truth.mean.shape == (32,)
    assert truth.mean[:2] == pytest.approx([2.5 + 24 * 2.5, 8.5 + 24 * 2.5])
    assert truth.error == pytest.approx(space_means.cells(0.3 * noise).std(axis=0), rel=0.05)


TRUE = np.linspace(-1, 2, 72)
"""Differences of a square of 9 x 9 pixels, either way."""


def about(true: Array, chunks: int) -> list[Array]:
    """Chunks of 64 noisy images of them."""
    return [scattered(64, len(true), 0.05, part) - 1 + true for part in range(chunks)]


def red_rows(job_of, cases: Sequence[dict[str, str]], wrong: int, factor: dict[str, float]) -> set[str]:
    """What a judge of a square says does not hold when one case's dx or dy, 64 images a chunk, is multiplied."""
    done = [
        (case, {name: d * (factor.get(name, 1) if k == wrong else 1) for name in ("dx", "dy")})
        for k, case in enumerate(cases)
        for d in about(TRUE, 32)
    ]
    return {row.what for row in job_of.judge(done) if not row.holds}


@pytest.mark.parametrize("name", ["dx", "dy"])
@pytest.mark.parametrize("factor", [-1, 1.03])
def test_differences_with_the_wrong_sign_or_size_turn_their_row_of_a_square_red_and_no_other(name, factor) -> None:
    methods, modes = [*space_gradients.CHUNKS], [*map_gradients.CASES]
    for k in range(1, len(methods)):
        found = red_rows(space_gradients.JOB, [{"method": each} for each in methods], k, {name: factor})
        assert found == {f"Checker3, moving, {methods[k]}: bias of {name}"}
    for k in range(1, len(modes)):
        found = red_rows(map_gradients.JOB, [{"mode": each} for each in modes], k, {name: factor})
        assert found == {f"map of occluders, {modes[k]}: bias of {name}"}
    assert not red_rows(space_gradients.JOB, [{"method": each} for each in methods], 1, {})


def test_rows_of_gradients_run_and_those_with_the_wrong_sign_and_mistakes_that_are_none_turn_red(monkeypatch) -> None:
    cases = {("checker", "path tracing", "frame 1"): (12, 0.02), ("occluders", "w = 1/2", "frame 1"): (8, 0.01)}
    for module in (gradients, row_gradients):
        monkeypatch.setattr(module, "CASES", cases)
    assert all(row.holds for row in rows(row_gradients.JOB, 1.0))
    monkeypatch.setattr(gradients, "METHODS", {"path tracing": turned, "w = 1/2": gradients.path_traced})
    assert not any(row.holds for row in rows(row_gradients.JOB, 1.0))


def turned(*of):
    """A mistake: the difference of the wrong pixel."""
    found = gradients.path_traced(*of)
    return found | {"dx": -found["dx"]}


def chunks_of(images: Array) -> list[dict[str, Array]]:
    """Chunks (K, R, n) as the job keeps them."""
    return [gradients.summed(each, "image") for each in images]


def test_means_of_images_that_share_noise_are_seen_not_to_fall() -> None:
    noise = np.random.default_rng(1).standard_normal((200, 64, 32))
    alone = averaging.falling("", "", chunks_of(3 + noise), "image")
    shared = averaging.falling("", "", chunks_of(3 + noise + 0.5 * noise.repeat(2, axis=1)[:, :64]), "image")
    assert [row.holds for row in alone] == [True, True]
    assert [row.holds for row in shared] == [False, False]
    assert alone[1].error < 0.02


def test_probes_of_mutations_run_and_their_truth_is_theirs(monkeypatch) -> None:
    monkeypatch.setattr(mutations, "REPLICAS", 12)
    monkeypatch.setattr(mutations, "lattice", lambda D: lattice(D)[:, ::64])
    rng = np.random.default_rng(1)
    found = mutations.compute({"of": "case", "case": "clear coat, lobe jumped", "part": 0}, rng=rng)
    truth = mutations.compute({"of": "truth", "case": "clear_coat", "part": 0}, rng=rng)
    right = joined([truth], "constant").mean.mean()
    for stage in ("mutation", "spatial"):
        assert joined([found], f"constant, {stage}").mean.mean() == pytest.approx(right, rel=0.1)
    assert len(found) == 3 * 2 * len(mutations.PROBES)
    assert {params["case"] for params in mutations.chunks(0.01)} == {*mutations.EVERY, *mutations.CHUNKS}


def test_differences_that_telescope_to_nothing_have_a_mean_of_one_by_their_signs() -> None:
    true = np.array([0.5, -2.0, 1.5])
    assert true.sum() == 0
    assert signing.signed(true[None], true).mean() == pytest.approx(1)


def test_variances_of_means_of_half_of_all_images_are_unbiased() -> None:
    images = 3 + np.random.default_rng(1).standard_normal((32, 20_000))
    found = averaging.ratios(averaging.squares(images)[None], images.sum(axis=0)[None], len(images))
    assert np.allclose(found, 0, atol=0.05)
