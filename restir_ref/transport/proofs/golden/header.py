"""The golden paths as a header for C or HLSL, generated from the same JSON.

    python -m restir_ref.transport.proofs.golden.header FILE.json                 C, to standard output
    python -m restir_ref.transport.proofs.golden.header FILE.json --language hlsl

Every array of a file is one flat array of the header, last axis fastest, with its shape in a comment and the number of
its elements as NAME_N; empty arrays are left out, for neither language has them.
"""

import argparse
import json
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.proofs.golden.make import FORMAT
from restir_ref.transport.proofs.golden.terms import numbers

PER_LINE = 6


def c_array(name: str, values: Array) -> str:
    """`static const float NAME[] = {..};`, numbers with nine digits, which float32 needs."""
    kind, literal = ("int", str) if values.dtype.kind in "ib" else ("float", _c_float)
    return _declared(f"static const {kind} {name}[{values.size}]", [literal(each) for each in values.ravel().tolist()])


def hlsl_array(name: str, values: Array) -> str:
    """The same in HLSL, whose literals are float32 without a suffix."""
    kind, literal = ("int", str) if values.dtype.kind in "ib" else ("float", _float)
    return _declared(f"static const {kind} {name}[{values.size}]", [literal(each) for each in values.ravel().tolist()])


LANGUAGES: Mapping[str, Callable[[str, Array], str]] = MappingProxyType({"c": c_array, "hlsl": hlsl_array})


def _float(value: float) -> str:
    written = f"{value:.9g}"
    return written if re.search(r"[.e]", written) else f"{written}.0"


def _c_float(value: float) -> str:
    return f"{_float(value)}f"


def _declared(what: str, literals: Sequence[str]) -> str:
    lines = [", ".join(literals[k : k + PER_LINE]) for k in range(0, len(literals), PER_LINE)]
    return f"{what} = {{\n  " + ",\n  ".join(lines) + "\n};"


def header(file: Mapping[str, Any], array: Callable[[str, Array], str], guard: str) -> str:
    """The text of a header.  Raises ValueError for a file that has no golden paths."""
    if file.get("format") != FORMAT:
        raise ValueError(f"the file's format is {file.get('format')!r}, but a header is made of {FORMAT!r}.")
    parts = [
        f"// {FORMAT}, version {file['version']}, d = {file['d']}: made by restir_ref; docs/golden.md has the fields.",
        f"#ifndef {guard}\n#define {guard}",
        *(part for scene in file["scenes"] for part in _scene(scene, array, f"golden{file['d']}")),
        f"#endif // {guard}\n",
    ]
    return "\n\n".join(parts)


def _scene(scene: Mapping[str, Any], array: Callable[[str, Array], str], prefix: str) -> Iterator[str]:
    yield f"// ---- {scene['name']}: {scene['about']}"
    for where, values in numbers({**_geometry(scene["scene"]), **_rest(scene)}).items():
        name = re.sub(r"\W+", "_", f"{prefix}.{scene['name']}.{where}")
        if values.size:
            yield f"// {' x '.join(map(str, values.shape)) or 'one number'}\n#define {name}_N {values.size}\n" + array(
                name, values
            )


def _geometry(scene: Mapping[str, Any]) -> dict[str, Any]:
    """The scene as arrays: lists of materials and facets become one array per field."""
    layers = [(k, layer) for k, each in enumerate(scene["materials"]) for layer in each["layers"]]
    facets, balls = scene["facets"], scene["balls"]
    dark = [0.0] * len(layers[0][1]["colour"])
    return {
        "layers": {
            "material": [k for k, _ in layers],
            "kind": [KINDS.index(layer["kind"]) for _, layer in layers],
            "colour": [layer["colour"] for _, layer in layers],
            "roughness": [float(layer["roughness"]) for _, layer in layers],
            "weight": [float(layer["weight"]) for _, layer in layers],
        },
        "facets": {
            "corners": np.array([each["corners"] for each in facets], dtype=float),
            "material": [each["material"] for each in facets],
            "emission": np.array([each["emission"] or dark for each in facets], dtype=float),
        },
        "balls": {
            "centre": np.array([each["centre"] for each in balls], dtype=float),
            "radius": np.array([each["radius"] for each in balls], dtype=float),
            "material": np.array([each["material"] for each in balls], dtype=int),
        },
        "eyes": {key: np.array(value, dtype=float) for key, value in scene["eyes"].items()},
        "depth": scene["depth"],
        "rule": {key: float(value) for key, value in scene["rule"].items()},
    }


KINDS = ("lambert", "ggx", "mirror")
"""The kinds of lobes that the scenes have; a header has their numbers."""


def _rest(scene: Mapping[str, Any]) -> dict[str, Any]:
    """Inputs, expected terms, and the tolerances of float32."""
    tolerances: dict[str, Any] = {name.replace(".", "_"): tol for name, tol in scene["tolerance"]["float32"].items()}
    return {"inputs": scene["inputs"], "expected": scene["expected"], "tolerance": tolerances}


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a header; the exit status, 2 for what is no file of golden paths."""
    parser = argparse.ArgumentParser(prog="python -m restir_ref.transport.proofs.golden.header", description=__doc__)
    parser.add_argument("file", type=Path, metavar="FILE.json", help="golden_paths.json of flatland2d or tracer3d")
    parser.add_argument("--language", choices=LANGUAGES, default="c", help="default: %(default)s")
    options = parser.parse_args(arguments)
    try:
        file = json.loads(options.file.read_text(encoding="utf-8"))
        print(header(file, LANGUAGES[options.language], f"GOLDEN_PATHS_{file.get('d', 0)}D_H"))
    except (OSError, ValueError) as error:
        print(f"no header: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
