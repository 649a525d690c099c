"""Large dumps are audited block by block, and nothing depends on the blocks."""

import numpy as np
import pytest

from restir_ref.audit import audit_dump, dump, files
from restir_ref.audit.files import Stored
from tests.audit.planted import NoJ, SumOnAccept, fields, streamed
from tests.audit.shader import dumped
from tests.audit.test_conventions import pixel_first, undivided

BLOCK = 7


@pytest.fixture(autouse=True)
def in_blocks(monkeypatch) -> None:
    monkeypatch.setattr(dump, "NUMBERS_AT_ONCE", 9 * BLOCK)
    monkeypatch.setattr(files, "IN_MEMORY", 100)
    monkeypatch.setattr(files, "SMALL", 40)


@pytest.mark.parametrize("written", [lambda d: d, undivided, pixel_first], ids=["plain", "undivided", "pixel first"])
@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_a_dump_on_disk_has_the_same_report_as_in_memory(written, save, tmp_path) -> None:
    for given, shader in ((fields, NoJ), (streamed, SumOnAccept)):
        wrong = written(dumped(given(n=60), "talbot", shader))
        save(tmp_path / "pass.npz", **wrong)
        assert str(audit_dump(tmp_path / "pass.npz")) == str(audit_dump(wrong))


def test_the_blocks_change_nothing(monkeypatch) -> None:
    wrong = dumped(fields(n=60), "defensive", NoJ)
    in_small_blocks = audit_dump(wrong)
    monkeypatch.setattr(dump, "NUMBERS_AT_ONCE", 2**20)
    assert str(in_small_blocks) == str(audit_dump(wrong))


def test_a_single_wrong_number_in_a_late_block_is_found_where_it_is() -> None:
    wrong = dumped(fields(n=60), "talbot")
    column = int(np.flatnonzero(wrong["W_Y"] > 0)[-1])
    wrong["W_Y"][column] *= 2
    assert (audit_dump(wrong).first.where, audit_dump(wrong).first.columns) == ((column,), 1)


def test_a_defect_is_counted_over_all_blocks() -> None:
    wrong = dumped(fields(n=60), "talbot")
    wrong["W"] = wrong["W"].copy()
    wrong["W"][1, [3, 30, 50]] = np.nan
    (only,) = audit_dump(wrong).defects
    assert (only.term, tuple(only.where), only.columns) == ("W", (1, 3), 3)


def test_columns_and_rows_of_a_stored_array_are_those_of_the_array(tmp_path) -> None:
    whole = np.arange(60.0).reshape(3, 4, 5)
    whole.tofile(tmp_path / "a")
    stored = Stored(tmp_path / "a", 0, whole.dtype, whole.shape)
    np.testing.assert_array_equal(stored.columns(1, 3), whole[..., 1:3])
    np.testing.assert_array_equal(stored.rows(1, 3), whole[1:3])
