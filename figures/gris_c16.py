"""Undersampled light becomes splotches: reuse spreads the few samples that found it.  [GRIS 10.1]

A small mirror throws the light of a small window onto the wall that is looked at.  Errors of path tracing are
independent from pixel to pixel; those of reuse are alike over as many pixels as share samples.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures import criteria, realtime, style
from figures.figure import Arrays, Claim, Figure
from figures.references import reference
from restir_ref.metrics import neighbour_correlation

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SCENE, REACH = "distant_caustic", 40
REUSED = ("hybrid", "reconnection")


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per shift, and path tracing."""
    return [{"method": method} for method in (*REUSED, "path tracing")]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Correlation of relative errors over distance, after one frame and after all, (2, REACH), and four images."""
    truth = reference(SCENE).mean
    if chunk["method"] == "path tracing":
        trees = realtime.trees(SCENE, preset["trees"], rng)["images"].reshape(-1, realtime.TREES_IN_A_FRAMES_TIME[SCENE])
    raise NotImplementedError
