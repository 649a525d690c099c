"""The transport's own zoo: what people get wrong about paths, shifts and Jacobians, one deliberate error each.

Every bug is a kind of `PathIntegrals`, so that it can be put into any pass and before any check.
Unlike those of `restir_ref.oracle.zoo` they need geometry: no table of cells has a distance to square.
"""

from collections.abc import Mapping

from restir_ref.transport.proofs.zoo.bug import TransportBug, family
from restir_ref.transport.proofs.zoo.samples import HISTORY_BUGS, SAMPLE_BUGS
from restir_ref.transport.proofs.zoo.shifts import SHIFT_BUGS

TRANSPORT_BUGS: Mapping[str, TransportBug] = family([*SHIFT_BUGS, *SAMPLE_BUGS, *HISTORY_BUGS])
WRONG_SHIFTS: Mapping[str, TransportBug] = family(SHIFT_BUGS)

__all__ = ["TRANSPORT_BUGS", "WRONG_SHIFTS", "TransportBug"]
