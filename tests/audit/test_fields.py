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
    "no inputs": (without("W", "J"), "no 'W' (contribution weights", "no 'J' (Jacobians"),
    "no densities": (without("p_hat_own", "p_hat_from"), "no 'p_hat_own'", "write what the pass used"),
    "one half of the pieces": (having(J_back=RIGHT["p_hat_from"]), "no 'p_hat_back'", "write what the pass used"),
    "no given weights": ({**without("m"), "mis": "given"}, "no 'm' (resampling MIS", "write what the pass used"),
    "a name of RTXDI": (having(weightSum=1), "unknown field 'weightSum'", "in RTXDI"),
    "a name of ReSTIR PT": (having(misWeight=1), "unknown field 'misWeight'", "it may be 'm'"),
    "a typing error": (having(w_Y=1), "unknown field 'w_Y'", "did you mean 'W_Y'?"),
    "a foreign field": (having(roughness=1), "unknown field 'roughness'", "fields are canonical"),
    "one input without its axis": (having(p_hat=RIGHT["p_hat"][0]), "'p_hat' has shape (4,)", "two axes (M, N)"),
    "no columns": (having(p_hat=np.zeros((3, 0))), "'p_hat' has shape (3, 0)", "at least one of each"),
    "columns first": (having(W=RIGHT["W"].T), "'W' has shape (4, 3)", "columns last"),
    "one confidence for all": (having(c=1.0), "'c' has shape ()", "(M, N) are (3, 4)"),
    "a scalar for two": (having(cap=[1.0, 2.0]), "'cap' has shape (2,)", "() are ()"),
    "a flat matrix": (having(p_hat_from=RIGHT["p_hat"]), "'p_hat_from' has shape (3, 4)", "(3, 3, 4)"),
    "ragged rows": (having(W=[[1, 2], [3]]), "'W' is no rectangular array", "the same length"),
    "words": (having(W=[["a"] * N] * M), "'W' holds <U1", "real numbers"),
    "nothing": (having(W=None), "'W' holds object", "real numbers"),
    "complex numbers": (having(W=RIGHT["W"] * 1j), "'W' holds complex128", "real numbers"),
    "NaN": (spoiled("W", np.nan), "'W' is nan at [0, 1] (3 of 12", "finite, not negative"),
    "infinity": (spoiled("J", np.inf), "'J' is inf at [0, 1]", "0 where the shift is undefined"),
    "a negative target": (spoiled("p_hat", -1), "'p_hat' is -1.0 at [0, 1]", "not negative"),
    "a NaN result": (spoiled("W_Y", np.nan), "'W_Y' is nan at [1] (1 of 4", "contribution weight of the result"),
    "beyond all bounds": (spoiled("W", 1e80), "'W' is 1e+80 at [0, 1]", "at most 1e+75"),
    "half canonical": (having(canonical=[0.5, 0, 0]), "'canonical' is 0.5 at [0]", "a whole number below 2"),
    "an input that is not there": (spoiled("s", 3), "'s' is 3.0 at [1]", "a whole number below 3"),
    "half an input": (spoiled("s", 0.5), "'s' is 0.5 at [1]", "a whole number below 3"),
    "u of 1": (spoiled("u", 1.0), "'u' is 1.0 somewhere", "below 1"),
    "two ways to select": (having(u_stream=RIGHT["W"] * 0), "both 'u' and 'u_stream'", "leave out the one"),
    "no way to select": (without("u", "s"), "'W_Y' depends on which input was selected", "write 's'"),
    "cap 0": (having(cap=0.0), "'cap' is 0", "must be positive"),
    "no canonical input": (having(mis="pairwise", canonical=[0, 0, 0]), "'pairwise' weights need", "'canonical' 1"),
    "no canonical confidence": ({**spoiled("c", 0), "mis": "defensive"}, "'c' above 0 in every column", "null samples"),
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


def test_both_kinds_of_files_are_read(tmp_path) -> None:
    np.savez(tmp_path / "pass.npz", **RIGHT)
    np.savez_compressed(tmp_path / "small.NPZ.npz", **RIGHT)
    (tmp_path / "pass.json").write_text(as_json(RIGHT))
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
