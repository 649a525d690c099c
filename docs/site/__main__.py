"""`python -m docs.site` stages the pages, has Sphinx lay them out, and checks what came out; 1 if anything is amiss."""

import argparse
import sys
import time
from pathlib import Path

from docs.site import check, code, layout, stage


def main() -> int:
    """Write the site into a folder: its sources, and `index.html` with all that it needs."""
    parser = argparse.ArgumentParser(prog="python -m docs.site", description=main.__doc__)
    parser.add_argument("--out", type=Path, default=layout.ROOT / "out-docs", help="folder (default: out-docs)")
    out: Path = parser.parse_args().out.resolve()
    start = time.perf_counter()
    count = stage.write(out / "source")
    print(f"{count} pages staged in {time.perf_counter() - start:.0f} s", flush=True)
    status = laid_out(out)
    if status == 0:
        print(f"{code.write(out / 'html')} files of code shown", flush=True)
    problems = [*check.requests(out / "html"), *check.broken(out / "html")] if status == 0 else []
    for line in problems:
        print(f"docs: {line}")
    print(f"{out / 'html' / 'index.html'}: {time.perf_counter() - start:.0f} s, {len(problems)} problems")
    return int(bool(status or problems))


def laid_out(out: Path) -> int:
    """Run Sphinx, warnings being errors; its status."""
    from sphinx.cmd.build import build_main  # noqa: PLC0415  (the extra `docs`)

    own, tree = str(Path(__file__).parent), str(out / "doctrees")
    options = ["-b", "html", "-q", "-W", "--keep-going", "-j", "auto", "-c", own, "-d", tree]
    status: int = build_main([*options, str(out / "source"), str(out / "html")])
    return status


if __name__ == "__main__":
    sys.exit(main())
