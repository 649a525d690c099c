"""The commands for those who have images only, or a table of a shift."""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from restir_ref.audit.fields import BadDump
from restir_ref.audit.image_files import DECODERS, images
from restir_ref.audit.image_picture import draw
from restir_ref.audit.images import EPS, BadImages, ImageReport, audit_images, audit_ladder
from restir_ref.audit.shift_table import audit_shift_table, shift_table
from restir_ref.batch import Array

Command = Callable[[Sequence[str]], int]
STATUS = "exit status: 0 unbiased, 1 biased, 2 if images cannot be read, 3 if there are too few frames to decide"


def images_command(arguments: Sequence[str]) -> int:
    """Compare frames with a reference, and print where they are biased."""
    parser = _parser("images", "Test independent frames against a reference: biased where and by how much, or not.")
    parser.add_argument("frames", metavar="FRAMES", help="a folder, or a stack in a .npy or .npz file")
    parser.add_argument("reference", metavar="REFERENCE", help="an image, or a folder or stack of renderings of it")
    parser.add_argument("--out", type=Path, help="draw z and bias into this file (.png or .pdf)")
    options = parser.parse_args(arguments)
    try:
        png = DECODERS[options.png]
        frames, reference = images(options.frames, png), _reference(options.reference, options.png)
        report = audit_images(frames, reference, eps=options.eps, reference_error=options.reference_error)
    except BadImages as error:
        print(f"cannot compare the images: {error}", file=sys.stderr)
        return 2
    print(report)
    if options.out:
        draw(report, options.out)
    return status(report)


def ladder_command(arguments: Sequence[str]) -> int:
    """Compare steps of a renderer with a reference, and print the first that is wrong."""
    parser = _parser("ladder", "Test a renderer step by step, from the simplest on, and name the first wrong step.")
    parser.add_argument("reference", metavar="REFERENCE", help="as for images")
    parser.add_argument(
        "steps", metavar="STEP=FRAMES", nargs="+", help='"initial samples=frames0" "temporal=frames1" ...'
    )
    options = parser.parse_args(arguments)
    named = [step.partition("=") for step in options.steps]
    if not all(name and frames for name, _, frames in named):
        parser.error("steps are NAME=FRAMES, from the simplest on")
    try:
        steps = {name: images(frames, DECODERS[options.png]) for name, _, frames in named}
        reference = _reference(options.reference, options.png)
        found = audit_ladder(steps, reference, eps=options.eps, error=options.reference_error)
    except BadImages as error:
        print(f"cannot compare the images: {error}", file=sys.stderr)
        return 2
    print(found)
    return max(map(status, found.steps.values()), key=lambda each: (each == 1, each)) if found.steps else 0


def shift_command(arguments: Sequence[str]) -> int:
    """Hold laws against a table of a shift, and print which are kept."""
    parser = argparse.ArgumentParser(
        prog="python -m restir_ref.audit shift",
        description="Hold laws against rows (x, y, J) of a shift: slope, way back, clamps.",
        epilog="exit status: 0 right, 1 wrong or suspicious, 2 if the table cannot be read, 3 if it decides too little",
    )
    parser.add_argument(
        "table", metavar="TABLE", help="a .csv, .npz or .json file: x[0], ..., y[0], ..., J, back, J_back"
    )
    try:
        report = audit_shift_table(**shift_table(parser.parse_args(arguments).table))
    except (BadDump, ValueError) as error:
        print(f"cannot read the table: {error}", file=sys.stderr)
        return 2
    print(report)
    return report.status


def status(report: ImageReport) -> int:
    """The exit status of an answer."""
    return 1 if report.biased else 0 if report.unbiased else 3


def _parser(command: str, about: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=f"python -m restir_ref.audit {command}", description=about, epilog=STATUS)
    parser.add_argument("--eps", type=float, default=EPS, help="unbiased to what (default: %(default)s)")
    parser.add_argument(
        "--reference-error", type=float, default=0.0, help="relative standard error of a pixel of a single reference"
    )
    parser.add_argument("--png", choices=list(DECODERS), default="refuse", help="how PNG files are coded")
    return parser


def _reference(path: str, png: str) -> list[Array]:
    return list(images(path, DECODERS[png]))
