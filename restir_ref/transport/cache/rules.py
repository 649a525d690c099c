"""What of the light at a point that a probe's ray meets enters the probe: the two papers' rules as data.

Both add what the cache tells of that point; iterated, they converge to fixed points of their own.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from restir_ref.batch import Array


@dataclass(frozen=True)
class Rule:
    """How much of the emitted light L_e, and of the light T_fd L_e scattered once, a probe takes besides the cache's.

    With L = T (L + emitted L_e + scattered T L_e) the cache converges to T (1 - T)^-1 (emitted + scattered T) L_e.
    """

    emitted: float
    scattered: float


ORIGINAL = Rule(emitted=0, scattered=1)
"""E = int (L_DDGI + T_fd L_e)(h(x, w), -w) <n, w> dw; fixed point sum over i >= 2 of T_fd^i L_e.  [DDGIR Eq. 4]"""

AUGMENTED = Rule(emitted=1, scattered=0)
"""E+ = int (L+ + L_e)(h(x, w), -w) <n, w> dw; fixed point T_f L, all light that is scattered.  [DDGIR Eq. 5]"""

RULES: Mapping[str, Rule] = MappingProxyType({"original": ORIGINAL, "augmented": AUGMENTED})


def gathered(rule: Rule, cached: Array, emitted: Array, scattered: Array) -> Array:
    """Radiance that enters a probe: cached + rule.emitted L_e + rule.scattered T_fd L_e.  [DDGIR Eq. 4, 5]"""
    return cached + rule.emitted * emitted + rule.scattered * scattered
