"""Frames and references as files: NPY, NPZ, PFM, EXR where there is a reader; PNG only if told how it is coded."""

from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from restir_ref.audit.images import BadImages, Decode
from restir_ref.batch import Array


def refused(values: Array) -> Array:
    """PNG holds no linear light unless somebody says so."""
    raise BadImages(
        "a PNG is coded for screens, clipped and rounded to 8 bits: a mean of such values is no mean of light. Write "
        "EXR, PFM or NPY; or say --png linear or --png srgb if you know how it is coded, and that nothing is clipped."
    )


def linear(values: Array) -> Array:
    """Stored as linear light in [0, 1]."""
    return values


def srgb(values: Array) -> Array:
    """Coded as sRGB."""
    return np.asarray(np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4))


DECODERS: Mapping[str, Decode] = MappingProxyType({"refuse": refused, "linear": linear, "srgb": srgb})
"""What to do with a PNG."""


def images(path: Path | str, png: Decode = refused) -> Iterator[Array]:
    """The images of a file or a folder, in the order of their names; a stack (F, H, W) or (F, H, W, C) is F images.

    Raises BadImages for what cannot be read.
    """
    path = Path(path)
    if path.is_dir():
        files = sorted(each for each in path.iterdir() if each.suffix.lower() in READERS)
        if not files:
            raise BadImages(f"{path} holds no images: {', '.join(READERS)} are read.")
        for each in files:
            yield from images(each, png)
        return
    if path.suffix.lower() not in READERS:
        raise BadImages(f"{path.name} is none of {', '.join(READERS)}: write one of them, or give a folder of them.")
    try:
        found = READERS[path.suffix.lower()](path, png)
    except BadImages:
        raise
    except Exception as error:  # hazard: damaged files raise a dozen types
        raise BadImages(f"{path.name} cannot be read ({str(error)[:150] or type(error).__name__}).") from error
    yield from found


def _npy(path: Path, png: Decode) -> Iterator[Array]:
    return _stack(np.load(path, allow_pickle=False, mmap_mode="r"), path)


def _npz(path: Path, png: Decode) -> Iterator[Array]:
    with np.load(path, allow_pickle=False) as archive:
        names = archive.files
        if len(names) != 1:
            raise BadImages(f"{path.name} holds {len(names)} arrays: write one, (F, H, W) or (F, H, W, C).")
        return _stack(archive[names[0]], path)


def _stack(values: Array, path: Path) -> Iterator[Array]:
    """One image or several: the last axis is one of channels if it has at most 4 places."""
    if values.dtype.kind not in "biuf" or values.ndim not in (2, 3, 4) or 0 in values.shape:
        raise BadImages(f"{path.name} has shape {values.shape} of {values.dtype}: write (F, H, W) or (F, H, W, C).")
    single = values.ndim == 2 or (values.ndim == 3 and values.shape[-1] <= 4)
    return iter([np.asarray(values)] if single else values)


def _pfm(path: Path, png: Decode) -> Iterator[Array]:
    """Portable float map: rows from the bottom, little-endian if the scale is negative."""
    with path.open("rb") as file:
        kind, size, scale = file.readline().strip(), file.readline().split(), float(file.readline())
        W, H = int(size[0]), int(size[1])
        C = {b"PF": 3, b"Pf": 1}[kind]
        values = np.frombuffer(file.read(), "<f4" if scale < 0 else ">f4", H * W * C)
    whole = values.reshape(H, W, C)[::-1].astype(float)
    return iter([whole if C > 1 else whole[..., 0]])


def _png(path: Path, png: Decode) -> Iterator[Array]:
    from matplotlib.image import imread  # noqa: PLC0415

    return iter([png(np.asarray(imread(path), dtype=float)[..., :3])])


def _exr(path: Path, png: Decode) -> Iterator[Array]:
    """OpenEXR, by the package of that name."""
    try:
        exr: Any = import_module("OpenEXR")
    except ImportError as error:
        raise BadImages(
            f"{path.name} is EXR, which needs the package OpenEXR: install restir-ref with its extra 'exr', as in "
            "pip install 'restir-ref[exr]'; or write PFM or NPY."
        ) from error
    channels = exr.File(str(path), separate_channels=True).channels()
    names = next((names for names in LIGHT if set(names) <= set(channels)), tuple(channels))
    if not names or (len(names) > 1 and names not in LIGHT):
        raise BadImages(
            f"{path.name} has channels {', '.join(sorted(channels))[:100]}, and none of them is R, G, B or Y: write "
            "the light into these, one image per file."
        )
    values = [np.asarray(channels[name].pixels, dtype=float) for name in names]
    return iter([np.stack(values, axis=-1) if len(values) > 1 else values[0]])


LIGHT = (("R", "G", "B"), ("Y",))
"""Channels of an EXR that are read, beside a single one of whatever name; alpha and depth are left alone."""


READERS: Mapping[str, Callable[[Path, Decode], Iterator[Array]]] = MappingProxyType(
    {".npy": _npy, ".npz": _npz, ".pfm": _pfm, ".exr": _exr, ".png": _png}
)
"""By suffix."""
