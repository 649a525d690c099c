"""The command `python -m figures`: list, run, report, ledger."""

import argparse
import json
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path

from figures.claims import ledger, showings
from figures.claims.errors import FigureError
from figures.claims.figure import PRESETS, Entry
from figures.claims.ledger import Row
from figures.claims.verdicts import Judged
from figures.engine import audit, cluster, jobs, kept, registry, run, session, summary
from figures.engine.jobs import Crew
from figures.engine.progress import DISABLE, Progress
from figures.project import Project
from figures.report import legible, press, report, tables

SEED = 20220711
FOLDER = Path("out")
HERE = Project()


def main(argv: Sequence[str] | None = None, project: Project = HERE) -> int:
    """Run one command. 0: as expected; 1: crash or unexpected verdict; 2: bad input; 130: interrupted."""
    options = parser().parse_args(argv)
    try:
        return int(options.command(options, project))
    except FigureError as error:
        print(f"figures: error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("figures: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:  # the reader of our output has left; what Python flushes at exit goes nowhere
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        print(f"figures: error: {error}", file=sys.stderr)
        return 2


def parser() -> argparse.ArgumentParser:
    """The command line."""
    root = argparse.ArgumentParser(
        prog="python -m figures",
        description="Regenerate the papers' figures, check the papers' claims, and report.",
    )
    commands = root.add_subparsers(required=True, metavar="COMMAND")
    shown = commands.add_parser("list", help="the figures there are", description="List the figures.")
    _json_option(shown)
    shown.set_defaults(command=_list)
    _run_options(commands.add_parser("run", help="compute figures and check their claims", description=RUN))
    again = commands.add_parser("report", help="rebuild the report from stored results", description=REPORT)
    _out_option(again, "folder of stored results")
    again.set_defaults(command=_report)
    claims = commands.add_parser("ledger", help="every claim, who checks it, its verdict", description=LEDGER)
    _json_option(claims)
    _out_option(claims, "folder whose verdicts.json is read, if there is one")
    claims.set_defaults(command=_ledger)
    keeping = commands.add_parser(
        "keep", help="file the verdicts of a paper run in figures/paper.json", description=KEEP
    )
    _out_option(keeping, "folder of a paper run")
    keeping.set_defaults(command=_keep)
    auditing = commands.add_parser("audit", help="check that ledger, kept runs and results fit", description=AUDIT)
    _out_option(auditing, "folder of results that are checked, if there is one")
    auditing.set_defaults(command=_audit)
    return root


RUN = (
    "Compute figures chunk by chunk, check their claims, write pictures, arrays and one HTML report. "
    "The same command resumes a run that was interrupted or killed. "
    "Exit status: 0 all verdicts as expected; 1 a figure crashed or a verdict differs from the expected one; "
    "2 bad input or an unusable folder; 130 interrupted."
)
REPORT = "Rebuild verdicts.json and index.html from stored results; computes nothing."
KEEP = "File what finished figures of a paper run found: verdicts, digests and the commit; the others stay as they are."
AUDIT = (
    "Check that criteria name the scenes and worlds of their rows, that kept paper runs are not stale and are what the "
    "ledger expects, and that stored results crash nowhere and drop no part of a claim. "
    "Exit status 1 if anything is amiss."
)
LEDGER = "Show every claim with its tests, figures, evidence and benchmarks, by world, and its newest verdict."


def _run_options(command: argparse.ArgumentParser) -> None:
    command.add_argument("ids", nargs="*", metavar="ID", help="figures to run (default: all; see `list`)")
    command.add_argument("--preset", choices=PRESETS, default="quick", help="size of the run (default: %(default)s)")
    workers = command.add_mutually_exclusive_group()
    workers.add_argument(
        "--jobs",
        type=_jobs,
        default=1,
        metavar="N",
        help="worker processes; 0 or auto: one per core; results do not depend on it (default: %(default)s)",
    )
    workers.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="compute on the Dask cluster whose scheduler is there, such as tcp://host:8786 (needs '.[dask]')",
    )
    command.add_argument("--seed", type=_seed, default=SEED, metavar="S", help="root seed (default: %(default)s)")
    command.add_argument(
        "--progress",
        choices=tuple(DISABLE),
        default="auto",
        help="bar, plain log lines, or auto: a bar on a terminal (default: %(default)s)",
    )
    _out_option(command, "folder of results, created if missing")
    command.set_defaults(command=_run)


def _json_option(command: argparse.ArgumentParser) -> None:
    command.add_argument("--json", action="store_true", help="print JSON instead of a table")


def _out_option(command: argparse.ArgumentParser, what: str) -> None:
    command.add_argument("--out", type=Path, default=FOLDER, metavar="DIR", help=f"{what} (default: %(default)s)")


def _jobs(text: str) -> int:
    return 0 if text == "auto" else _count(text, "a number of workers, 0 or auto")


def _seed(text: str) -> int:
    return _count(text, "an integer of at least 0")


def _count(text: str, wanted: str) -> int:
    if not text.isascii() or not text.isdigit():
        raise argparse.ArgumentTypeError(f"{text!r} is not {wanted}")
    return int(text)


def _list(options: argparse.Namespace, project: Project) -> int:
    entries = registry.load(project.modules)
    rows = [tables.figure_row(entry) for entry in entries.values()]
    print(json.dumps(rows, indent=1) if options.json else tables.figures(rows))
    return 0


def _run(options: argparse.Namespace, project: Project) -> int:
    entries, rows = registry.load(project.modules), ledger.load(project.ledger)
    chosen = tuple(registry.select(entries, options.ids))
    _refuse(list(ledger.unknown(rows, chosen)))
    progress, hooks = Progress(options.progress), session.Press(press.drawn, _report_of(project, rows, entries))
    with _crew(options, chosen, progress) as crew:
        request = session.Request(chosen, options.preset, options.seed, crew, hooks, options.out)
        status, judged = run.run(request, rows, entries, project.paper, progress)
    _say(judged, project, options.out)
    return status


def _report_of(
    project: Project, rows: Mapping[str, Row], entries: Mapping[str, Entry]
) -> Callable[[Path], list[Judged]]:
    """What writes this project's page into a folder of results."""
    found = showings.showings(project.tests, project.benchmarks, rows, entries)
    return partial(report.write, source=report.Source(rows, entries, found, project.paper))


def _crew(options: argparse.Namespace, chosen: Sequence[Entry], progress: Progress) -> AbstractContextManager[Crew]:
    if options.dask is None:
        return nullcontext(jobs.crew(options.jobs))
    return cluster.crew(options.dask, chosen, progress.say)


def _report(options: argparse.Namespace, project: Project) -> int:
    rows, entries = ledger.load(project.ledger), registry.load(project.modules)
    judged = _report_of(project, rows, entries)(options.out)
    _say(judged, project, options.out)
    return 0


def _say(judged: Sequence[Judged], project: Project, out: Path) -> None:
    """The summary of a folder of results, and where its report stands."""
    misfits = audit.misfits(out, ledger.load(project.ledger), registry.load(project.modules), project.paper)
    print(tables.summary(judged, tables.crashes(out), misfits))
    print(f"report: {out / 'index.html'}")


def _ledger(options: argparse.Namespace, project: Project) -> int:
    rows, entries = ledger.load(project.ledger), registry.load(project.modules)
    _refuse(list(ledger.unknown(rows, entries.values())))
    found, newest = showings.showings(project.tests, project.benchmarks, rows, entries), summary.read(options.out)
    paper = kept.verdicts(kept.read(project.paper), registry.declared(entries))
    listing = [tables.claim_row(row, found[id_], newest.get(id_), paper.get(id_)) for id_, row in rows.items()]
    print(json.dumps(listing, indent=1) if options.json else tables.claims(listing))
    return 0


def _keep(options: argparse.Namespace, project: Project) -> int:
    for line in kept.keep(options.out, registry.load(project.modules), project.paper):
        print(line)
    return 0


def _audit(options: argparse.Namespace, project: Project) -> int:
    entries, rows = registry.load(project.modules), ledger.load(project.ledger)
    problems = [*audit.problems(project.paper, rows, entries, options.out), *legible.problems(options.out)]
    print("\n".join([*problems, f"{len(problems)} problems" if problems else "nothing to mend"]))
    for line in audit.remarks(project.paper, entries):
        print(line)
    return int(bool(problems))


def _refuse(problems: Sequence[str]) -> None:
    if problems:
        raise FigureError("; ".join(problems))
