"""The papers' figures, regenerated, and their claims, checked: `python -m figures --help`.

One module per figure holds `FIGURE = Figure(...)` (see `figures.claims.figure`); the engine around it computes the
figure in chunks, stores them, resumes, judges the claims and writes one report.
"""

import os

# Hazard: BLAS reads these when NumPy loads, so they stand before any import of it. Chunks run in parallel
# processes, and threads inside a chunk would change the order of sums and so the bytes of a result.
for _variable in ("OMP", "OPENBLAS", "MKL", "BLIS", "VECLIB_MAXIMUM", "NUMEXPR"):
    os.environ[f"{_variable}_NUM_THREADS"] = "1"
