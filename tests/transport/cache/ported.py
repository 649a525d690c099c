"""How far a port of the golden vectors of caches is off."""

import numpy as np


def wrong(found, got):
    """What differs by more than its tolerance, and by which multiple."""
    worst = {}
    for name, tolerance in found["tolerance"].items():
        want = np.array(found["expected"][name])
        worst[name] = float((abs(got[name] - want) / (abs(want) + abs(want).mean())).max() / tolerance)
    return worst
