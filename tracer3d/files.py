"""Pictures on disk: linear PFM or EXR, tone mapped PNG, and the state from which a run goes on."""

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType
from typing import Any
from zipfile import BadZipFile

import numpy as np

from restir_ref.batch import Array
from tracer3d.names import known
from tracer3d.render import Job, Picture


def linear(out: Path) -> Path:
    """Where the linear picture of a run goes: OUT itself if it is an EXR, else OUT.pfm."""
    return out if out.suffix in LINEAR else out.with_suffix(".pfm")


def read_linear(path: Path) -> Array:
    """Radiance (C, rows, columns), C = 1 or 3.  Raises ValueError for other formats, damage, and what is no light."""
    if path.suffix.lower() == ".png":
        raise ValueError(f"{path} is tone mapped and cannot be measured: give the PFM or EXR beside it.")
    read, _ = known(LINEAR, path.suffix.lower(), "format of a reference")
    L = read(path)
    bad = int((~np.isfinite(L)).sum())
    if bad:
        raise ValueError(f"{path} has {bad} values that are not finite: no error can be held against it.")
    return L


def write_exr(path: Path, L: Array) -> None:
    """Radiance (C, rows, columns) as float32; C is 1 or 3.  Raises ValueError where OpenEXR is missing."""
    exr = _open_exr(path)
    colours = np.ascontiguousarray(np.broadcast_to(L, (3, *L.shape[1:])).transpose(1, 2, 0), dtype=np.float32)
    header = {"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage}
    exr.File(header, {"RGB": colours}).write(str(path))


def read_exr(path: Path) -> Array:
    """Radiance (3, rows, columns), or (1, ...) of a grey one.  Raises ValueError, naming it, for what is no EXR."""
    exr = _open_exr(path)
    data = path.read_bytes()[:4]
    try:
        channels = exr.File(str(path)).channels() if data == EXR else {}
    except Exception as error:  # of whatever kind the library has for damage
        raise ValueError(f"{path} cannot be read as EXR: {str(error)[:120]}.") from error
    for names in ("RGB", "RGBA", "Y"):
        if names in channels:
            L = np.asarray(channels[names].pixels, dtype=float)
            return L[None] if L.ndim == 2 else L[:, :, :3].transpose(2, 0, 1).copy()
    raise ValueError(f"{path} is no EXR with channels R, G and B, or Y, but has {', '.join(channels) or 'none'}.")


EXR = b"\x76\x2f\x31\x01"
"""How an EXR begins."""


def _open_exr(path: Path) -> Any:
    try:
        import OpenEXR  # noqa: PLC0415
    except ImportError:
        raise ValueError(f"{path} needs the package OpenEXR: install restir-ref with its extra 'exr'.") from None
    return OpenEXR


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
    if columns < 1 or rows < 1 or len(data) != 4 * channels * rows * columns:
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


LINEAR: Mapping[str, tuple[Callable[[Path], Array], Callable[[Path, Array], None]]] = MappingProxyType(
    {".pfm": (read_pfm, write_pfm), ".exr": (read_exr, write_exr)}
)
"""Formats of linear pictures by suffix: how they are read and written."""


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


def check_out(out: Path) -> None:
    """Raise ValueError if nothing can be written to OUT: better now than after the last frame."""
    if out.suffix == ".exr":
        _open_exr(out)
    there = next(folder for folder in out.absolute().parents if folder.exists())
    if not there.is_dir() or not os.access(there, os.W_OK):
        raise ValueError(f"nothing can be written to {out}: {there} is no folder, or not yours to write in.")


def save(out: Path, job: Job, picture: Picture) -> None:
    """OUT.png, the linear picture, and OUT.npz, from which the same command goes on."""
    out.parent.mkdir(parents=True, exist_ok=True)
    fresh = out.with_suffix(".part.npz")
    np.savez(fresh, sum=picture.sum, frames=picture.frames, job=json.dumps(asdict(job)))
    fresh.replace(out.with_suffix(".npz"))
    path = linear(out)
    LINEAR[path.suffix][1](path, picture.mean)
    write_png(out.with_suffix(".png"), picture.mean, exposure(picture.mean))


def load(out: Path, job: Job) -> Picture | None:
    """What a run of the same job has left at OUT, None if there is nothing.

    Raises ValueError for another job, a scene file that has changed since, and what is no such run.
    """
    path = out.with_suffix(".npz")
    if not path.exists():
        return None
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as state:
            was, picture = json.loads(str(state["job"])), Picture(state["sum"], int(state["frames"]))
    except (ValueError, KeyError, EOFError, TypeError, BadZipFile) as error:
        raise ValueError(f"{path} is not what a run has left, or is damaged: say another --out, or --anew.") from error
    now = json.loads(json.dumps(asdict(job)))
    changed = [_change(name, was.get(name), value) for name, value in now.items() if was.get(name) != value]
    if changed:
        raise ValueError(
            f"{path} was begun with other settings ({', '.join(changed)}): say another --out, or --anew to drop it."
        )
    return picture


def _change(name: str, was: object, now: object) -> str:
    return "the scene file or a mesh of it has changed" if name == "content" else f"{name} {was} -> {now}"
