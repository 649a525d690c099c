"""Golden vectors of probe queries in space.

python -m tracer3d.golden_probes           write tracer3d/data/golden_probes.json anew
python -m tracer3d.golden_probes --check   is the file that ships with the package what would be written?
"""

import sys
from pathlib import Path

from restir_ref.transport.cache.golden import main, volume
from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.maps import Maps
from tracer3d.directions import Octahedral, rays

SHIPPED = Path(__file__).parent / "data" / "golden_probes.json"

VOLUMES = {
    "grid": volume(
        Grid((0.25, 0.125, 0.25), (0.25, 0.125, 0.5), (2, 3, 2)), Maps(Octahedral(4), Octahedral(6), rays), 3
    )
}

if __name__ == "__main__":
    sys.exit(main(VOLUMES, SHIPPED))
