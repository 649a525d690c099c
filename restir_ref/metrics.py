"""Errors of an image against its reference; pixels last, leading axes (replicas, frames) are kept."""

import numpy as np

from restir_ref.batch import Array

SMALL = 0.01
"""What keeps dark pixels from dividing by zero: a hundredth of the mean, or of one."""


def mape(image: Array, reference: Array) -> Array:
    """mean |I - R| / (.01 mean R + R): free of the images' scale; (..., n) -> (...).  [GRIS 9.3, footnote 13]"""
    return np.asarray((abs(image - reference) / (SMALL * reference.mean() + reference)).mean(axis=-1))


def mape_with_floor(image: Array, reference: Array) -> Array:
    """mean |I - R| / (R + .01): depends on the images' scale; (..., n) -> (...).  [DDGIR 4]"""
    return np.asarray((abs(image - reference) / (reference + SMALL)).mean(axis=-1))


def rel_mse(image: Array, reference: Array) -> Array:
    """mean (I - R)^2 / (R^2 + (.01 mean R)^2); (..., n) -> (...)."""
    return np.asarray(((image - reference) ** 2 / (reference**2 + (SMALL * reference.mean()) ** 2)).mean(axis=-1))


def rmse(image: Array, reference: Array) -> Array:
    """sqrt(mean (I - R)^2); (..., n) -> (...)."""
    return np.asarray(np.sqrt(((image - reference) ** 2).mean(axis=-1)))
