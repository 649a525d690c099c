"""How tests run: one BLAS thread, and how many examples Hypothesis draws.

`HYPOTHESIS_PROFILE` chooses the profile: `dev` for new examples at the keyboard, `ci` for the same
examples every time (`make test`, and wherever CI is set), `nightly` for many, `kernel` for so few that
all laws marked `kernel` take five seconds.
"""

import os
import signal

# Hazard: BLAS reads these when NumPy loads, so they stand before any import that may load it.
for _library in ("OPENBLAS", "MKL", "OMP", "NUMEXPR"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")
os.environ.setdefault("VECLIB_MAXIMUM_THREADS", "1")

from hypothesis import HealthCheck, Phase, settings

# Hazard: what a shell without job control starts in the background ignores Ctrl-C, and so do its children.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("dev", max_examples=50, deadline=None)
settings.register_profile("ci", max_examples=40, deadline=None, derandomize=True, print_blob=True)
settings.register_profile("nightly", max_examples=3000, deadline=None, print_blob=True)
settings.register_profile(
    "kernel",
    max_examples=5,
    deadline=None,
    derandomize=True,
    phases=(Phase.explicit, Phase.generate),
    suppress_health_check=(HealthCheck.too_slow,),
)

settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE") or ("ci" if os.environ.get("CI") else "dev"))
