"""What one pass writes the next one reads, or the first column that differs is told; the format has a schema."""

import json

import numpy as np
import pytest

from restir_ref.audit import BadDump
from restir_ref.audit.__main__ import main
from restir_ref.audit.chain import chained
from restir_ref.audit.fields import ARRAYS, NEEDED
from restir_ref.audit.schema import schema
from tests.audit.planted import fields
from tests.audit.shader import dumped

FIRST = dumped(fields(n=12), "talbot")


def following(**changed):
    given = fields(n=12)
    W, c = given["W"].copy(), given["c"].copy()
    W[0], c[0] = FIRST["W_Y"], FIRST["c_Y"]
    return {**dumped({**given, "W": W, "c": c}, "talbot"), **changed}


def test_a_pass_that_reads_what_was_written_is_linked() -> None:
    link = chained(FIRST, following())
    assert link.right
    assert str(link) == "what was written is what input 0 reads"


def test_a_weight_that_was_lost_between_two_passes_is_found_in_its_column() -> None:
    second = following()
    W = second["W"].copy()
    W[0, 5] += 1
    link = chained(FIRST, {**second, "W": W})
    assert not link.right
    assert link.differing["W_Y"][:2] == (5, 1)
    assert "W_Y was" in str(link)
    assert "in column 5, but input 0 reads W" in str(link)


def test_passes_of_other_pixels_are_refused() -> None:
    with pytest.raises(BadDump, match="12 and 24 columns"):
        chained(FIRST, dumped(fields(n=24), "talbot"))
    with pytest.raises(BadDump, match="no 'W_Y'"):
        chained({name: v for name, v in FIRST.items() if name not in ("W_Y", "c_Y")}, following())


def test_the_command_takes_several_dumps(tmp_path, capsys) -> None:
    np.savez(tmp_path / "0.npz", **FIRST)
    np.savez(tmp_path / "1.npz", **following())
    assert main([str(tmp_path / "0.npz"), str(tmp_path / "1.npz")]) == 0
    assert "from 0.npz to 1.npz: what was written is what input 0 reads" in capsys.readouterr().out
    np.savez(tmp_path / "2.npz", **dumped(fields(n=12), "talbot"))
    assert main([str(tmp_path / "0.npz"), str(tmp_path / "2.npz")]) == 1


def test_the_schema_names_every_field_with_its_axes(capsys) -> None:
    assert main(["schema"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said == schema()
    assert ARRAYS.keys() <= said["properties"].keys()
    assert set(NEEDED) <= set(said["required"])
    depth = said["properties"]["p_hat_from"]
    for _ in range(3):
        assert depth["type"] == "array"
        depth = depth["items"]
    assert depth["type"] == "number"
