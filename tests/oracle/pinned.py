"""The zoo's numbers as they were last time: exact biases, and which checks speak."""

from functools import cache

from restir_ref.oracle.zoo import BUGS, CHECKS, INEFFICIENT
from restir_ref.oracle.zoo.page import Entry, entry

WORST = {
    "Jacobian left out": (-0.4062, 0.4),
    "inverted Jacobian": (-0.75, 0.75),
    "Jacobian of another dimension": (-0.3636, 1 / 3),
    "rejection not mirrored": (-0.4, 4 / 7),
    "rejection unknown to MIS": (-4 / 7, 0),
    "rejection only in MIS": (0, 4 / 7),
    "two-to-one shift": (-1 / 3, 0.8),
    "target beyond the sampler's support": (-2 / 9, 0),
    "1/M over unequal supports": (-0.5, 0),
    "contribution weights over all inputs": (-0.5, 0),
    "undefined shift kept in MIS": (-0.75, 0),
    "pairwise targets swapped": (-0.5, 0.1),
    "visibility left out of MIS": (-0.4, 0),
    "current target for history": (-0.5647, 0),
    "history overrated in the canonical weight": (-0.1558, 0),
    "history underrated in the canonical weight": (0, 0.1714),
    "history forgotten in the canonical weight": (0, 4 / 7),
    "cap only in the denominator": (0, 4 / 7),
    "Jacobian left out of w": (-0.2083, 4 / 7),
    "Jacobian clamped in w": (-0.1458, 0),
    "W clamped": (-0.5354, 0),
    "neighbour skipped if its sample cannot be shifted": (0, 0.2284),
    "neighbour skipped if its shifted target is 0": (0, 0.4568),
    "input streamed twice": (0, 0.9143),
    "early out on either Jacobian": (-0.2442, 0.3636),
    "MIS at the unshifted sample": (-4 / 7, 0.64),
    "own MIS term without Jacobian": (-0.1714, 0.3667),
    "W of the selected sample kept": (-0.3548, 1.1386),
    "W of the selected sample times J": (-0.3548, 0.7967),
    "W formed with the stored target": (-0.32, 1.24),
    "1/p of the chosen candidate": (-0.1167, 7 / 15),
    "divided by M twice": (-0.5, 0),
    "candidates without light not counted": (0, 0.4),
    "1/T over unequal samplers": (-0.5, 0),
    "streaming against the old sum": (-0.2390, 0.1874),
    "sum grown only on accept": (-0.2769, 0),
    "null confidence 0": (0, 0.5551),
    "confidence lowered for duplicates": (0, 0.0338),
    "M capped, sum of weights not": (0, 0.5),
    "neighbour chosen by sample value": (-0.0222, 0.2139),
    "one seed for two passes": (-0.0796, 0.0613),
    "torn reservoirs": (-0.0874, 0.0704),
    "inverted weight update": (-0.4201, 6.4609),
    "only the last proposal updates": (-0.0547, 0.1062),
    "proposal clamped to the unit interval": (-0.5875, 0.75),
    "blue noise averaged into the acceptance": (-0.3142, 0.4078),
}
"""Smallest and largest relative bias over all cells of the bug's scene, enumerated."""

SHORT = dict(zip("D1pvcbmfrJ", CHECKS, strict=True))
"""One letter per check: Definition 4.1, f = 1, f = p_hat, variance, confidence, bound, MIS, frequency, return, J."""

CAUGHT = {
    "Jacobian left out": "D1pvJ",
    "inverted Jacobian": "D1pvJ",
    "Jacobian of another dimension": "D1pvJ",
    "rejection not mirrored": "D1pvmr",
    "rejection unknown to MIS": "D1pvmr",
    "rejection only in MIS": "D1pvmr",
    "two-to-one shift": "D1pvmr",
    "target beyond the sampler's support": "D1pv",
    "1/M over unequal supports": "D1pvbm",
    "contribution weights over all inputs": "D1pvbm",
    "undefined shift kept in MIS": "D1pvm",
    "pairwise targets swapped": "D1pvm",
    "visibility left out of MIS": "D1pvm",
    "current target for history": "D1pvbm",
    "history overrated in the canonical weight": "D1pvm",
    "history underrated in the canonical weight": "D1pvm",
    "history forgotten in the canonical weight": "D1pvm",
    "cap only in the denominator": "D1pvm",
    "Jacobian left out of w": "D1pvmf",
    "Jacobian clamped in w": "D1pvmf",
    "W clamped": "D1pv",
    "neighbour skipped if its sample cannot be shifted": "D1pvc",
    "neighbour skipped if its shifted target is 0": "D1pvc",
    "input streamed twice": "D1pvbmf",
    "early out on either Jacobian": "D1pvf",
    "MIS at the unshifted sample": "D1pvbmf",
    "own MIS term without Jacobian": "D1pvbmf",
    "W of the selected sample kept": "D1pvbm",
    "W of the selected sample times J": "D1pvb",
    "W formed with the stored target": "D1pvbm",
    "1/p of the chosen candidate": "D1pv",
    "divided by M twice": "D1pv",
    "candidates without light not counted": "D1pv",
    "1/T over unequal samplers": "D1pv",
    "streaming against the old sum": "D1pvf",
    "sum grown only on accept": "D1pvm",
    "null confidence 0": "D1pvc",
    "confidence lowered for duplicates": "D1pvc",
    "M capped, sum of weights not": "D1pvbm",
    "neighbour chosen by sample value": "D1pv",
    "one seed for two passes": "D1",
    "torn reservoirs": "D1pvf",
    "inverted weight update": "D1pv",
    "only the last proposal updates": "D1pv",
    "proposal clamped to the unit interval": "D1pv",
    "blue noise averaged into the acceptance": "D1pv",
    "no Jacobian in any MIS weight": "vb",
    "flat proxy target in MIS": "vb",
    "1/Z weights": "vb",
    "cap after the merge": "vbf",
    "no cap on history": "v",
    "neighbour merged twice, MIS knows": "vbf",
    "own sample merged twice, MIS knows": "vf",
    "result merged with its inputs again": "vf",
    "spatial reuse in place": "vf",
    "shifts rejected both ways": "v",
    "neighbour chosen by a coin": "v",
    "confidence made up per pixel": "v",
}
"""Which checks speak, in the order of `SHORT`."""

ALL = {**BUGS, **INEFFICIENT}


@cache
def looked_up(name: str) -> Entry:
    """All that the page says about a bug."""
    return entry(ALL[name])
