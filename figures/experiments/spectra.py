"""Noise of a reconstructed row, frequency by frequency: what GPT-P03 expects of noise that is not white."""

from dataclasses import replace

import numpy as np

from figures.claims.figure import Claim
from figures.experiments.withheld import withheld
from restir_ref.batch import Array
from restir_ref.poisson import ALPHA, cosine_power, symbol, transposed


def expected(image: Array, dx: Array) -> Array:
    """(alpha^4 S_c(k) + D(k) S_g(k)) / (alpha^2 + D(k))^2 of errors of rows (..., n) and of their dx (..., n - 1).

    S_c is the power of the image's errors in cosines, S_g that of dx in the sines which are these cosines' differences:
    D S_g is the power of grad^T dx in cosines.  For white noise the formula of [GPT-P03]; (..., n).

    Left out are cross terms, 2 alpha^2 C(k) H(k) / (alpha^2 + D(k))^2 with the transforms C of the image's errors and H
    of grad^T dx: with them, this is the power of the errors of L2, exactly.
    """
    D = symbol(image.shape[-1:])
    S_c, DS_g = cosine_power(image, 1), cosine_power(transposed([dx], image.shape), 1)
    return np.asarray((ALPHA**4 * S_c + DS_g) / (ALPHA**2 + D) ** 2)


def in_bands(S: Array) -> tuple[Array, Array]:
    """Mean power of spectra (..., n) in cosines below alpha and above it; (...) each."""
    low = np.sqrt(symbol(S.shape[-1:])) < ALPHA
    return np.asarray(S[..., low].mean(axis=-1)), np.asarray(S[..., ~low].mean(axis=-1))


CLOSE = 0.9, 1.1
"""Measured power over the expected one: to 10%, said before it was measured."""


def explained(claim: Claim, powers: tuple[Array, Array]) -> Claim:
    """The claim with how large the cross terms are, over what is expected without them; withheld where it is judged."""
    share = float(powers[0].mean() / powers[1].mean()) - 1
    why = f"Cross terms of image and differences, which GPT-P03 leaves out, are {share:+.0%} of what it expects."
    told = replace(claim, reason=f"{claim.reason}  {why}".lstrip())
    judged = claim.outcome is not None and claim.outcome.passed is not None
    return withheld(told, LINEAR) if judged else told


LINEAR = (
    "L2 is linear, so that nothing but cross terms can break this formula: it holds or fails whatever the sentence "
    "says, whose own numbers stand beside it, of noise outside of its condition."
)
