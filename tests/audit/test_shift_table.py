"""A shift that is only rows of (x, y, J): its slope, its way back, and clamps; undecided is not kept."""

import json
from pathlib import Path

import numpy as np
import pytest

from flatland2d import SCENES
from restir_ref.audit import shift_table
from restir_ref.audit.__main__ import main
from restir_ref.audit.shift_table import TableReport, audit_shift_table
from restir_ref.batch import Array, take
from restir_ref.chance import Live
from restir_ref.transport.paths import RECONNECTION, Connectability, Tracer
from restir_ref.transport.paths import Path as LightPath
from restir_ref.transport.proofs.inversion import primary_sample, traced
from restir_ref.transport.proofs.judge import Shifting, judge, report
from restir_ref.transport.proofs.shift_checks import Effort
from restir_ref.transport.shifts import shift_path

X = np.random.default_rng(1).random((2, 20_000))


def squeezed(x: Array) -> tuple[Array, Array]:
    """y = (x_0^2, x_1 / (1 + x_0)): a curved shift of the square, with its slope."""
    return np.stack([x[0] ** 2, x[1] / (1 + x[0])]), 2 * x[0] / (1 + x[0])


Y, J = squeezed(X)


def said(J: Array, **more: Array) -> TableReport:
    return audit_shift_table(X, Y, J, **more)


def test_rows_of_a_right_shift_keep_all_laws() -> None:
    found = said(J, back=X, J_back=1 / J)
    assert found.right, found
    assert [law.answer for law in found.laws] == ["kept"] * 3
    assert str(found).startswith("right, as far as the table shows")
    assert found.extremes == (pytest.approx(J.min()), pytest.approx(J.max()))


WRONG = {
    "left out": (np.ones(len(J)), "slope"),
    "inverted": (1 / J, "slope"),
    "squared": (J**2, "slope"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_jacobian_breaks_the_slope(name) -> None:
    wrong, law = WRONG[name]
    assert str(said(wrong)).startswith(f"WRONG: {law}")


def test_a_clamped_jacobian_is_told_from_its_ends() -> None:
    found = said(np.clip(J, 0.4, 0.8))
    assert {each.value for each in found.plateaus} == {0.4, 0.8}
    assert not found.right


def test_a_way_back_that_is_refused_or_leads_elsewhere_is_broken() -> None:
    refused = said(J, back=X, J_back=np.where(J > 0.6, 1 / J, 0))
    assert "inverse Jacobians" in str(refused).splitlines()[0]
    elsewhere = said(J, back=(X + 0.1) % 1, J_back=1 / J)
    assert "way back" in str(elsewhere).splitlines()[0]


def test_too_few_rows_are_undecided_and_acquit_nobody() -> None:
    found = audit_shift_table(X[:, :30], Y[:, :30], J[:30])
    assert not found.right
    assert str(found).startswith("UNDECIDED: slope")
    assert found.status == 3


def test_rows_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match=r"x \(2, 20000\), y \(2, 20000\), J \(3,\)"):
        audit_shift_table(X, Y, J[:3])


# ---------------------------------------------------------------- shifts of paths, by the judge


def convicted(by) -> str:
    """What the judge says of somebody's shift in the glossy box."""
    setting = SCENES["glossy_cornell"]()
    tracer = Tracer(setting.scene, setting.pinhole(1920, 0), setting.depth, Connectability(0.2, 0.02))
    return report(judge(Shifting(tracer, by), Live(np.random.default_rng(1)), Effort(paths=4000, jacobians=100)))


def test_reconnections_whose_jacobian_is_clamped_are_convicted_by_finite_differences() -> None:
    def clamped(t: Tracer, x: LightPath, pixel: Array) -> tuple[LightPath, Array]:
        y, J = shift_path(t, x, pixel)
        return y, np.where(J > 0, np.clip(J, 0.5, 2.0), 0)

    said = convicted(clamped)
    assert "RED       finite differences" in said
    assert "J: found" in said


# ---------------------------------------------------------------- extremes


def test_a_jacobian_that_is_wrong_at_its_extreme_only_is_broken_by_that_stratum() -> None:
    """Of 20 000 rows some 300: fewer than one in fifty."""
    wrong = np.where(J < 0.03, J / 8, J)
    (law,) = said(wrong).laws
    assert law.broken < law.tested / 50
    assert law.answer == "broken"
    assert "most of those with J from" in str(law)
    assert law.stratum[1] < 0.03


def test_without_strata_it_would_be_kept(monkeypatch) -> None:
    monkeypatch.setattr(shift_table, "STRATA", 1)
    assert said(np.where(J < 0.03, J / 8, J)).laws[0].answer == "kept"


def test_a_clamp_beyond_the_jacobians_of_the_table_does_not_show_and_the_range_is_said() -> None:
    found = said(np.clip(J, 1e-6, 10))
    assert found.right
    assert f"J is {J.min():.4g} to {J.max():.4g} where it is defined: limits beyond do not show" in str(found)


SHIFTS = {
    "identity": lambda x: (x, np.ones(x.shape[1])),
    "rotation": lambda x: ((x + 0.3) % 1, np.ones(x.shape[1])),
    "steep": lambda x: (np.stack([x[0] ** 5, x[1]]), 5 * x[0] ** 4),
    "root": lambda x: (np.stack([np.sqrt(x[0]), x[1] ** 2]), x[1] / np.sqrt(x[0])),
    "exponential": lambda x: (np.stack([np.exp(6 * x[0] - 6), x[1]]), 6 * np.exp(6 * x[0] - 6)),
    "holes": lambda x: (x**2, np.where(x[0] > x[1], 4 * x[0] * x[1], 0)),
}


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", SHIFTS)
def test_no_right_shift_is_accused(name, seed) -> None:
    x = np.random.default_rng(seed).random((2, 20_000))
    y, slope = SHIFTS[name](x)
    assert not audit_shift_table(x, y, slope).wrong


@pytest.mark.parametrize("wrong", [lambda J: J * 1.3, np.sqrt, lambda J: np.clip(J, 0.3, 1.5)])
@pytest.mark.parametrize("name", ["steep", "root", "exponential"])
def test_their_wrong_jacobians_are(name, wrong) -> None:
    y, slope = SHIFTS[name](X)
    assert audit_shift_table(X, y, wrong(slope)).wrong


# ---------------------------------------------------------------- rows as a shader writes them


def of_paths(change) -> dict[str, Array]:
    """A reconnection in the glossy box: the two numbers of the first direction vary, the others are held; float32."""
    setting = SCENES["glossy_cornell"]()
    t = Tracer(setting.scene, setting.pinhole(1920, 0), setting.depth, RECONNECTION)
    rng = np.random.default_rng(3)
    u = np.repeat(rng.random((t.D, 1)), 20_000, axis=1)
    u[1:3] = rng.random((2, 20_000))
    i, j, k = (np.full(20_000, each) for each in (500, 900, 2))
    x = traced(t, u, i, k, k > 0)
    y, J = shift_path(t, x, j)
    n = np.flatnonzero((J > 0) & (x.c == 2))
    v = primary_sample(t, take(x, n), i[n], t, take(y, n), j[n])
    return {"x": u[1:3, n].astype("f4"), "y": v[1:3].astype("f4"), "J": change(J[n]).astype("f4")}


def test_the_rows_of_a_path_shift_are_kept_and_its_mistakes_are_broken() -> None:
    right = audit_shift_table(**of_paths(lambda J: J))
    assert right.right, right
    assert right.laws[0].tested > 3000
    for wrong in (np.ones_like, lambda J: 1 / J, lambda J: np.clip(J, 0.8, 1.25)):
        assert audit_shift_table(**of_paths(wrong)).those("broken") == ["slope"]


def test_numbers_that_are_none_are_told_with_their_row() -> None:
    found = said(np.where(np.arange(len(J)) == 7, np.nan, J))
    assert str(found).startswith("WRONG: numbers\n  broken    numbers: 1 of 20000 rows are off; worst in row 7")
    assert said(np.where(np.arange(len(J)) == 9, -1.0, J)).those("broken") == ["numbers"]


def test_the_worst_row_has_the_number_it_has_in_the_table() -> None:
    wrong = np.where(np.arange(len(J)) == 0, np.nan, np.where(np.arange(len(J)) == 5, 100.0, J))
    assert said(wrong).laws[1].worst[0] == 5


# ---------------------------------------------------------------- the command


def written(path: Path, **table: Array) -> str:
    """A table as .csv, .npz or .json."""
    rows = {
        f"{name}[{k}]" if np.ndim(each) > 1 else name: row
        for name, each in table.items()
        for k, row in enumerate(np.atleast_2d(each))
    }
    if path.suffix == ".csv":
        np.savetxt(path, np.stack([*rows.values()], axis=1), "%.9g", ",", header=",".join(rows), comments="")
    elif path.suffix == ".npz":
        np.savez(path, **table)
    else:
        path.write_text(json.dumps({name: each.tolist() for name, each in table.items()}), encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    ("rows", "change", "status", "said"),
    [
        (4000, lambda J: J, 0, "right, as far as the table shows"),
        (4000, lambda J: 1 / J, 1, "WRONG: slope"),
        (4000, lambda J: np.minimum(J, 0.999), 1, "SUSPICIOUS: J looks clamped"),
        (30, lambda J: J, 3, "UNDECIDED: slope"),
    ],
)
def test_the_command_says_which_answer_it_is_by_its_status(rows, change, status, said, tmp_path, capsys) -> None:
    table = {"x": X[:, :rows], "y": Y[:, :rows], "J": change(J[:rows])}
    for suffix in (".csv", ".npz", ".json"):
        assert main(["shift", written(tmp_path / f"rows{suffix}", **table)]) == status
        assert capsys.readouterr().out.startswith(said)


def test_the_way_back_is_read_too(tmp_path, capsys) -> None:
    table = {"x": X, "y": Y, "J": J, "back": X, "J_back": np.where(J > 0.6, 1 / J, 0)}
    assert main(["shift", written(tmp_path / "rows.csv", **table)]) == 1
    assert capsys.readouterr().out.startswith("WRONG: inverse Jacobians\n")


NO_TABLES = {
    "no J": ({"x": X, "y": Y}, "has no J: write x[0]"),
    "misspelt": ({"x": X, "y": Y, "J": J, "jback": J}, "has a field 'jback'"),
    "other lengths": ({"x": X, "y": Y[:, :9], "J": J}, "the shapes are x (2, 20000), y (2, 9)"),
    "words": ({"x": X, "y": Y, "J": np.array(["a"] * len(J))}, "J holds no table of numbers"),
    "one number": ({"x": X, "y": Y, "J": np.array(3.0)}, "the shapes are"),
}


@pytest.mark.parametrize("name", NO_TABLES)
def test_what_is_no_table_is_refused_in_one_line(name, tmp_path, capsys) -> None:
    table, said = NO_TABLES[name]
    assert main(["shift", written(tmp_path / "rows.npz", **table)]) == 2
    error = capsys.readouterr().err
    assert error.startswith("cannot read the table: ")
    assert said in error
    assert len(error.splitlines()) == 1


@pytest.mark.parametrize("name", ["rows.csv", "rows.npz", "rows.json", "rows.txt", "no.csv"])
def test_damaged_files_are_refused_in_one_line(name, tmp_path, capsys) -> None:
    if name != "no.csv":
        (tmp_path / name).write_bytes(b"x[0],y[0],J\n1,2\n\x00\xff")
    assert main(["shift", str(tmp_path / name)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def damaged(whole: bytes, rng: np.random.Generator) -> bytes:
    """Bytes changed, cut out, doubled, or replaced by words that numbers are mistaken for."""
    at, length = int(rng.integers(len(whole))), int(rng.integers(1, 40))
    words = (
        b"",
        b"nan",
        b"-inf",
        b"1e999",
        b",,",
        b"\n\n",
        b"\x00",
        b"[[",
        whole[at : at + length] * 2,
        rng.bytes(length),
    )
    return whole[:at] + words[int(rng.integers(len(words)))] + whole[at + length :]


@pytest.mark.parametrize("suffix", [".csv", ".json", ".npz"])
def test_any_damage_yields_a_report_or_a_refusal_in_one_line(suffix, tmp_path, capsys) -> None:
    table = {"x": X[:, :60], "y": Y[:, :60], "J": J[:60], "back": X[:, :60], "J_back": 1 / J[:60]}
    path, rng, statuses = tmp_path / f"rows{suffix}", np.random.default_rng(7), set()
    whole = Path(written(path, **table)).read_bytes()
    for _ in range(150):
        path.write_bytes(damaged(whole, rng))
        status = main(["shift", str(path)])
        out, err = capsys.readouterr()
        statuses.add(status)
        if status == 2:
            assert (out, len(err.splitlines())) == ("", 1)
        else:
            assert out.startswith(("right", "WRONG", "SUSPICIOUS", "UNDECIDED"))
            assert err == ""
    assert statuses == {2} if suffix == ".npz" else {2} < statuses  # archives have checksums
