"""`python -m restir_ref.transport.proofs.zoo > docs/symptoms.md` writes the index of symptoms anew."""

import sys

from restir_ref.oracle.zoo import BUGS, INEFFICIENT
from restir_ref.oracle.zoo.page import page
from restir_ref.transport.proofs.zoo import TRANSPORT_BUGS
from restir_ref.transport.proofs.zoo.cached import CACHE_BUGS
from restir_ref.transport.proofs.zoo.gradients import GRADIENT_BUGS
from restir_ref.transport.proofs.zoo.page import cached, differences, section

sys.stdout.write(page([*BUGS.values(), *INEFFICIENT.values()]))
sys.stdout.write("".join(section([*TRANSPORT_BUGS.values()])))
sys.stdout.write("".join([*cached([*CACHE_BUGS.values()]), *differences([*GRADIENT_BUGS.values()])]))
