"""The notebooks, run and written down as pages to read without Jupyter: `python -m notebooks.pages`.

A page holds every cell and what it shows: printed text, tables, pictures as files beside the page.  Where the notebook
has controls, the first setting is shown and, folded, others of the first control.
"""

import argparse
import ast
import io
import json
import re
import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from pprint import pformat
from typing import Any

from notebooks.show import Explored, Shown, Table, ordered

NOTEBOOKS = Path(__file__).resolve().parent
PAGES = NOTEBOOKS.parent / "docs" / "notebooks"

OTHERS = 5
"""Most other settings of a control that a page shows."""

COLOURS = 256
"""Colours of a picture's file, chosen such that a small dot keeps its own."""

INDEX = """# The notebooks, run

<!-- made by `make notebook-pages` -->

Nine lessons with all that they show, to read here. To work with them, `make notebooks`: there the pictures
have controls, and you write parts of ReSTIR yourself."""

FENCED = re.compile(r"(```python\n.*?\n```)", re.DOTALL)
DISPLAYED, INLINE = re.compile(r"\$\$\n(.*?)\n\$\$", re.DOTALL), re.compile(r"\$([^$`]+)\$")
MARK = re.compile(r"^<!-- (cell-\d+) (markdown|code|shows) -->\n", re.MULTILINE)


@dataclass(frozen=True)
class Cell:
    """A cell of a notebook: its id, "markdown" or "code", and its source."""

    id: str
    kind: str
    source: str


def cells(path: Path) -> list[Cell]:
    """The cells of a notebook."""
    found = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return [Cell(each["id"], each["cell_type"], "".join(each["source"])) for each in found]


def notebooks() -> list[Path]:
    """The notebooks in order."""
    return sorted(NOTEBOOKS.glob("*.ipynb"))


# ---------------------------------------------------------------- run


def run(source: str, names: dict[str, Any], what: str) -> list[Any]:
    """What a code cell shows: printed text, and the value of its last line unless that is None."""
    tree, printed, value = ast.parse(source), io.StringIO(), None
    last = tree.body[-1] if tree.body else None
    upto = tree.body[:-1] if isinstance(last, ast.Expr) else tree.body
    with redirect_stdout(printed):
        exec(compile(ast.Module(upto, []), what, "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), what, "eval"), names)
    return [each for each in (printed.getvalue(), value) if each is not None and each != ""]


# ---------------------------------------------------------------- write


@dataclass(frozen=True)
class Page:
    """Markdown, and the pictures that it links by their paths below the page's folder."""

    text: str
    pictures: Mapping[str, bytes]


def page(path: Path) -> Page:
    """A notebook, run from top to bottom."""
    names: dict[str, Any] = {"__name__": "notebook"}
    lines = [f"<!-- made by `make notebook-pages` from notebooks/{path.name} -->"]
    pictures: dict[str, bytes] = {}
    for cell in cells(path):
        lines.append(
            _mark(cell, cell.kind) + (fenced(cell.source, "python") if cell.kind == "code" else web(cell.source))
        )
        if cell.kind == "code":
            shown = [in_markdown(each, f"{path.stem}/{cell.id}", pictures) for each in run(cell.source, names, cell.id)]
            lines += [_mark(cell, "shows") + "\n\n".join(shown)] if shown else []
    return Page("\n\n".join(lines) + "\n", pictures)


def _mark(cell: Cell, kind: str) -> str:
    return f"<!-- {cell.id} {kind} -->\n"


def web(source: str) -> str:
    """The source with formulas in backticks, where sites that show Markdown leave their backslashes alone."""
    pieces = FENCED.split(source)
    pieces[::2] = [INLINE.sub(r"$`\1`$", DISPLAYED.sub(r"```math\n\1\n```", text)) for text in pieces[::2]]
    return "".join(pieces)


def fenced(text: str, language: str = "text") -> str:
    """A block of code."""
    return f"```{language}\n{text}\n```"


def in_markdown(value: Any, name: str, pictures: dict[str, bytes]) -> str:
    """A shown value; its pictures are added to `pictures` under names that begin with `name`."""
    if isinstance(value, Explored):
        return explored(value, name, pictures)
    if isinstance(value, Shown):
        return picture(value, name, pictures)
    if isinstance(value, Table):
        return table(value)
    return fenced(value.rstrip("\n") if isinstance(value, str) else pformat(value, width=100, compact=True))


def picture(shown: Shown, name: str, pictures: dict[str, bytes]) -> str:
    """A picture with its alternative text."""
    pictures[f"{name}.png"] = compressed(shown.png)
    return f"![{shown.alt.replace('[', '(').replace(']', ')')}]({name}.png)"


def compressed(png: bytes) -> bytes:
    """The picture in COLOURS colours."""
    from PIL import Image  # noqa: PLC0415

    file = io.BytesIO()
    flat = Image.open(io.BytesIO(png)).convert("RGB")
    few = flat.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(file, format="png", optimize=True)
    return file.getvalue()


def explored(value: Explored, name: str, pictures: dict[str, bytes]) -> str:
    """The first setting, what can be chosen in the notebook, and folded some other settings of the first control."""
    words = "; ".join(f"`{option}`: {', '.join(map(str, ordered(values)))}" for option, values in value.choices.items())
    first, values = next(iter(value.choices.items()))
    folded = [
        f"`{first}` = {each}\n\n" + picture(value.at(**{first: each}), f"{name}-{k}", pictures)
        for k, each in enumerate(values[1 : 1 + OTHERS], start=1)
    ]
    setting = ", ".join(f"{option} = {each[0]}" for option, each in value.choices.items())
    lines = [picture(value.at(), name, pictures), f"*Shown: {setting}. The notebook has controls for {words}.*"]
    summary = f"<summary>Other settings of {first}</summary>"
    return "\n\n".join([*lines, f"<details>{summary}", *folded, "</details>"])


def table(value: Table) -> str:
    """A table of Markdown."""
    rows = [[str(cell).replace("|", "\\|") for cell in row] for row in [value.headings, *value.rows]]
    head, *body = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([head, "|" + " --- |" * len(value.headings), *body])


def index() -> str:
    """The list of pages, with what each begins with."""
    lines = [INDEX]
    for path in notebooks():
        title, text = cells(path)[0].source.split("\n\n")[:2]
        lines.append(f"## [{title.lstrip('# ')}]({path.stem}.md)\n\n{web(text)}")
    return "\n\n".join(lines) + "\n"


def write(paths: Sequence[Path], folder: Path) -> Iterator[str]:
    """Run notebooks and write their pages, pictures and the index; yields a line for each."""
    for path in paths:
        start, made = time.perf_counter(), page(path)
        shutil.rmtree(folder / path.stem, ignore_errors=True)
        (folder / path.stem).mkdir(parents=True)
        (folder / f"{path.stem}.md").write_text(made.text, encoding="utf-8")
        for name, png in made.pictures.items():
            (folder / name).write_bytes(png)
        size = sum(map(len, made.pictures.values())) / 1000
        yield f"{path.stem}: {len(made.pictures)} pictures, {size:.0f} kB, {time.perf_counter() - start:.0f} s"
    (folder / "README.md").write_text(index(), encoding="utf-8")


# ---------------------------------------------------------------- read again


def sources(text: str) -> list[Cell]:
    """The cells that a page was made from."""
    _, *parts = MARK.split(text)
    found = zip(parts[::3], parts[1::3], parts[2::3], strict=True)
    return [Cell(name, kind, _unfenced(body, kind)) for name, kind, body in found if kind != "shows"]


def _unfenced(body: str, kind: str) -> str:
    body = body.rstrip("\n")
    if kind == "code":
        return body.removeprefix("```python\n").removesuffix("\n```")
    return re.sub(r"```math\n(.*?)\n```", r"$$\n\1\n$$", body.replace("$`", "$").replace("`$", "$"), flags=re.DOTALL)


def main() -> None:
    """Write the pages of all notebooks, or of those whose names begin with the words given."""
    parser = argparse.ArgumentParser(prog="python -m notebooks.pages", description=main.__doc__)
    parser.add_argument("which", nargs="*", help="01, 02, ...: beginnings of names; none for all")
    which = parser.parse_args().which
    unknown = [each for each in which if not any(path.name.startswith(each) for path in notebooks())]
    if unknown:
        names = ", ".join(path.stem for path in notebooks())
        parser.error(f"no notebook's name begins with {', '.join(unknown)}; there are {names}.")
    for line in write([p for p in notebooks() if not which or p.name.startswith(tuple(which))], PAGES):
        print(line, flush=True)


if __name__ == "__main__":
    main()
