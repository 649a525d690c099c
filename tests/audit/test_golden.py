"""The golden vectors are what the core computes, what a second implementation computes exactly, and safe in float32."""

import json
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest

from restir_ref.audit import KNOWN, audit_dump, golden_vectors, make_golden
from restir_ref.audit.fields import FORMAT, RESULTS, VERSION
from restir_ref.audit.golden import file_name
from restir_ref.audit.make_golden import files, text
from restir_ref.mis import WEIGHTS
from tests.audit.planted import PLANTED
from tests.audit.shader import Column, Result, Shader, column, converted
from tests.checkout import ROOT

DATA = ROOT / "restir_ref" / "audit" / "data"
VECTORS = {mis: golden_vectors(mis) for mis in KNOWN}
CASES = {f"{mis}: {case['name']}": (mis, case) for mis, file in VECTORS.items() for case in file["cases"]}
every_weight = pytest.mark.parametrize("mis", VECTORS)
FLOAT32_MARGIN = 0.01


@cache
def made() -> dict[str, str]:
    return files()


def columns(case: Any) -> list[Column]:
    inputs = {name: np.asarray(values) for name, values in case["inputs"].items()}
    return [column(inputs, n) for n in range(inputs["p_hat"].shape[1])]


def run(case: Any, mis: str, number: Any, shader: type[Shader] = Shader) -> list[tuple[Result, Result]]:
    """By inversion and streaming, in every column."""
    u, streamed = (np.asarray(case["inputs"][name]) for name in ("u", "u_stream"))
    made = [shader(converted(each, number), mis) for each in columns(case)]
    return [
        (each.run(number(u[n])), each.run(streamed=[number(k) for k in streamed[:, n]])) for n, each in enumerate(made)
    ]


def faults(case: Any, results: list[tuple[Result, Result]], kind: str) -> list[str]:
    """Terms that are not as expected within the tolerance of a kind of numbers."""
    found: dict[str, Any] = {name: [getattr(one, name) for one, _ in results] for name in RESULTS}
    found |= {f"{name}_stream": [getattr(other, name) for _, other in results] for name in ("s", "W_Y")}
    wrong = []
    for name, expected in case["expected"].items():
        tolerance = Fraction(case["tolerance"][kind].get(name.removesuffix("_stream"), 0))
        theirs = np.array(found[name], dtype=object).T.reshape(-1).tolist()
        ours = np.array(expected, dtype=object).reshape(-1).tolist()
        counts = np.ravel(case["matters"]).tolist() if name == "m" else [1] * len(ours)
        off = [
            abs(Fraction(float(a)) - Fraction(b)) > tolerance * Fraction(b) for a, b in zip(theirs, ours, strict=True)
        ]
        wrong += [name] if any(o and k for o, k in zip(off, counts, strict=True)) else []
    return wrong


def failing(mis: str, number: Any, kind: str) -> dict[str, list[str]]:
    """Cases of a weight whose terms are off in a kind of numbers."""
    cases = [case for case in VECTORS[mis]["cases"] if case[kind]] if kind == "float32" else VECTORS[mis]["cases"]
    found = {case["name"]: faults(case, run(case, mis, number), kind) for case in cases}
    return {name: terms for name, terms in found.items() if terms}


# ---------------------------------------------------------------- second opinions


@every_weight
def test_exact_fractions_agree_with_the_golden_vectors(mis) -> None:
    assert failing(mis, Fraction, "float64") == {}


@every_weight
def test_a_plain_float64_implementation_stays_within_the_tolerances(mis) -> None:
    assert failing(mis, float, "float64") == {}


@every_weight
def test_a_plain_float32_implementation_stays_within_the_tolerances(mis) -> None:
    assert failing(mis, np.float32, "float32") == {}


def test_float32_fails_where_the_golden_vectors_say_it_may() -> None:
    mis, case = CASES["talbot: beyond float32"]
    with np.errstate(all="ignore"):
        assert not all(np.isfinite(each.w_sum) for each, _ in run(case, mis, np.float32))


@every_weight
def test_float32_does_not_pass_for_float64(mis) -> None:
    safe = [case for case in VECTORS[mis]["cases"] if case["float32"]]
    assert {"w", "w_sum", "W_Y"} <= {
        name for case in safe for name in faults(case, run(case, mis, np.float32), "float64")
    }


@every_weight
def test_the_inputs_are_the_same_numbers_in_float32(mis) -> None:
    safe = [values for case in VECTORS[mis]["cases"] if case["float32"] for values in case["inputs"].values()]
    numbers = np.concatenate([np.ravel(np.asarray(values, dtype=float)) for values in safe])
    assert np.array_equal(numbers.astype(np.float32).astype(float), numbers)


@every_weight
def test_no_rounding_can_flip_a_choice(mis) -> None:
    margins = [np.ravel(margin) for case in VECTORS[mis]["cases"] for margin in case["margin"].values()]
    assert np.concatenate(margins).min() > FLOAT32_MARGIN


def shifted(case: Any, name: str, by: float) -> Any:
    margin = np.asarray(case["margin"][name])
    return np.clip(np.asarray(case["inputs"][name]) + by * margin, 0, 1 - 2.0**-24)


@every_weight
@pytest.mark.parametrize("by", [-1, 1])
def test_numbers_moved_by_their_margin_choose_the_same(mis, by) -> None:
    for case in VECTORS[mis]["cases"]:
        moved = {name: shifted(case, name, by * (1 - 1e-9)) for name in ("u", "u_stream")}
        results = run({**case, "inputs": {**case["inputs"], **moved}}, mis, float)
        assert [one.s for one, _ in results] == case["expected"]["s"]
        assert [other.s for _, other in results] == case["expected"]["s_stream"]


@every_weight
def test_numbers_moved_by_a_little_more_choose_otherwise(mis) -> None:
    """Margins are rounded down to 1e-4 and are at least 0.05."""
    for case in VECTORS[mis]["cases"]:
        moved = [{**case["inputs"], "u": shifted(case, "u", by)} for by in (-1.003, 1.003)]
        runs = [run({**case, "inputs": inputs}, mis, float) for inputs in moved]
        s = np.array([[one.s for one, _ in results] for results in runs])
        lone = np.asarray(case["margin"]["u"]) == 1
        assert ((s != case["expected"]["s"]).any(axis=0) | lone).all()


# ---------------------------------------------------------------- the core


@every_weight
@pytest.mark.parametrize(("numbers", "ending"), [("u", ""), ("u_stream", "_stream")])
def test_the_audit_of_dumps_agrees(mis, numbers, ending) -> None:
    for case in VECTORS[mis]["cases"]:
        given = {name: values for name, values in case["inputs"].items() if name not in ("u", "u_stream")}
        results = {name: case["expected"].get(name + ending, case["expected"][name]) for name in RESULTS}
        dump = {"format": FORMAT, "version": VERSION, "mis": mis, **given, numbers: case["inputs"][numbers], **results}
        report = audit_dump(dump, rtol=1e-12)
        assert report.right, report


def test_every_weight_has_vectors_and_every_case_says_what_it_is_about() -> None:
    assert WEIGHTS.keys() <= VECTORS.keys()
    special = {
        "plain",
        "unequal supports",
        "nulls",
        "caps",
        "confidences",
        "one input",
        "all canonical",
        "two canonical",
    }
    for mis, file in VECTORS.items():
        assert file["mis"] == mis
        assert special <= {case["name"] for case in file["cases"]}
        assert all(len(case["about"]) > 5 for case in file["cases"])


def test_the_special_cases_are_special() -> None:
    cases = {case["name"]: case for case in VECTORS["talbot"]["cases"]}
    assert np.array(cases["nulls"]["expected"]["w_sum"])[[2, 3]].tolist() == [0, 0]
    assert np.array(cases["nulls"]["expected"]["c_Y"]).min() > 0
    assert (np.array(cases["unequal supports"]["inputs"]["J"]) == 0).any()
    assert (np.array(cases["unequal supports"]["inputs"]["p_hat_from"]) == 0).any()
    assert np.array(cases["caps"]["expected"]["c_Y"]).max() <= 9 < np.array(cases["caps"]["inputs"]["c"]).max()
    assert cases["first and last"]["inputs"]["u"][:2] == [0, 1 - 2**-24]


# ---------------------------------------------------------------- twins


@pytest.mark.parametrize("name", [name for name in PLANTED if "0/0" not in name])  # fractions have no NaN
def test_a_planted_mistake_fails_some_golden_vector(name) -> None:
    shader, mis, _, _ = PLANTED[name]
    assert any(faults(case, run(case, mis, float, shader), "float32") for case in VECTORS[mis]["cases"])


@pytest.mark.parametrize("term", [*RESULTS, "s_stream", "W_Y_stream"])
def test_a_changed_number_in_the_golden_vectors_is_noticed(term) -> None:
    mis, case = CASES["defensive: confidences"]
    changed = np.array(case["expected"][term], dtype=float)
    changed[..., 0] = changed[..., 0] * 1.00001 if term not in ("s", "s_stream") else (changed[0] + 1) % 3
    spoiled = {**case, "expected": {**case["expected"], term: changed.tolist()}}
    assert faults(spoiled, run(case, mis, Fraction), "float32") == [term]


# ---------------------------------------------------------------- files


def test_the_shipped_files_are_made_anew_byte_by_byte() -> None:
    assert {path.name: path.read_bytes() for path in DATA.iterdir()} == {n: t.encode() for n, t in made().items()}


def test_the_command_writes_and_checks_files(tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setattr(make_golden, "files", made)
    assert make_golden.main([str(tmp_path / "new")]) == 0
    assert make_golden.main(["--check", str(tmp_path / "new")]) == 0
    (tmp_path / "new" / "talbot.json").write_text("{}")
    (tmp_path / "new" / "pairwise.json").unlink()
    assert make_golden.main(["--check", str(tmp_path / "new")]) == 1
    assert "stale: talbot.json, pairwise.json" in capsys.readouterr().out


def test_the_files_are_plain_json_and_small() -> None:
    assert made().keys() == {file_name(mis) for mis in KNOWN}
    assert sum(map(len, made().values())) < 300_000
    for contents in made().values():
        assert json.loads(contents, parse_constant=pytest.fail)["version"] == VERSION
        assert contents.isascii()


def test_text_keeps_every_bit_of_a_number() -> None:
    numbers = [0.1, 1 / 3, 2.0**-1074, 1e300, 3.0]
    assert json.loads(text({"x": np.array(numbers)}))["x"] == numbers


def test_unknown_weights_have_no_golden_vectors() -> None:
    with pytest.raises(ValueError, match="no golden vectors for 'balance' weights, only for 'talbot'"):
        golden_vectors("balance")
