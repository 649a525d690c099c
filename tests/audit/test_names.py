"""The dictionary of names: the page shows the table of the code, and the code suggests fields that exist."""

import pytest

from restir_ref.audit.fields import ARRAYS
from restir_ref.audit.names import ENGINES, NAMES, meanings, table
from tests.checkout import ROOT


def test_the_page_shows_the_table_of_the_code() -> None:
    assert table() in (ROOT / "docs" / "names.md").read_text(encoding="utf-8")


def test_every_name_belongs_to_a_field_and_an_engine() -> None:
    for name in NAMES:
        assert name.field in (*ARRAYS, "mis")
        assert len(name.engines) == len(ENGINES)
        assert any(name.engines)


@pytest.mark.parametrize(
    ("theirs", "fields"), {"weightSum": {"W", "w_sum"}, "TARGETPDF": {"p_hat"}, "xyz": set()}.items()
)
def test_an_engine_name_means_these_fields(theirs, fields) -> None:
    assert {meaning.split("'")[1] for meaning in meanings(theirs)} == fields
