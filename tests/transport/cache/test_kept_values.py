"""Values that travel with samples are unbiased under three conditions, each exact over all outcomes, each necessary.

The model is `restir_ref.transport.proofs.zoo.kept`: selection may use the values, weights may only see the cell.
[DDGIR 3.6]
"""

import numpy as np
import pytest

from restir_ref.transport.proofs.zoo.kept import (
    After,
    Cells,
    as_kept,
    bias_of_frames,
    bias_of_shading,
    cells,
    looked_up_again,
    lost,
    mean_of_products,
    own,
    untouched,
)


def largest_bias(of: Cells, mis: str, after: After = untouched) -> float:
    """Exact, over two frames with a neighbour."""
    return float(np.abs(bias_of_frames(of, mis, after)).max())


@pytest.mark.claims("DDGIR-C03", part="finite cells")
@pytest.mark.claims("DDGIR-A08", part="finite cells")
@pytest.mark.parametrize("mis", ["talbot", "defensive", "1/Z"])
def test_kept_values_are_unbiased_in_every_cell(mis) -> None:
    assert largest_bias(cells(), mis) < 1e-12


@pytest.mark.claims("DDGIR-C03", part="controls on finite cells")
def test_weights_that_see_the_value_are_biased() -> None:
    assert largest_bias(cells(mean_of_products), "talbot") > 0.01


@pytest.mark.claims("DDGIR-A08", part="controls on finite cells")
def test_dividing_by_another_value_than_the_one_selected_with_is_biased() -> None:
    assert largest_bias(cells(), "talbot", looked_up_again) > 0.05


@pytest.mark.claims("DDGIR-C03", part="controls on finite cells")
def test_a_value_of_0_where_another_pixel_sees_light_is_biased() -> None:
    assert largest_bias(lost(), "talbot") > 0.05


@pytest.mark.claims("DDGIR-C03", part="finite cells")
def test_shading_with_what_the_pixel_itself_looks_up_is_unbiased() -> None:
    np.testing.assert_allclose(bias_of_shading(cells(), own), 0, atol=1e-12)


@pytest.mark.claims("DDGIR-C03", part="control on finite cells")
def test_shading_with_the_kept_value_is_biased() -> None:
    assert np.abs(bias_of_shading(cells(), as_kept)).max() > 0.05
