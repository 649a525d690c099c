"""Dumps and files with something broken, by families; each says whether it can still be read.

A corruption takes a right dump, or the bytes of its file, and a generator.
"""

import io
import json
import struct
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from restir_ref.audit import KNOWN
from restir_ref.audit.fields import ARRAYS, INPUTS
from restir_ref.mis import CANONICAL_COVERS
from tests.audit.shader import dumped, scattered_passes

Dump = dict[str, Any]
Rng = np.random.Generator

N = 2
PATTERNS = ((1,), (1, 0), (1, 1), (0, 1, 0), (0, 0))
SAID = [0, 0.5, 1, 3, 1e-30, 1e30, float(np.finfo(np.float32).tiny)]
EXTREME = [0, 5e-324, 1e-310, 1e-75, 1e75, 1e38, 1]
REFUSED = [-1, np.nan, np.inf, 1e80, -np.inf]


def right(mis: str, canonical: tuple[int, ...], seed: int = 3) -> Dump:
    rng = np.random.default_rng(seed)
    whole = scattered_passes(len(canonical), N, [bool(k) for k in canonical], rng)
    return dumped({**whole, "u": rng.random(N)}, mis)


def bases() -> list[Dump]:
    """Right dumps of every weight with every pattern of canonical inputs it allows."""
    covered = [(mis, p) for mis in KNOWN for p in PATTERNS if any(p) or KNOWN[mis].unbiased_for != CANONICAL_COVERS]
    return [right(mis, pattern) for mis, pattern in covered]


BASES = bases()


def one_of(options: Any, rng: Rng) -> Any:
    return options[int(rng.integers(len(options)))]


def field(dump: Dump, rng: Rng, names: Any = ARRAYS) -> str:
    return one_of([name for name in names if name in dump], rng)


def placed(values: Any, rng: Rng, options: Any) -> Any:
    """One to three entries replaced."""
    new = np.array(values, dtype=float)
    for place in rng.integers(new.size, size=int(rng.integers(1, 4))):
        new.flat[place] = one_of(options, rng)
    return new


# ---------------------------------------------------------------- values


def results(dump: Dump, rng: Rng) -> Dump:
    """Wrong results of moderate size: a report."""
    names = [field(dump, rng, ("m", "w", "w_sum", "W_Y", "c_Y")) for _ in range(2)]
    return {**dump, **{name: placed(dump[name], rng, SAID) for name in names}}


def inputs(dump: Dump, rng: Rng) -> Dump:
    """Other inputs than the results belong to."""
    name = field(dump, rng, ("p_hat", "W", "J", "p_hat_own", "p_hat_from"))
    return {**dump, name: placed(dump[name], rng, SAID)}


def extremes(dump: Dump, rng: Rng) -> Dump:
    """Denormal numbers and others near the limit, which may overflow where they meet."""
    names = [field(dump, rng) for _ in range(4)]
    return {**dump, **{name: placed(dump[name], rng, EXTREME) for name in names if name not in ("s", "u")}}


def unreadable_values(dump: Dump, rng: Rng) -> Dump:
    name = field(dump, rng)
    return {**dump, name: placed(dump[name], rng, REFUSED)}


def canonical(dump: Dump, rng: Rng) -> Dump:
    """The dump of weights that need no canonical input, with any set of them; results of another size are wrong."""
    rights = [each for each in BASES if KNOWN[each["mis"]].unbiased_for != CANONICAL_COVERS]
    new = one_of(rights, rng)
    return {**new, "canonical": rng.integers(2, size=len(new["p_hat"])), "W_Y": new["W_Y"] * 1.37 + 1}


def scaled(dump: Dump, rng: Rng) -> Dump:
    name = field(dump, rng, ("w", "W_Y", "c_Y", "m"))
    return {**dump, name: np.asarray(dump[name]) * one_of([0, 0.5, 1.37, 2], rng)}


# ---------------------------------------------------------------- fields


def types(dump: Dump, rng: Rng) -> Dump:
    name = field(dump, rng)
    kinds = ["i1", "u8", "f2", "f4", ">f8", "?", "c16", "O", "U4", "S3", "M8[s]", "m8[s]", "V8", np.longdouble]
    with np.errstate(all="ignore"):
        values = np.asarray(dump[name])
        kind = one_of(kinds, rng)
        new = values.astype("i8").astype(kind) if kind in ("M8[s]", "m8[s]", "V8") else values.astype(kind)
    return {**dump, name: new}


def shapes(dump: Dump, rng: Rng) -> Dump:
    name = field(dump, rng)
    values = np.asarray(dump[name])
    changes: list[Callable[[Any], Any]] = [
        np.ravel, np.transpose, np.squeeze, lambda v: v[None], lambda v: v[..., None], lambda v: v[..., :0],
        lambda v: v[..., :1], lambda v: np.concatenate([v, v], axis=-1), lambda v: v.tolist(), lambda v: v.flat[0],
        lambda v: [v.tolist(), [1]], lambda v: np.broadcast_to(1.0, (10**6, 10**6)), lambda v: {"values": v},
    ]  # fmt: skip
    return {**dump, name: one_of(changes, rng)(values)}


def missing(dump: Dump, rng: Rng) -> Dump:
    gone = set(rng.choice([*dump], size=int(rng.integers(1, 4)), replace=False).tolist())
    return {name: values for name, values in dump.items() if name not in gone}


def without_inputs(dump: Dump, rng: Rng) -> Dump:
    gone = field(dump, rng, INPUTS)
    return {name: values for name, values in dump.items() if name != gone}


def extra(dump: Dump, rng: Rng) -> Dump:
    names = ["weightSum", "w_y", "", "x" * 10_000, "a\nb", "\ud800", 3, None, ("m",), "U", "J_backwards"]
    return {**dump, one_of(names, rng): 1.0}


def swapped(dump: Dump, rng: Rng) -> Dump:
    one, other = field(dump, rng), field(dump, rng)
    return {**dump, one: dump[other], other: dump[one]}


def headers(dump: Dump, rng: Rng) -> Dump:
    name = one_of(["format", "version", "mis"], rng)
    deep: list[Any] = []
    for _ in range(2000):
        deep = [deep]
    odd = [None, 2, 1.5, "x\ny", "x" * 10**5, deep, {}, {"a": 1}, np.ones((3, 3)), np.array(["talbot"] * 3), b"1", ""]
    return {**dump, name: one_of(odd, rng)}


# ---------------------------------------------------------------- files


def npz(dump: Mapping[Any, Any], save: Callable[..., None] = np.savez) -> bytes:
    file = io.BytesIO()
    save(file, **dump)
    return file.getvalue()


def as_json(dump: Mapping[Any, Any]) -> bytes:
    return json.dumps({name: np.asarray(v).tolist() for name, v in dump.items()}).encode()


def members(dump: Dump) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(npz(dump))) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def zipped(parts: Mapping[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return file.getvalue()


def flipped(content: bytes, rng: Rng, most: int = 8, others: bytes = bytes(range(256))) -> bytes:
    new = bytearray(content)
    for place in rng.integers(len(new), size=int(rng.integers(1, most))):
        new[place] = one_of(others, rng)
    return bytes(new)


def bytes_of_archive(dump: Dump, rng: Rng) -> bytes:
    return flipped(npz(dump, one_of([np.savez, np.savez_compressed], rng)), rng)


def directory(dump: Dump, rng: Rng) -> bytes:
    """Bytes of the central directory: methods, flags, sizes and offsets."""
    content = npz(dump)
    start = content.index(b"PK\x01\x02")
    return content[:start] + flipped(content[start:], rng, 4)


def bytes_of_array(dump: Dump, rng: Rng) -> bytes:
    """Any bytes of an array, header included, in a sound archive."""
    parts = members(dump)
    name = one_of([*parts], rng)
    return zipped({**parts, name: flipped(parts[name], rng, 2)})


def numbers_of_array(dump: Dump, rng: Rng) -> bytes:
    """Bytes of the result's numbers: any float64."""
    parts = members(dump)
    start = len(parts["W_Y.npy"]) - 8 * N
    return zipped({**parts, "W_Y.npy": parts["W_Y.npy"][:start] + flipped(parts["W_Y.npy"][start:], rng)})


def lying_shape(dump: Dump, rng: Rng) -> bytes:
    """A header that claims more than there is."""
    parts = members(dump)
    name = one_of(["p_hat.npy", "W.npy", "W_Y.npy"], rng)
    shape = one_of(
        ["(1000000, 1000000)", "(9223372036854775807,)", "(4611686018427387904, 4)", "(3000,)", "(-1,)"], rng
    )
    descr = one_of(["<f8", "<U1000000000", "|S2147483647", "|O", "<f8,<f8", "(" * 500], rng)
    said = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return zipped({**parts, name: b"\x93NUMPY\x01\x00" + struct.pack("<H", len(said)) + said + bytes(64)})


def lying_size(dump: Dump, rng: Rng) -> bytes:
    """A directory that claims huge members, as that of a bomb does."""
    content = bytearray(npz(dump))
    start = content.index(b"PK\x01\x02") + 24
    content[start : start + 4] = struct.pack("<I", 2**32 - 2)
    return bytes(content)


def nested(dump: Dump, rng: Rng) -> bytes:
    inner = {"inner.npz": npz(dump), "W.npy": npz(dump), "p_hat": b"text", "mis.npy": zipped({})}
    name = one_of([*inner], rng)
    return zipped({**members(dump), name: inner[name]} if rng.random() < 0.7 else {name: inner[name]})


def magic(dump: Dump, rng: Rng) -> bytes:
    first = [
        b"",
        b"PK",
        b"PK\x03\x05",
        b"PK\x05\x06" + bytes(18),
        b"\x93NUMPY",
        b"\x80\x04.",
        b"{}",
        bytes(100),
        b"\x1f\x8b",
    ]
    return one_of(first, rng) + (npz(dump)[4:] if rng.random() < 0.3 else b"")


def truncated(dump: Dump, rng: Rng) -> bytes:
    content = npz(dump)
    return content[: int(rng.integers(len(content) - 1))]


def truncated_json(dump: Dump, rng: Rng) -> bytes:
    content = as_json(dump)
    return content[: int(rng.integers(len(content) - 1))]


def bytes_of_json(dump: Dump, rng: Rng) -> bytes:
    return flipped(as_json(dump), rng, 3, b'0123456789.,-+eE[]{} \n"aN')


def other_json(dump: Dump, rng: Rng) -> bytes:
    texts = [b"[]", b"1", b"null", b'"x"', b"[" * 10**5, b"{}", b"\xff\xfe{\x00", b'{"a":' * 900 + b"1" + b"}" * 900]
    odd = [b"NaN", b"1e999", b"1" * 4000, b"1" * 5000, b"[[1], [1, 2]]", b"null", b'"\\ud800"', b"true", b"[]", b"{}"]
    spliced = as_json(dump).replace(b"[", one_of(odd, rng) + b", [", 1)
    named = as_json({**dump, "W": 0}).replace(b'"W": 0', b'"W": ' + one_of(odd, rng))
    return one_of([one_of(texts, rng), spliced, named], rng)


@dataclass(frozen=True)
class Family:
    """How many; whether each has to be reported or refused (None: either); and the suffix of its files."""

    corrupt: Callable[[Dump, Rng], Any]
    count: int
    readable: bool | None = None
    suffix: str = ""


FAMILIES = {
    "wrong results": Family(results, 25, True),
    "other inputs": Family(inputs, 20, True),
    "results times a factor": Family(scaled, 15, True),
    "canonical inputs: all, some, none": Family(canonical, 20, True),
    "numbers at the limits of float64": Family(extremes, 30),
    "no numbers, negative, too large": Family(unreadable_values, 60),
    "types": Family(types, 90),
    "shapes": Family(shapes, 120),
    "missing fields": Family(missing, 120),
    "missing inputs": Family(without_inputs, 30),
    "extra fields": Family(extra, 150, False),
    "swapped fields": Family(swapped, 40),
    "headers": Family(headers, 150, False),
    "bytes of an archive": Family(bytes_of_archive, 180, None, ".npz"),
    "bytes of its directory": Family(directory, 150, None, ".npz"),
    "bytes of an array": Family(bytes_of_array, 120, None, ".npz"),
    "bytes of numbers": Family(numbers_of_array, 25, True, ".npz"),
    "lying shapes": Family(lying_shape, 130, False, ".npz"),
    "lying sizes": Family(lying_size, 30, True, ".npz"),
    "nested archives": Family(nested, 90, False, ".npz"),
    "wrong magic": Family(magic, 80, False, ".npz"),
    "truncated archives": Family(truncated, 150, False, ".npz"),
    "truncated JSON": Family(truncated_json, 150, False, ".json"),
    "bytes of JSON": Family(bytes_of_json, 60, None, ".json"),
    "other JSON": Family(other_json, 130, False, ".json"),
}
