"""The cure of every mistake about paths and shifts: what the code has to do instead, in one line."""

from collections.abc import Mapping
from types import MappingProxyType

PATH_CURES: Mapping[str, str] = MappingProxyType(
    {
        "geometric Jacobian left out": "J of a reconnection: densities, cosines and squared distances of Eq. 52",
        "inverted path Jacobian": "J = |du^y / du^x|: measure it once by finite differences",
        "distance to the power of another dimension": "distance to the power d - 1: 2 in space, 1 in flatland",
        "distances swapped": "squared distances of the base path above, those of the offset path below",
        "cosines left out of the Jacobian": "cosines at x_c, the offset path's above, the base path's below",
        "lobe probability left out of the Jacobian": "the density of a direction times the probability of its lobe",
        "second density ratio left out": "the density of the direction leaving x_c, for the new direction arriving",
        "light density of the base path kept": "evaluate the light's density anew, seen from the offset vertex",
        "MIS weight of the base path kept": "evaluate the MIS weight at the end of the path anew after the shift",
        "BSDF beyond the connection kept": "store what arrives at x_c; evaluate the BSDF there anew",
        "no test for an earlier connection": "refuse the shift if the offset path could have reconnected before",
        "connection tested for the base path only": "test roughness and distance on the offset path as well",
        "connection through walls": "trace the ray from y_{c-1} to x_c; J = 0 if something is between",
        "large Jacobians refused one way": "refuse where J > r or J < 1/r, so that the inverse is refused as well",
        "path taken over as it is": "shift history to the new camera, J included, and evaluate its target anew",
        "target without visibility": "trace the shadow rays that the path tracer traces: p_hat = 0 for what is hidden",
        "history rated with the current camera": "keep the last camera and first hits until history has been rated",
    }
)
"""By the names of bugs."""

CACHE_CURES: Mapping[str, str] = MappingProxyType(
    {
        "constant of the glossy term as printed": "one normalisation of E for both terms; try a furnace",
        "probes without direct light at the second vertex": "let probes take L_e of what they see: Eq. 5",
        "no residual beside bounded geometry": "add max(1 - G_max / G, 0) of one ray drawn by the BSDF",
        "shading with the kept value": "select with the kept value, and ask the cache anew for the one that is shaded",
        "target drawn anew where W is formed": "keep the number that was selected with, and divide by that",
        "MIS weights that see the kept value": "p_hat = a factor of the pixel times a factor that travels",
        "kept value of 0 where others see light": "a target that is positive wherever another pixel may see light",
    }
)
"""By the names of bugs about caches."""

GRADIENT_CURES: Mapping[str, str] = MappingProxyType(
    {
        "half weight where the shift is undefined": "w = q / (q + q' J) with J = 0 for an undefined shift: w = 1 there",
        "difference as one integral": "two: base paths of either pixel, weighed so that no light counts twice",
        "dark base paths thrown away": "weights that compare p_hat, so that dark bases weigh nothing; or keep them",
        "outer shift applied twice": "evaluate target and weights at the shifted sample, as it is: Eq. 9 and 25",
        "inner Jacobian in the outer shift": "J* = J_tau of the base path alone; G has the inner one",
        "offset path not rebuilt": "after the outer shift make the offset path anew, by the inner shift",
        "probability of the side left out": "divide by the probability 1/2, or take candidates of both sides",
        "parts added instead of subtracted": "p_hat_+ W_+ minus p_hat_- W_-; try two pixels and their exchange",
        "difference from one pixel's samples": "both: w_ij of one sample, and w_ji of the other, subtracted",
        "1/J in the weights of one side": "J belongs to the way of the sample at hand; try w_ij(x) + w_ji(T x) = 1",
        "targets on one side, densities on the other": "one function for the weights of both sides",
        "differences of hue in no part": "parts that overlap: max(+-mean d, 0) + a share of mean |d|, d split by them",
        "moved square ignored one way": "one function moves the place by the fraction, forth and back",
        "place on the film drawn anew": "the place is a number of the sample: keep it, shift it, J = 1",
        "share of the area on W": "multiply the confidence by the share, and leave W alone",
        "overlapped pixel chosen by its sample": "ask all of them, or choose by area; never by what they hold",
        "normals that agree mark an edge": "an edge is n_i . n_j < 0.9",
    }
)
"""By the names of bugs about differences."""
