"""A frame of DDGI resampling, from candidates to the image: the passes are those of any ReSTIR.  [DDGIR 3.1, Eq. 9]"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import WHOLE, Around, Passes, Preset
from restir_ref.loop import frame as resampled
from restir_ref.restir import resample
from restir_ref.transport.cache.integrals import CacheIntegrals, Found, by_ray, lit, on_lights
from restir_ref.transport.cache.shading import Shading, bounded, own_light, residual


@dataclass(frozen=True)
class Frame:
    """Reservoirs X, which are the next frame's history, and the ray among the candidates, for the residual."""

    X: Reservoirs
    found: Found


def candidates(here: Pixels, chance: Chance) -> Frame:
    """Points on lights and one ray, resampled to one sample: the ray is kept for the residual.  [DDGIR 3.5]"""
    of: CacheIntegrals = here.of  # type: ignore[assignment]
    lights, found = list(on_lights(of, here.index, chance)), by_ray(of, here.index, chance)
    return Frame(resample([*lights, (found.x, found.mW)], here, chance), found)


def frame(
    here: Pixels,
    chance: Chance,
    preset: Preset,
    around: Around,
    history: Reservoirs | None = None,
    before: Sequence[Pixels] = (),
    *,
    passes: Passes = WHOLE,
) -> Frame:
    """One frame by the passes of `loop.frame`; one set of candidates, whatever the preset says of trees."""
    first = candidates(here, chance)
    drawn = replace(passes, initial=lambda *_: first.X)
    return Frame(resampled(here, chance, preset, around, history, before, passes=drawn), first.found)


def image(now: Frame, here: Pixels, shading: Shading, chance: Chance) -> Array:
    """L_e + ceil(T)(L_e + L+) + floor(T)(L_e + L+), (C, N); one shadow ray if visibility is left.  [DDGIR Eq. 9]"""
    of: CacheIntegrals = here.of  # type: ignore[assignment]
    ceil = bounded(lit(now.X, here), here, shading, chance)
    return own_light(of, here.index) + ceil + residual(of, here.index, now.found, shading, chance)
