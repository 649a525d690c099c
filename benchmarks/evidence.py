"""The slow truth: long runs, each a question with verdicts, filed in docs/evidence.md and benchmarks/evidence.json.

    python benchmarks/evidence.py                   all jobs, hours
    python benchmarks/evidence.py means references  some of them
    python benchmarks/evidence.py --share .01       a hundredth of every count, to see that all works
    python benchmarks/evidence.py --stale           which filed results today's code would have to measure anew

Chunks are stored in out/evidence/ when done; a run that was ended goes on there.  Exits with 1 if a verdict is red,
and when asked for stale ones, if there are any.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]


def main(arguments: Sequence[str]) -> int:
    """Run jobs, print what they say, and file it; 1 if anything does not hold."""
    sys.path.insert(0, str(ROOT))
    from benchmarks.jobs import JOBS, PUBLISH  # noqa: PLC0415  (the path comes first)
    from benchmarks.jobs.job import depends, run  # noqa: PLC0415
    from benchmarks.jobs.report import checkout, file, measured, print_rows, stale  # noqa: PLC0415

    options = parser(list(JOBS)).parse_args(arguments)
    if options.stale:
        said = stale(JOBS, options.results)
        print(
            "\n".join([*said, f"stale: make evidence ARGS=..., of {len(JOBS)} jobs"] if said else ["no job is stale"])
        )
        return int(bool(said))
    for job in JOBS.values():
        depends(job)  # before anybody edits what is loaded now
    fine, begun = True, checkout()
    for name in options.jobs or JOBS:
        done = run(name, JOBS[name], options.share, options.stored, options.processes)
        rows = JOBS[name].judge(done)
        print_rows(name, rows)
        fine &= all(row.holds for row in rows)
        if not options.dry:
            if name in PUBLISH:
                PUBLISH[name](done, options.results)
            file(name, measured(JOBS[name], begun, options.share, rows, done), options.results)
    return int(not fine)


def parser(names: Sequence[str]) -> argparse.ArgumentParser:
    """The command line."""
    found = argparse.ArgumentParser(description="Long runs whose results are committed.")
    found.add_argument("jobs", nargs="*", metavar="JOB", choices=[*names, []], help=f"of {', '.join(names)}")
    found.add_argument("--share", type=float, default=1.0, help="of the full counts; 1 is what is committed")
    found.add_argument("--processes", type=int, default=1, help="how many at a time")
    found.add_argument("--stored", type=Path, default=ROOT / "out" / "evidence", help="folder of finished chunks")
    found.add_argument("--results", type=Path, default=ROOT, help="checkout whose results are brought up to date")
    found.add_argument("--stale", action="store_true", help="measure nothing; 1 if any filed result is stale")
    found.add_argument("--dry", action="store_true", help="print only; leave results and references alone")
    return found


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
