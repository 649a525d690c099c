"""`python -m restir_ref.audit DUMP`: audit a dumped pass.  Exit status 0: right, 1: wrong, 2: cannot be read."""

import argparse
import math
import sys
from collections.abc import Sequence

from restir_ref.audit.dump import RTOL, audit_dump
from restir_ref.audit.fields import BadDump


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the report of a dump."""
    parser = argparse.ArgumentParser(
        prog="python -m restir_ref.audit",
        description="Recompute a dumped resampling pass and name the first wrong term. docs/audit.md has the format.",
        epilog="exit status: 0 if every dumped term is right, 1 if one is wrong, 2 if the dump cannot be read",
    )
    parser.add_argument("dump", metavar="DUMP", help="a .npz archive or a .json file")
    parser.add_argument("--rtol", type=float, default=RTOL, help="relative tolerance (default: %(default)s)")
    options = parser.parse_args(arguments)
    if not 0 < options.rtol < math.inf:
        parser.error(f"--rtol must be positive and finite, but is {options.rtol}")
    try:
        report = audit_dump(options.dump, rtol=options.rtol)
    except (BadDump, MemoryError) as error:
        print(
            f"cannot read the dump: {str(error) or 'it does not fit into memory; dump fewer columns.'}", file=sys.stderr
        )
        return 2
    print(report)
    return 0 if report.right else 1


if __name__ == "__main__":
    raise SystemExit(main())
