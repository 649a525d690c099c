"""Volumes that are updated until nothing changes any more, to a stated tolerance.

At a fixed hysteresis a = .97 light bounces as slowly as a forgets: after t updates a furnace of albedo rho lacks the
share rho (1 - .03 (1 - rho))^(t-1), 17 % after 200 at rho = .75.  Here a rises instead.  While nothing is known yet
a = 0, and a bounce is a frame: after n frames the share rho^n is missing.  Then a_s = s / (s + g) with
g = 1 / (1 - rho), for s = 1, 2 ..: what is missing falls on, by prod (1 - (1 - a_s) (1 - rho)), like 1 / s, and the
frames' noise is averaged away.
"""

from dataclasses import replace

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.transport.cache.update import Updating, update
from restir_ref.transport.cache.volume import Volume
from restir_ref.transport.materials import albedo
from restir_ref.transport.scene import Scene

DARKEST = 0.98
"""The largest share of light that is thought to be scattered again: materials that add up to more are in open rooms."""


def converge(
    v: Volume, s: Scene, how: Updating, chance: Chance, *, tolerance: float = 0.005, most: int = 5000
) -> Volume:
    """Updates with a rising hysteresis until light that is missing, and noise, are both below `tolerance`.

    Noise is the standard deviation of E over texels, as a share of the mean, told by the last change of E.
    Raises ValueError for a tolerance outside (0, 1), and where `most` updates are not enough.
    """
    if not 0 < tolerance < 1:
        raise ValueError(f"a tolerance must be in (0, 1), but is {tolerance}: it is a share of the mean irradiance.")
    rho = min(float(albedo(s.materials).max()), DARKEST)
    bounces = int(np.ceil(np.log(tolerance) / np.log(max(rho, tolerance))))
    noise = np.inf
    for t in range(1, most + 1):
        later = max(t - bounces, 0) * (1 - rho)
        a = later / (later + 1)
        before, v = v, update(v, s, replace(how, hysteresis=a), chance)
        noise = noise_of(before.E, v.E, a)
        if t > bounces and noise <= tolerance:
            return v
    raise ValueError(
        f"after {most} updates the noise of E is {noise:.2g} of its mean, above {tolerance}: give probes more than "
        f"{how.rays} rays, or allow a larger tolerance or more updates."
    )


def noise_of(before: Array, after: Array, a: float) -> float:
    """sqrt((1 - a) / (1 + a)) rms(E_new - E) / mean E, with E_new - E = (after - before) / (1 - a).

    What a E + (1 - a) E_new settles to has the share (1 - a) / (1 + a) of the variance of E_new, if frames are
    independent.  E_new - E has E's own variance besides, so that this is too much by sqrt(2 / (1 + a)): 5 % at a = .8.
    """
    mean = float(after.mean())
    rms = float(np.sqrt(np.mean((after - before) ** 2))) / (1 - a)
    return float(np.sqrt((1 - a) / (1 + a))) * rms / mean if mean > 0 else 0.0
