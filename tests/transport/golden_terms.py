"""What `golden_reader` makes of a scene, as the arrays of a file of golden paths."""

from collections.abc import Iterator
from typing import Any, NamedTuple

from tests.transport.golden_reader import Leaf, Leaving, Path, Reader, along, times

Terms = dict[str, Any]


def terms(reader: Reader, golden: Any) -> Iterator[tuple[str, Any]]:
    """All terms of one scene by their names, `shifts.J` for instance, columns last, in the order of the file."""
    given, leaves, dump = golden["inputs"], golden["expected"]["paths"]["leaves"], golden["expected"]["pass"]
    numbers = zip(given["pixel"], transposed(given["u"]), strict=True)
    paths = [reader.walk(pixel, reader.vector(u)) for pixel, u in numbers]
    ends = [Leaf(*end) for end in zip(leaves["k"], leaves["nee"], strict=True)]
    for name, row in {"vertices": vertices, "scattering": scattering, "lights": lights}.items():
        yield from columns(f"paths.{name}", [row(reader, path) for path in paths])
    yield from columns("paths.leaves", [contributions(reader, path, ends) for path in paths])
    dark = zip(given["dark_pixel"], transposed(given["dark_u"]), strict=True)
    yield from columns("dark", [ended(reader, reader.walk(pixel, reader.vector(u)), ends) for pixel, u in dark])
    base = [(paths[i], Leaf(k, nee)) for i, k, nee in zip(given["path"], given["k"], given["nee"], strict=True)]
    yield from columns("shifts.record", [record(reader, *x) for x in base])
    shifts = [(*x, to) for x, to in zip(base, given["to"], strict=True)]
    yield from columns("shifts", [shifted(reader, *x) for x in shifts])
    pixels = [given["pixel"][i] for i in given["path"]]
    passes = zip(*(transposed(x) for x in (given["passes"], dump["W"], dump["c"], [dump["u"]])), strict=True)
    yield from columns(
        "pass", [resampled(reader, [(*base[i], pixels[i]) for i in inputs], *rest) for inputs, *rest in passes]
    )
    yield from columns("pairs", [pair(reader, *x) for x in shifts])
    triples = zip(transposed(given["differences"]), transposed(golden["expected"]["differences"]["u"]), strict=True)
    yield from columns("differences", [reused(reader, [(*base[i], pixels[i]) for i in x], u) for x, u in triples])
    yield from columns("mutations", [mutated(reader, *base[i]) for i in given["mutated"]])


def columns(name: str, rows: list[Terms]) -> Iterator[tuple[str, Any]]:
    """Rows' fields as columns; none of no rows."""
    return ((f"{name}.{key}", last([row[key] for row in rows])) for key in (rows[0] if rows else ()))


def transposed(rows: Any) -> Any:
    return list(zip(*rows, strict=True))


def last(rows: Any) -> Any:
    """The first axis made the last."""
    return [last(x) for x in transposed(rows)] if isinstance(rows[0], list | tuple) else rows


def vertices(reader: Reader, path: Path) -> Terms:
    """No path of the files goes dark; where one does by mistake, its last vertex is repeated."""
    path = [*path, *path[-1:] * (reader.depth + 1 - len(path))]
    names = ("x", "n", "primitive", "r", "T")
    return {name: [getattr(v, name) for v in path] for name in names} | {"cos_o": [v.o[-1] for v in path]}


def scattering(reader: Reader, path: Path) -> Terms:
    lobes = max(map(len, reader.layers))
    P = [[l.P for l in reader.layers[v.primitive]] for v in path[:-1]]
    return {name: [getattr(v.leaving, name) for v in path[:-1]] for name in Leaving._fields} | {
        "P": [p + [reader.real(0)] * (lobes - len(p)) for p in P]
    }


def lights(reader: Reader, path: Path) -> Terms:
    each = [v.light for v in path[:-1]]
    return {"y": [x.y for x in each], "arrives": [int(x.p > 0) for x in each], "p": [x.p for x in each]}


def contributions(reader: Reader, path: Path, ends: list[Leaf]) -> Terms:
    return {"F": [reader.F(path, leaf) for leaf in ends], "c": [reader.c(path, leaf) for leaf in ends]}


def record(reader: Reader, path: Path, leaf: Leaf) -> Terms:
    zero, nowhere = reader.real(0), (reader.real(0),) * reader.d
    c = reader.c(path, leaf)
    found = {"c": c, "A": reader.A(path, c, leaf), "F": reader.F(path, leaf)}
    nothing = {
        "z": nowhere,
        "primitive": 0,
        "lobe_in": 0,
        "lobe_out": 0,
        "out": nowhere,
        "S": reader.black,
        "p_light": zero,
    }
    if c == 0:
        return nothing | found
    x = path[c - 1]
    found |= {"z": x.x, "primitive": x.primitive, "lobe_in": path[c - 2].leaving.lobe}
    if c < leaf.end:
        found |= {"lobe_out": x.leaving.lobe, "out": x.leaving.w}
    if c == leaf.k + 1:
        return nothing | found | {"S": reader.one}
    if c == leaf.k and leaf.nee:
        out = reader.unit(along(x.light.y, -1, x.x))
        return nothing | found | {"out": out, "S": times(1 / x.light.p, x.light.emission), "p_light": x.light.p}
    if c == leaf.k:
        return nothing | found | {"S": path[c].emission, "p_light": reader.p_light(path[c])}
    return nothing | found | {"S": reader.F([*path[:c], *reader.carry(path[c:], reader.one)], leaf)}


def shifted(reader: Reader, path: Path, leaf: Leaf, to: int) -> Terms:
    y, c = reader.shift(path, leaf, to), reader.c(path, leaf)
    if not y:
        return {"defined": 0, "J": reader.real(0), "A": reader.real(0), "F": reader.black}
    A = reader.A(y, c, leaf)
    return {"defined": 1, "J": A / reader.A(path, c, leaf), "A": A, "F": reader.F(y, leaf)}


def pair(reader: Reader, path: Path, leaf: Leaf, to: int) -> Terms:
    F, there = reader.F(path, leaf), shifted(reader, path, leaf, to)
    omega = reader.omega(reader.mean(F), reader.mean(there["F"]) * there["J"])
    gap = along(F, -there["J"], there["F"])
    p_hat, share, contribution = zip(*reader.parts(reader.signed(omega, gap, 0)), strict=True)
    return {"omega": omega, "gap": gap, "p_hat": p_hat, "share": share, "contribution": contribution}


def ended(reader: Reader, path: Path, ends: list[Leaf]) -> Terms:
    """A path that goes dark."""
    beyond = reader.depth + 1 - len(path)
    return {
        "vertices": len(path),
        "x": [v.x for v in path] + [(reader.real(0),) * reader.d] * beyond,
        "T": [v.T for v in path] + [reader.black] * beyond,
        "F": [reader.F(path, leaf) for leaf in ends],
    }


ENDS, BASES, SIDES, CONFIDENCES = ((0, 1), (2, 0), (2, 1)), (0, 2, 1), (0, 0, 1), (1, 4, 2)


class Difference(NamedTuple):
    """A base path in a pair: A of it, J of its offset path, omega, omega gap with its sign; and its parts' p_hat."""

    A: Any
    J: Any
    omega: Any
    signed: Any
    parts: Any


def difference(reader: Reader, path: Path, leaf: Leaf, base: int, offset: int, side: int) -> Difference | None:
    """The path's own numbers in pixel `base`, and in `offset` beside it; None where it is not defined in `base`."""
    here, there = shifted(reader, path, leaf, base), shifted(reader, path, leaf, offset)
    if not here["defined"]:
        return None
    J = there["A"] / here["A"]
    omega = reader.omega(reader.mean(here["F"]), reader.mean(there["F"]) * J)
    d = reader.signed(omega, along(here["F"], -J, there["F"]), side)
    return Difference(here["A"], J, omega, d, reader.parts(d))


def reused(reader: Reader, three: Any, u: Any) -> Terms:
    """A pass of pairs of three pixels into the first one, for both signs."""
    zero, pixel, c = reader.real(0), [p for *_, p in three], reader.vector(CONFIDENCES)
    seen = []  # input i's base path in the pair of input j
    for i, side in zip(BASES, SIDES, strict=True):
        ends = [(pixel[pair[side]], pixel[pair[1 - side]]) for pair in ENDS]
        seen.append([difference(reader, *three[i][:2], *each, side) for each in ends])
    own = [seen[i][i] for i in range(3)]
    landed = [row[0] for row in seen]
    J = [reader.outer(x.A, y.A, x.J, y.J) if y else zero for x, y in zip(own, landed, strict=True)]
    signs = [sign_of(reader, seen, J, sign, c, reader.real(u[sign])) for sign in (0, 1)]
    found = {name: [each[name] for each in signs] for name in signs[0]}
    return {
        "c": c,
        "J": J,
        "J_offset": [y.J if y else zero for y in landed],
        "omega": [y.omega if y else zero for y in landed],
        "signed": [y.signed if y else reader.black for y in landed],
        **found,
        "difference": reader.both(*found["estimate"]),
    }


def sign_of(reader: Reader, seen: Any, J: Any, sign: int, c: Any, u: Any) -> Terms:
    zero = reader.real(0)
    own = [seen[i][i].parts[sign][0] for i in range(3)]
    W = [reader.real((i + 1) / 4) if x else zero for i, x in enumerate(own)]
    p_hat = [row[0].parts[sign][0] if row[0] else zero for row in seen]
    whole = [
        [x.parts[sign][0] * x.A / row[0].A if x and row[0] else zero for x in row] for row in seen
    ]  # p_hat of y_i in pair j, times the J of the way from the first pair to j
    w = [reader.m(i, p_hat, whole, c) * p_hat[i] * W[i] * J[i] if p_hat[i] else zero for i in range(3)]
    s = reader.choose(reader.shares(w), u) if sum(w) else 0
    W_Y = sum(w) / p_hat[s] if sum(w) else zero
    f = seen[s][0].parts[sign][2] if W_Y else reader.black
    return {
        "W": W,
        "p_hat_own": own,
        "p_hat": p_hat,
        "p_hat_from": whole,
        "u": u,
        "w": w,
        "w_sum": sum(w),
        "s": s,
        "W_Y": W_Y,
        "estimate": times(W_Y, f),
    }


def resampled(reader: Reader, inputs: Any, W: Any, c: Any, u: Any) -> Terms:
    """One pass in the first pixel; y_i goes to the pixel of input j as x_i does, for they share numbers and x_c."""
    W, c, (u,) = reader.vector(W), reader.vector(c), reader.vector(u)
    seen = [[shifted(reader, path, leaf, to) for *_, to in inputs] for path, leaf, _ in inputs]
    J = [row[0]["J"] for row in seen]
    p_hat = [reader.mean(row[0]["F"]) for row in seen]
    whole = [
        [reader.mean(x["F"]) * x["J"] / J[i] if J[i] else reader.real(0) for x in row] for i, row in enumerate(seen)
    ]
    w = [reader.m(i, p_hat, whole, c) * p_hat[i] * W[i] * J[i] if p_hat[i] else p_hat[i] for i in range(len(W))]
    s = reader.choose(reader.shares(w), u)
    return {
        "W": W,
        "c": c,
        "p_hat": p_hat,
        "J": J,
        "p_hat_own": [reader.mean(reader.F(path, leaf)) for path, leaf, _ in inputs],
        "p_hat_from": whole,
        "u": u,
        "w": w,
        "w_sum": sum(w),
        "s": s,
        "W_Y": sum(w) / p_hat[s],
    }


def mutated(reader: Reader, path: Path, leaf: Leaf) -> Terms:
    c = reader.c(path, leaf)
    new, T = reader.mutate(path, leaf)
    w = new[c - 2].leaving.w
    if not T:
        return {"w": w, "T": T, "F": reader.black, "z": (reader.real(0),) * reader.d}
    return {"w": w, "T": T, "F": reader.F(new, leaf), "z": new[c - 1].x}
