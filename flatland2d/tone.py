"""Tone mapping: radiance and fluence have no upper end, pictures have; every step here can be undone."""

import numpy as np

from restir_ref.batch import Array


def exposure(L: Array, percentile: float = 90.0) -> float:
    """1 / the given percentile of the light in L where there is any; 1 in the dark."""
    lit = L[L > 0]
    return float(1 / np.percentile(lit, percentile)) if lit.size else 1.0


def tone(L: Array, exposure: float) -> Array:
    """sRGB(e L / (1 + e L)) in [0, 1) for L >= 0: Reinhard's curve, then the gamma of screens.

    L = 1 / e lands in the middle, 1/2 of the light and .735 of the scale; nothing is ever clipped.
    """
    return encoded(exposure * L / (1 + exposure * L))


def untone(t: Array, exposure: float) -> Array:
    """L of t = tone(L, exposure), t in [0, 1)."""
    v = decoded(t)
    return np.asarray(v / (exposure * (1 - v)))


def encoded(v: Array) -> Array:
    """SRGB: 12.92 v up to v = .0031308, then 1.055 v^(1/2.4) - .055."""
    return np.where(v <= 0.0031308, 12.92 * v, 1.055 * np.maximum(v, 0.0031308) ** (1 / 2.4) - 0.055)


def decoded(t: Array) -> Array:
    """v of t = encoded(v)."""
    return np.where(t <= 0.04045, t / 12.92, ((np.maximum(t, 0.04045) + 0.055) / 1.055) ** 2.4)
