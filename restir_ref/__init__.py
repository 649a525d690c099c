"""Resampled importance sampling in light transport, written to be read with the papers.

One idea: *an image is many integrals that can share samples*.  Read the modules in this order:
`batch`, `chance`, `integrals`, `mis`, `resampling`, `streaming`, `restir`, `loop`, `images`, then `gradient`,
`poisson`, `decorrelation`, `oracle` and `transport`.  The keys in square brackets, such as [GRIS Eq. 36], are
explained in `docs/references.md`, the symbols in `docs/notation.md`.
"""

from restir_ref.chance import Chance, Live
from restir_ref.integrals import NOWHERE, Integrals, Pixels, Reservoirs, Shifted
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.resampling import Input, gris, select, weigh
from restir_ref.restir import initial, reuse_all, shade, spatial, temporal

__version__ = "0.1.0"

__all__ = [
    "NOWHERE",
    "WEIGHTS",
    "Chance",
    "Input",
    "Integrals",
    "Live",
    "Pixels",
    "Reservoirs",
    "Shifted",
    "Weights",
    "__version__",
    "gris",
    "initial",
    "reuse_all",
    "select",
    "shade",
    "spatial",
    "temporal",
    "weigh",
]
