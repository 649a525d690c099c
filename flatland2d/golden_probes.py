"""Golden vectors of probe queries in the plane.

python -m flatland2d.golden_probes           write flatland2d/data/golden_probes.json anew
python -m flatland2d.golden_probes --check   is the file that ships with the package what would be written?
"""

import sys
from pathlib import Path

from flatland2d.directions import Bins, rays
from restir_ref.transport.cache.golden import main, volume
from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.maps import Maps

SHIPPED = Path(__file__).parent / "data" / "golden_probes.json"

VOLUMES = {
    "grid": volume(Grid((0.25, 0.125), (0.25, 0.125), (3, 4)), Maps(Bins(8), Bins(16), rays), 1),
    "one probe": volume(Grid((0.5, 0.5), (0.5, 0.25), (2, 1)), Maps(Bins(8), Bins(16), rays), 1),
}

if __name__ == "__main__":
    sys.exit(main(VOLUMES, SHIPPED))
