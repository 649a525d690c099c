"""`python -m restir_ref.oracle.zoo > docs/symptoms.md` writes the index of symptoms anew."""

import sys

from restir_ref.oracle.zoo import BUGS, INEFFICIENT
from restir_ref.oracle.zoo.page import page

sys.stdout.write(page([*BUGS.values(), *INEFFICIENT.values()]))
