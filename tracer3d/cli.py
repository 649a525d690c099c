"""The command `python -m tracer3d`: render, list, compare."""

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.metrics import MAP, mape
from tracer3d import compare, files
from tracer3d.methods import METHODS, PRESETS
from tracer3d.names import known
from tracer3d.render import INTERSECT, Chances, Job, Picture, blank, render
from tracer3d.scene_files import Opened, digest, opened
from tracer3d.scenes import SCENES

Parser = argparse.ArgumentParser
STOPPED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command. 0: done; 2: bad input; 130: stopped by Ctrl-C, and what is done is kept."""
    options = parser().parse_args(argv)
    try:
        work: Callable[[], int] = options.command(options)
    except (ValueError, OSError) as error:
        print(f"tracer3d: error: {error}", file=sys.stderr)
        return 2
    try:
        return work()
    except KeyboardInterrupt:
        print("tracer3d: stopped before anything was done", file=sys.stderr)
        return STOPPED
    except OSError as error:
        print(f"tracer3d: error: {error}", file=sys.stderr)
        return 2


def parser() -> Parser:
    """The command line."""
    root = Parser(prog="python -m tracer3d", description="Render scenes in 3D by path tracing and by ReSTIR.")
    commands = root.add_subparsers(required=True, metavar="COMMAND")
    rendering = commands.add_parser("render", help="one scene by one method", description=RENDER)
    rendering.add_argument("--method", default="restir-pt", metavar="M", help=f"{', '.join(METHODS)} (%(default)s)")
    rendering.add_argument("--frames", type=_some, default=16, metavar="N", help="frames in all (%(default)s)")
    rendering.add_argument("--anew", action="store_true", help="drop what an earlier run has left at --out")
    _picture_options(rendering, Path("out/picture.png"))
    rendering.set_defaults(command=_render)
    comparing = commands.add_parser("compare", help="methods side by side", description=COMPARE)
    comparing.add_argument("--methods", default="path,restir-pt", metavar="M,M", help="default: %(default)s")
    comparing.add_argument("--rays", type=_positive, default=np.inf, metavar="R", help="rays per pixel for each method")
    comparing.add_argument("--seconds", type=_positive, default=np.inf, metavar="T", help="CPU time for each method")
    comparing.add_argument("--trees", type=_some, default=256, metavar="N", help="of our own reference (%(default)s)")
    _picture_options(comparing, Path("out/compared.png"))
    comparing.set_defaults(command=_compare)
    listing = commands.add_parser("list", help="scenes and methods; with --out, a sheet of thumbnails")
    listing.add_argument("scenes", nargs="*", metavar="SCENE", help="a name, or a file NAME.toml; default: all names")
    listing.add_argument("--out", type=Path, metavar="FILE")
    listing.set_defaults(command=_list)
    return root


RENDER = (
    "Writes FILE.png (tone mapped), FILE.pfm (linear; FILE.exr if --out ends so) and FILE.npz, from which the same "
    "command goes on, with more --frames too. Ctrl-C keeps what is done. The picture of a still camera is the mean of "
    "its frames, that of a moving one its last."
)
COMPARE = (
    "Gives every method the same rays or CPU time; prints a table, and draws pictures with maps of their errors. The "
    "camera stands: a moving one shows its last frame, which no budget makes better."
)


def _picture_options(command: Parser, out: Path) -> None:
    command.add_argument("scene", metavar="SCENE", help=f"{', '.join(SCENES)}; or a file NAME.toml")
    command.add_argument("--preset", default="realtime", metavar="P", help=f"{', '.join(PRESETS)} (%(default)s)")
    command.add_argument("--size", type=_size, default=(64, 64), metavar="WxH", help="columns x rows (64x64)")
    command.add_argument(
        "--crop",
        type=_corner,
        nargs="?",
        const=(),
        metavar="X,Y",
        help="the part of the 1920 x 1080 film from column X and row Y on, or the scene's inset; else all of it",
    )
    camera = command.add_mutually_exclusive_group()
    camera.add_argument("--still", action="store_const", const=0.0, dest="moving", help="the camera stands (default)")
    camera.add_argument("--moving", action="store_const", const=1.0, help="the camera slides from frame to frame")
    command.add_argument("--depth", type=_count, metavar="K", help="scattering vertices of the longest paths")
    command.add_argument("--seed", type=_count, default=1, metavar="S", help="(%(default)s)")
    command.add_argument("--intersect", default="brute", metavar="I", help=f"{' or '.join(INTERSECT)} (%(default)s)")
    command.add_argument("--reference", type=Path, metavar="FILE", help="a PFM or EXR to hold errors against")
    command.add_argument("--out", type=Path, default=out, metavar="FILE", help="(%(default)s)")
    command.set_defaults(moving=0.0)


def _job(options: argparse.Namespace, method: str) -> Job:
    content = digest(options.scene)
    crop = opened(options.scene, content).setting.crop if options.crop == () else options.crop
    moving, depth, seed, intersect = options.moving, options.depth, options.seed, options.intersect
    return Job(options.scene, method, options.preset, options.size, crop, moving, depth, seed, content, intersect)


def _noted(found: Opened) -> None:
    """Say what was left out of a scene."""
    for note in found.notes:
        print(f"tracer3d: note: {note}", file=sys.stderr)


def _chances(seed: int) -> Chances:
    return lambda frame: Live(np.random.default_rng((seed, frame)))


def _reference(options: argparse.Namespace, job: Job) -> Array | None:
    if options.reference is None:
        return None
    R = files.read_linear(options.reference)
    if R.shape[1:] != job.size[::-1]:
        columns, rows = job.size
        raise ValueError(
            f"{options.reference} has {R.shape[2]} x {R.shape[1]} pixels, but the picture {columns} x {rows}."
        )
    return R


# ---------------------------------------------------------------- render


def _render(options: argparse.Namespace) -> Callable[[], int]:
    job = _job(options, options.method)
    _noted(opened(job.scene, job.content))
    files.check_out(options.out)
    begun = None if options.anew else files.load(options.out, job)
    R = _reference(options, job)
    _check_camera(job, options.frames)
    return lambda: _run(job, options.frames, options.out, begun or blank(job), R)


def _check_camera(job: Job, frames: int) -> None:
    """Raise ValueError if a moving camera leaves its scene within so many frames."""
    try:
        job.sensor(frames - 1)
    except ValueError as error:
        raise ValueError(f"frame {frames} of the moving camera: {error} Ask for fewer --frames.") from error


def _run(job: Job, frames: int, out: Path, begun: Picture, R: Array | None) -> int:
    """Render, show progress, and keep what there is, whatever ends it."""
    now, status = begun, 0
    with tqdm(total=frames, initial=begun.frames, unit="frame", file=sys.stderr) as bar:
        try:
            for now in render(job, _chances(job.seed), frames, begun, job.compiled()):
                if R is not None:
                    error = float(mape(now.mean.mean(axis=0), R.mean(axis=0), MAP))
                    bar.set_postfix_str(f"MAPE {error:.4f}", refresh=False)
                bar.update()
        except KeyboardInterrupt:
            status = STOPPED
        except ValueError as error:
            print(f"tracer3d: error: frame {now.frames + 1}: {error}", file=sys.stderr)
            status = 2
    if not now.frames:
        print("tracer3d: stopped before the first frame was done; nothing is kept", file=sys.stderr)
        return status
    files.save(out, job, now)
    done = f"{now.frames} of {frames} frames in {out.with_suffix('.png')}, linear in {files.linear(out)}"
    print(f"{done}; the same command goes on from there" if status == STOPPED else done)
    return status


# ---------------------------------------------------------------- compare and list


def _compare(options: argparse.Namespace) -> Callable[[], int]:
    if options.moving:
        raise ValueError(
            "a comparison needs a camera that stands: as many rays are not as many frames, so each method's picture of "
            "a moving one would be of another view. Leave --moving out, or hold the last frames of `render --moving` "
            "against one --reference."
        )
    methods = options.methods.split(",")
    for method in methods:
        known(METHODS, method, "method")
    job, *_ = [_job(options, method) for method in methods]
    _noted(opened(job.scene, job.content))
    files.check_out(options.out)
    budget = compare.Budget(options.rays, options.seconds)
    if budget == compare.Budget():
        raise ValueError("a comparison needs a budget: say --rays 1000, or --seconds 10.")
    R = _reference(options, job)
    return lambda: _side_by_side(
        job, methods, budget, _path_traced(job, options.trees) if R is None else R, options.out
    )


def _path_traced(job: Job, trees: int) -> Array:
    """A reference with random numbers of its own."""
    by_path = replace(job, method="path", preset="realtime", seed=job.seed + 1)
    *_, last = tqdm(
        render(by_path, _chances(job.seed + 1), trees, blank(by_path), job.compiled()),
        total=trees,
        desc="reference",
        file=sys.stderr,
    )
    return last.mean


def _side_by_side(job: Job, methods: Sequence[str], budget: compare.Budget, R: Array, out: Path) -> int:
    """Compare, and keep what there is, whatever ends it."""
    rows: list[compare.Row] = []
    try:
        rows += compare.compared(job, methods, budget, _chances(job.seed))
    except KeyboardInterrupt:
        if not rows:
            raise
    print(compare.table(rows, R))
    compare.sheet(out.with_suffix(".png"), rows, R)
    left = ",".join(methods[len(rows) :])
    print(f"pictures and errors in {out.with_suffix('.png')}" + (f"; to go on, say --methods {left}" if left else ""))
    return STOPPED if left else 0


def _list(options: argparse.Namespace) -> Callable[[], int]:
    names = options.scenes or [*SCENES]
    found = {name: opened(name, digest(name)) for name in names}
    if options.out is not None:
        files.check_out(options.out)
        for name in names:
            _thumbnail(name)

    def work() -> int:
        print("scenes:")
        for name, each in found.items():
            _noted(each)
            print(f"  {name:23} {each.title}" + (f"\n{_described(each)}" if options.scenes else ""))
        print("methods:")
        for name, method in METHODS.items():
            print(f"  {name:23} {method.words}")
        return 0 if options.out is None else _thumbnails(names, options.out)

    return work


def _described(found: Opened) -> str:
    """What a scene is made of, and who looks at it."""
    at, s = found.setting, found.setting.scene
    made = (
        f"{s.S} triangles ({len(s.lights.upto)} shine), {s.radii.size} spheres, {len(s.materials.roughest)} materials"
    )
    return f"    {made}\n    seen from {at.eye} towards {at.towards}, depth {at.depth}, inset at {at.crop}"


def _thumbnail(name: str) -> Job:
    return Job(name, "path", size=(160, 90))


def _thumbnails(names: Sequence[str], out: Path, trees: int = 8) -> int:
    """Every scene, small, side by side."""
    shown = []
    for job in tqdm([_thumbnail(name) for name in names], unit="scene", file=sys.stderr):
        *_, last = render(job, _chances(1), trees, blank(job), job.compiled())
        shown.append(files.tone(last.mean, files.exposure(last.mean)))
    shown += [np.ones_like(shown[0])] * (len(shown) > 1 and len(shown) % 2)
    pairs = [np.concatenate(shown[k : k + 2], axis=2) for k in range(0, len(shown), 2)]
    out.parent.mkdir(parents=True, exist_ok=True)
    files.write_shown(out.with_suffix(".png"), np.concatenate(pairs, axis=1))
    print(f"thumbnails in {out.with_suffix('.png')}, two in a row, in this order")
    return 0


# ---------------------------------------------------------------- words into numbers


def _count(text: str) -> int:
    if not text.isascii() or not text.isdigit():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number")
    return int(text)


def _some(text: str) -> int:
    if not (value := _count(text)):
        raise argparse.ArgumentTypeError(f"{text!r} is none: at least 1 is needed")
    return value


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not value > 0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive number")
    return value


def _size(text: str) -> tuple[int, int]:
    return _pair(text, "x", "a size, columns x rows, such as 64x48")


def _corner(text: str) -> tuple[int, int]:
    return _pair(text, ",", "a column and a row, such as 928,508")


def _pair(text: str, between: str, wanted: str) -> tuple[int, int]:
    parts = text.split(between)
    if len(parts) != 2 or not all(part.isascii() and part.isdigit() for part in parts):
        raise argparse.ArgumentTypeError(f"{text!r} is not {wanted}")
    return int(parts[0]), int(parts[1])
