"""TI: test images and synthetic noise, without any transport: for what happens after the estimates.

Images are arrays of radiance, (256,) or (48, 48); noise is added pixel by pixel, so a leading replica
axis comes from repeating the image.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from scipy.special import ndtri

from restir_ref.batch import Array
from restir_ref.chance import Chance


def slopes_and_steps() -> Array:
    """(256,): a slope, a smooth bump, two steps and a bar of 4 pixels, between .2 and 2."""
    x = (np.arange(256) + 0.5) / 256
    smooth = 0.4 + 0.8 * x + 0.6 * np.exp(-(((x - 0.3) / 0.06) ** 2))
    steps = np.where((x > 0.5) & (x < 0.7), -0.6, 0.0)
    bar = np.where((x > 0.85) & (x < 0.85 + 4 / 256), 0.8, 0.0)
    return np.asarray(smooth + steps + bar)


def disc_and_checker() -> Array:
    """(48, 48): a shaded disc before a checkerboard of 8 x 8 pixels, between .2 and 1.9."""
    y, x = np.mgrid[:48, :48] + 0.5
    checker = np.where((x // 8 + y // 8) % 2 == 0, 0.3, 0.9)
    r2 = ((x - 28) ** 2 + (y - 20) ** 2) / 14**2
    return np.where(r2 < 1, 0.4 + 1.5 * np.sqrt(np.maximum(1 - r2, 0)), checker)


def noisy(image: Array, sd: float, chance: Chance) -> Array:
    """image + sd N(0, 1), independent in every pixel."""
    u = chance.uniform(image.shape)
    return np.asarray(image + sd * ndtri(np.maximum(u, np.finfo(float).tiny)))


def speckled(image: Array, share: float, height: float, chance: Chance) -> Array:
    """image with +-height added to a random `share` of the pixels: outliers of mean zero."""
    u = chance.uniform(image.shape)
    return np.asarray(image + height * ((u < share / 2) * 1.0 - (u >= 1 - share / 2)))


PICTURES: Mapping[str, Callable[[], Array]] = MappingProxyType(
    {picture.__name__: picture for picture in (slopes_and_steps, disc_and_checker)}
)
