"""Dumps that cannot be read: the message names the field, its value and the remedy."""

import json
import pickle
import re
from typing import Any

import numpy as np
import pytest

from restir_ref.audit import BadDump, audit_dump
from restir_ref.audit.fields import ARRAYS, DENSITIES, INPUTS, OPTIONS, RESULTS
from tests.audit.planted import fields
from tests.audit.shader import dumped
from tests.checkout import ROOT

RIGHT = dumped(fields(n=4), "talbot")
M, N = RIGHT["p_hat"].shape


def without(*names: str) -> dict[str, Any]:
    return {name: values for name, values in RIGHT.items() if name not in names}


def having(**changed: Any) -> dict[str, Any]:
    return {**RIGHT, **changed}


def spoiled(name: str, value: float) -> dict[str, Any]:
    bad = np.array(RIGHT[name], dtype=float)
    bad[..., 1] = value
    return having(**{name: bad})


BAD = {
    "no format": (without("format"), "'format' is 'None'", "no dump of a pass"),
    "somebody else's format": (having(format="reservoirs"), "'format' is 'reservoirs'", "not 'restir-ref dump'"),
    "a later version": (having(version=2), "'version' is 2", "reads version 1"),
    "an unknown weight": (having(mis="balance"), "'mis' is 'balance'", "one of 'talbot', 'pairwise'"),
    "no weight": (without("mis"), "'mis' is 'None'", "one of 'talbot'"),
    "no target": (without("p_hat"), "no 'p_hat' (p_hat(y_i)", "write what the pass used"),
    "no weights": (without("W", "J"), "no 'W' (contribution weights", "write what the pass used"),
    "nothing to judge": (without("p_hat_from", "m", "w"), "no 'p_hat_from'", "one of them: write what the pass"),
    "no given weights": ({**without("m", "w"), "mis": "given"}, "no 'm'", "'given' weights need"),
    "a foreign field": (having(roughness=1), "unknown field 'roughness'", "fields are canonical"),
    "cap 0": (having(cap=0.0), "'cap' is 0", "must be positive"),
    "no canonical confidence": ({**spoiled("c", 0), "mis": "defensive"}, "column 1 has none", "null samples"),
    "u above 1": (spoiled("u", 1.5), "'u' is 1.5 at [1] (1 of 4", "below 1"),
    "u that is no number": (spoiled("u", np.nan), "'u' is nan at [1]", "below 1"),
    "one field with columns first": (having(W=RIGHT["W"].T), "'W' has shape (4, 3)", "columns last"),
    "another precision": (having(precision="fp24"), "'precision' says 'fp24'", "double, float, half"),
    "a precision of nothing": (having(precision="W=half, m"), "'precision' is 'W=half, m'", "W=half, m=float"),
    "a precision that is no error": (having(precision={"W": 2}), "'precision' says 2.0", "below 1"),
    "one half of the pieces": (having(J_back=RIGHT["p_hat_from"]), "no 'p_hat_back'", "write what the pass used"),
    "a name of RTXDI": (having(weightSum=1), "unknown field 'weightSum'", "in RTXDI"),
    "a name of ReSTIR PT": (having(misWeight=1), "unknown field 'misWeight'", "it may be 'm'"),
    "a typing error": (having(w_Y=1), "unknown field 'w_Y'", "did you mean 'W_Y'?"),
    "one input without its axis": (having(p_hat=RIGHT["p_hat"][0]), "'p_hat' has shape (4,)", "two axes (M, N)"),
    "no columns": (having(p_hat=np.zeros((3, 0))), "'p_hat' has shape (3, 0)", "at least one of each"),
    "one confidence for all": (having(c=1.0), "'c' has shape ()", "(M, N) are (3, 4)"),
    "a scalar for two": (having(cap=[1.0, 2.0]), "'cap' has shape (2,)", "() are ()"),
    "a flat matrix": (having(p_hat_from=RIGHT["p_hat"]), "'p_hat_from' has shape (3, 4)", "(3, 3, 4)"),
    "ragged rows": (having(W=[[1, 2], [3]]), "'W' is no rectangular array", "the same length"),
    "words": (having(W=[["a"] * N] * M), "'W' holds <U1", "real numbers"),
    "nothing": (having(W=None), "'W' holds object", "real numbers"),
    "complex numbers": (having(W=RIGHT["W"] * 1j), "'W' holds complex128", "real numbers"),
    "half canonical": (having(canonical=[0.5, 0, 0]), "'canonical' is 0.5 at [0]", "a whole number below 2"),
    "an input that is not there": (spoiled("s", 3), "'s' is 3.0 at [1]", "a whole number below 3"),
    "half an input": (spoiled("s", 0.5), "'s' is 0.5 at [1]", "a whole number below 3"),
    "two ways to select": (having(u_stream=RIGHT["W"] * 0), "both 'u' and 'u_stream'", "leave out the one"),
    "no way to select": (without("u", "s"), "'W_Y' depends on which input was selected", "write 's'"),
    "no canonical input": (having(mis="pairwise", canonical=[0, 0, 0]), "'pairwise' weights need", "'canonical' 1"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_bad_dump_is_refused_with_field_value_and_remedy(name) -> None:
    bad, value, remedy = BAD[name]
    with pytest.raises(BadDump) as refused:
        audit_dump(bad)
    assert value in str(refused.value)
    assert remedy in str(refused.value)


def test_the_right_dump_beside_them_is_right() -> None:
    assert audit_dump(RIGHT).right
    assert audit_dump(having(note="frame 12", note_of_tuesday="again")).right


# ---------------------------------------------------------------- files


def as_json(values: dict[str, Any]) -> str:
    return json.dumps({name: v.tolist() if isinstance(v, np.ndarray) else v for name, v in values.items()})


def as_csv(values: dict[str, Any]) -> str:
    """Words and numbers without columns first, then one column per number of a pixel."""
    whole = ["mis", "canonical", "cap"]
    head = [f"# {name},{' '.join(map(str, np.ravel(values[name])))}" for name in whole if name in values]
    columns = {
        name + "".join(f"[{i}]" for i in place): np.asarray(values[name])[place]
        for name in values
        if name not in (*whole, "format", "version")
        for place in np.ndindex(np.shape(values[name])[:-1])
    }
    rows = zip(*columns.values(), strict=True)
    return "\n".join([*head, ",".join(columns), *(",".join(map(repr, map(float, row))) for row in rows)])


def test_all_kinds_of_files_are_read(tmp_path) -> None:
    np.savez(tmp_path / "pass.npz", **RIGHT)
    np.savez_compressed(tmp_path / "small.NPZ.npz", **RIGHT)
    (tmp_path / "pass.json").write_text(as_json(RIGHT))
    (tmp_path / "bom.json").write_text(as_json(RIGHT), encoding="utf-8-sig")
    (tmp_path / "pass.csv").write_text(as_csv(RIGHT))
    for path in tmp_path.iterdir():
        assert audit_dump(path).right
        assert audit_dump(str(path)).right


def pickled(path) -> None:
    np.savez(path, **having(W=np.array([{"a": 1}], dtype=object)))


def written(text: str):
    return lambda path: path.write_text(text, encoding="utf-8")


def one_array(path) -> None:
    with path.open("wb") as file:
        np.save(file, np.ones(3))


def cut_short(path) -> None:
    np.savez(path, **RIGHT)
    path.write_bytes(path.read_bytes()[:-200])


def flipped(path) -> None:
    np.savez(path, **RIGHT)
    content = bytearray(path.read_bytes())
    start = content.index(b"NUMPY")
    content[start : start + 5] = b"XXXXX"
    path.write_bytes(bytes(content))


BAD_FILES = {
    "missing": ("a.npz", lambda path: None, "there is no file", "pass a dump"),
    "another kind": ("a.exr", written("x"), "a.exr is neither .npz nor .json", "numpy.savez"),
    "a field twice": ("a.json", written('{"W": [[1]], "W": [[2]]}'), "the field 'W' comes twice", "every field once"),
    "no names": ("a.csv", written("# mis,talbot"), "a.csv has no line of names", "write p_hat[0]"),
    "short lines": ("a.csv", written("p_hat[0],W[0]\n1"), "lines of other lengths than its 2 names", "one number each"),
    "words in a table": ("a.csv", written("p_hat[0]\nx"), "a.csv is no table", "one line of numbers"),
    "a gap": ("a.csv", written("p_hat[0],p_hat[2]\n1,1"), "'p_hat' has 2 columns", "write all of them"),
    "a column without a name": ("a.csv", written("p hat\n1"), "'p hat' has no name", "like W_Y"),
    "a column twice": ("a.csv", written("W[0],W[0]\n1,1"), "names a column twice", "every column once"),
    "no archive": ("a.npz", written("this is no zip file"), "a.npz is", "numpy.savez"),
    "empty": ("a.npz", written(""), "a.npz is", "numpy.savez"),
    "cut short": ("a.npz", cut_short, "a.npz is", "numpy.savez"),
    "damaged inside": ("a.npz", flipped, "a.npz is", "numpy.savez"),
    "one array": ("a.npz", one_array, "a.npz is", "numpy.savez"),
    "pickled": ("a.npz", pickled, "pickled objects, which are not read", "plain arrays"),
    "a pickle": ("a.npz", lambda path: path.write_bytes(pickle.dumps(RIGHT)), "a.npz is", "numpy.savez"),
    "no JSON": ("a.json", written("{'W': 1}"), "a.json is no JSON", "one object"),
    "binary as JSON": ("a.json", lambda path: path.write_bytes(b"\x93NUMPY\xff"), "a.json is no JSON", "one object"),
    "a list": ("a.json", written("[1, 2]"), "a.json holds a JSON list", "name the fields"),
    "deep nesting": ("a.json", written("[" * 100_000), "a.json is no JSON", "one object"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_a_bad_file_is_refused_with_its_name_and_the_remedy(name, tmp_path) -> None:
    file, write, value, remedy = BAD_FILES[name]
    write(tmp_path / file)
    with pytest.raises(BadDump) as refused:
        audit_dump(tmp_path / file)
    assert value in str(refused.value)
    assert remedy in str(refused.value)


def test_no_code_of_a_pickle_runs(tmp_path) -> None:
    class Evil:
        def __reduce__(self):
            return (open, (str(tmp_path / "run"), "w"))

    np.savez(tmp_path / "a.npz", **having(W=np.array([Evil()], dtype=object)))
    with pytest.raises(BadDump):
        audit_dump(tmp_path / "a.npz")
    assert not (tmp_path / "run").exists()


# ---------------------------------------------------------------- the page about it


def test_the_page_names_every_field_and_its_axes() -> None:
    page = (ROOT / "docs" / "audit.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \| \(?([MN, ]*|number)\)? \|", page, re.MULTILINE))
    axes = {name: ", ".join(field.axes) or "number" for name, field in ARRAYS.items()}
    assert rows == axes
    assert ARRAYS == {**INPUTS, **DENSITIES, **OPTIONS, **RESULTS}


# ---------------------------------------------------------------- numbers that are none


@pytest.mark.parametrize("name", ["p_hat", "W", "J", "c", "p_hat_own", "p_hat_from"])
@pytest.mark.parametrize(("value", "said"), [(np.nan, "not finite"), (np.inf, "not finite"), (-1, "negative")])
def test_an_input_that_is_no_number_is_reported_with_its_place_and_the_rest_is_compared(name, value, said) -> None:
    report = audit_dump(spoiled(name, value))
    assert not report.right
    assert str(report).startswith(f"WRONG: {name}[0]")
    assert f"in column 1 is {value:.7g}: {said} (1 column)" in str(report)
    assert report.wrong == []


def test_a_result_that_is_no_number_is_the_first_wrong_term() -> None:
    report = audit_dump(spoiled("W_Y", np.nan))
    assert (report.first.term, tuple(report.first.where), report.first.columns) == ("W_Y", (1,), 1)
    assert "found nan" in str(report)


def test_a_weight_that_is_a_rounding_below_zero_is_right() -> None:
    m = RIGHT["m"].copy()
    place = tuple(np.argwhere(m == 0)[0])
    m[place] = -6e-8
    assert audit_dump(having(m=m)).right


def test_what_is_beyond_all_bounds_is_reported() -> None:
    assert "W[0] in column 1 is 1e+80: beyond all bounds" in str(audit_dump(spoiled("W", 1e80)))


# ---------------------------------------------------------------- fields that may be left out


def test_a_pass_of_new_samples_needs_targets_and_weights_only() -> None:
    bare = {"format": "restir-ref dump", "version": 1, "mis": "constant", "p_hat": [[2.0], [1.0]], "W": [[0.5], [1.0]]}
    report = audit_dump({**bare, "u": [0.3], "w_sum": [1.0], "s": [0], "W_Y": [0.5]})
    assert report.right
    assert [each[:5] for each in report.unchecked] == ["no J:", "no c:", "no ca"]
    assert not audit_dump({**bare, "u": [0.3], "w_sum": [1.1], "s": [0], "W_Y": [0.55]}).right


@pytest.mark.parametrize("kept", ["m", "w"])
def test_without_densities_the_weights_are_taken_as_they_are_and_the_rest_is_judged(kept) -> None:
    gone = {"p_hat_from", "p_hat_own", "m", "w"} - {kept}
    report = audit_dump(without(*gone))
    assert report.right
    assert "the MIS weights were taken as they are" in str(report)
    assert audit_dump({**without(*gone), "W_Y": 2 * RIGHT["W_Y"]}).first.term == "W_Y"


def test_the_canonical_input_is_recognised_where_it_is_not_named() -> None:
    last = dumped(fields((False, False, True)), "defensive")
    assert audit_dump({name: values for name, values in last.items() if name != "canonical"}).right


# ---------------------------------------------------------------- how exactly terms are stored


def rounded(values: Any, bits: int) -> Any:
    mantissa, exponent = np.frexp(values)
    return np.ldexp(np.round(mantissa * 2**bits), exponent - bits)


@pytest.mark.parametrize("name", ["W", "J", "p_hat_from"])
def test_fields_in_half_floats_are_right_if_the_dump_says_so(name) -> None:
    whole = dumped(fields(n=60), "talbot")
    stored = {**whole, name: rounded(whole[name] * 1.037, 11) / 1.037}
    assert audit_dump({**stored, "precision": f"{name}=half"}).right
    assert audit_dump({**stored, "precision": {name: "half"}}).right


def test_a_wrong_term_is_found_in_a_dump_of_half_floats() -> None:
    whole = dumped(fields(n=60), "talbot")
    assert audit_dump({**whole, "precision": "half", "W_Y": whole["W_Y"] * 1.2}).first.term == "W_Y"
    assert audit_dump({**whole, "precision": "half", "W_Y": whole["W_Y"] * 1.0005}).right
    assert not audit_dump({**whole, "W_Y": whole["W_Y"] * 1.0005}).right
