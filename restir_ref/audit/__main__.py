"""`python -m restir_ref.audit DUMP`, and beside dumps: `images`, `ladder`, `shift`, `schema`.

Exit status 0: right, 1: wrong, 2: cannot be read, 3: undecided.
"""

import argparse
import json
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from restir_ref.audit.chain import chained
from restir_ref.audit.commands import Command, images_command, ladder_command, shift_command
from restir_ref.audit.dump import RTOL, audit_dump
from restir_ref.audit.fields import BadDump
from restir_ref.audit.pages import page
from restir_ref.audit.schema import schema

COMMANDS: Mapping[str, Command] = MappingProxyType(
    {"images": images_command, "ladder": ladder_command, "shift": shift_command}
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a report."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given[:1] == ["schema"]:
        print(json.dumps(schema(), indent=2))
        return 0
    if given and given[0] in COMMANDS:
        return COMMANDS[given[0]](given[1:])
    return _dumps(given)


def _dumps(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m restir_ref.audit",
        description="Recompute a dumped resampling pass and name the first wrong term. Of several dumps, each is the "
        "input of the next. Other commands: images, ladder, shift, schema (the format, for programs).",
        epilog="exit status: 0 if every dumped term is right, 1 if one is wrong, 2 if the dump cannot be read. "
        f"The format, for people: {page('audit.md')}; other pages named docs/... lie beside it.",
    )
    parser.add_argument("dump", metavar="DUMP", nargs="+", help="a .npz archive, a .json or a .csv file")
    parser.add_argument("--rtol", type=float, default=RTOL, help="relative tolerance (default: %(default)s)")
    options = parser.parse_args(arguments)
    if not 0 < options.rtol < math.inf:
        parser.error(f"--rtol must be positive and finite, but is {options.rtol}")
    right = True
    try:
        for number, dump in enumerate(options.dump):
            report = audit_dump(dump, rtol=options.rtol)
            print(f"{Path(dump).name}: {report}" if len(options.dump) > 1 else report)
            right &= report.right
            if number:
                link = chained(options.dump[number - 1], dump, rtol=options.rtol)
                print(f"from {Path(options.dump[number - 1]).name} to {Path(dump).name}: {link}")
                right &= link.right
    except (BadDump, MemoryError) as error:
        print(
            f"cannot read the dump: {str(error) or 'it does not fit into memory; dump fewer columns.'}", file=sys.stderr
        )
        return 2
    return 0 if right else 1


if __name__ == "__main__":
    raise SystemExit(main())
