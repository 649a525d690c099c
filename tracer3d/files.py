"""Pictures on disk: linear PFM, tone mapped PNG, and the state from which a run goes on."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from restir_ref.batch import Array
from tracer3d.render import Job, Picture


def write_pfm(path: Path, L: Array) -> None:
    """Radiance (C, rows, columns) as float32, little endian, bottom row first; C is 1 or 3."""
    channels, rows, columns = L.shape
    head = f"{'PF' if channels == 3 else 'Pf'}\n{columns} {rows}\n-1.0\n"
    path.write_bytes(head.encode() + L.transpose(1, 2, 0)[::-1].astype("<f4").tobytes())


def read_pfm(path: Path) -> Array:
    """Radiance (C, rows, columns).  Raises ValueError, naming the file, for what is no PFM."""
    head, data = _head(path, path.read_bytes())
    kind, columns, rows, scale = head
    channels = {b"PF": 3, b"Pf": 1}[kind]
    if len(data) != 4 * channels * rows * columns:
        raise ValueError(f"{path} says it has {columns} x {rows} pixels, but holds {len(data)} bytes of them.")
    L = np.frombuffer(data, "<f4" if scale < 0 else ">f4").reshape(rows, columns, channels)
    return np.asarray(L[::-1].transpose(2, 0, 1), dtype=float)


def _head(path: Path, data: bytes) -> tuple[tuple[bytes, int, int, float], bytes]:
    try:
        kind, size, scale, rest = data.split(b"\n", 3)
        columns, rows = map(int, size.split())
        head = kind, columns, rows, float(scale)
    except ValueError:
        kind = b""
    if kind not in (b"PF", b"Pf"):
        raise ValueError(f"{path} is no PFM picture: it must begin with PF, the size, and the scale.")
    return head, rest


def write_png(path: Path, L: Array, exposure: float) -> None:
    """Tone mapped radiance (C, rows, columns)."""
    write_shown(path, tone(L, exposure))


def write_shown(path: Path, shown: Array) -> None:
    """What a screen is to show, (C, rows, columns) in [0, 1]."""
    from matplotlib.image import imsave  # noqa: PLC0415

    colours = np.broadcast_to(shown, (3, *shown.shape[1:])).transpose(1, 2, 0)
    imsave(path, np.round(255 * colours).astype(np.uint8))


def exposure(L: Array, percentile: float = 90.0) -> float:
    """.8 / the given percentile of the light in L where there is any; 1 in the dark."""
    lit = L[L > 0]
    return float(0.8 / np.percentile(lit, percentile)) if lit.size else 1.0


def tone(L: Array, exposure: float) -> Array:
    """sRGB(min(e L, 1)): 12.92 v up to v = .0031308, then 1.055 v^(1/2.4) - .055."""
    v = np.clip(exposure * L, 0, 1)
    return np.where(v <= 0.0031308, 12.92 * v, 1.055 * np.maximum(v, 0.0031308) ** (1 / 2.4) - 0.055)


# ---------------------------------------------------------------- what a run leaves behind


def save(out: Path, job: Job, picture: Picture) -> None:
    """OUT.png, OUT.pfm, and OUT.npz, from which the same command goes on."""
    out.parent.mkdir(parents=True, exist_ok=True)
    write_pfm(out.with_suffix(".pfm"), picture.mean)
    write_png(out.with_suffix(".png"), picture.mean, exposure(picture.mean))
    np.savez(out.with_suffix(".npz"), sum=picture.sum, frames=picture.frames, job=json.dumps(asdict(job)))


def load(out: Path, job: Job) -> Picture | None:
    """What a run of the same job has left at OUT, None if there is nothing.  Raises ValueError for another job."""
    path = out.with_suffix(".npz")
    if not path.exists():
        return None
    with np.load(path, allow_pickle=False) as state:
        was, picture = json.loads(str(state["job"])), Picture(state["sum"], int(state["frames"]))
    now = json.loads(json.dumps(asdict(job)))
    changed = [f"{name} {was.get(name)} -> {value}" for name, value in now.items() if was.get(name) != value]
    if changed:
        raise ValueError(
            f"{path} was begun with other settings ({', '.join(changed)}): say another --out, or --anew to drop it."
        )
    return picture
