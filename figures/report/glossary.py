"""The words of the page, each explained once: verdicts, what is expected, measures of error, scenes, papers."""

import re
from collections.abc import Iterable, Iterator, Mapping
from html import escape

from figures.claims.figure import VERDICTS, Verdict
from figures.engine.manifest import ROOT
from figures.report.markup import badge, word
from figures.report.sources import scenes

PAPERS = {
    "GRIS": "Generalized Resampled Importance Sampling: Foundations of ReSTIR, 2022",
    "GPT": "Gradient-Domain ReSTIR Path Tracing, 2026",
    "DDGIR": "Dynamic Diffuse Global Illumination Resampling, 2022",
    "MCMC": "Blue Noise Distributed MCMC Decorrelation of ReSTIR, 2023",
    "COM": "what all four have in common: units, measures, flatland",
}
MEANING: Mapping[Verdict, str] = {
    "reproduced": "The measured value meets the criterion.",
    "reproduced with caveat": "It meets the criterion; in the respect that is named, what was measured is weaker "
    "than the paper's sentence.",
    "not reproduced": "It misses the criterion; that the opposite holds is not certain, or loop, camera or light are "
    "not the paper's.",
    "refuted": "Under the paper's conditions the opposite holds, with statistical certainty, in the world and at the "
    "preset that are named.",
    "not judged": "This preset is too small to decide, or what is needed is not here; the reason says which.",
    "reported": "A number beside a claim, without a criterion.",
}
WORDS = {
    "expected": "The verdict that the ledger of claims (figures/ledger.json) foresees for a preset, negative ones "
    "included. A run in which another one comes out says so, and ends with exit status 1.",
    "preset": "How much is computed: quick takes minutes, paper hours, with the papers' sample counts. What the paper "
    "preset found is kept in figures/paper.json.",
    "by tests alone": "No figure is about the claim; tests show it, exactly where they can.",
    "not yet": "Neither a figure nor a test shows the claim so far.",
    "world": "Where it is measured: toy1d, integrands on a line; flatland2d, light in the plane; tracer3d, light in "
    "space.",
    "criterion": "The rule by which a value passes or fails. Random error counts: what is too noisy to decide fails.",
}
MEASURES = {
    "bias": "Mean of the estimates minus the truth.",
    "SE": "Standard error, of the mean over independent replicates.",
    "relative variance": "Variance over the square of the mean.",
    "MAPE": "Mean of |I − R| / (R + a hundredth of mean R), image I against reference R.",
    "relMSE": "Mean of (I − R)² / (R² + (a hundredth of mean R)²).",
    "MSE": "Mean of (I − R)².",
    "95%": "An interval that holds the true value 19 times in 20, by resampling the replicates.",
}
OTHER_SCENES = {
    "T0": "Finite cells, small enough that all random choices are enumerated.",
    **dict.fromkeys(("FS11", "FS12", "FS13"), "A room for light probes, still to come."),
}


def known_scenes() -> dict[str, str]:
    """Scene -> what it is: what the sources say, then what has no function of its own."""
    found = {**scenes(ROOT), **OTHER_SCENES}
    return {name: found[name] for name in sorted(found, key=_rank)}


def _rank(name: str) -> tuple[str, int]:
    """FS2 before FS10."""
    return re.sub(r"\d", "", name), int(re.sub(r"\D", "", name) or 0)


def glossary() -> Iterator[str]:
    """The section of words."""
    yield '<section id="words">\n<h2>The words of this page</h2>\n<div class="words">'
    yield from _list("Verdicts", ((name, badge(name), MEANING[name]) for name in VERDICTS))
    for title, terms in (("Terms", WORDS), ("Measures of error", MEASURES), ("Scenes", known_scenes())):
        yield from _list(title, ((name, f"<b>{escape(name)}</b>", text) for name, text in terms.items()))
    yield "</div>\n</section>"


def _list(title: str, terms: Iterable[tuple[str, str, str]]) -> Iterator[str]:
    yield f"<div><h3>{escape(title)}</h3>\n<dl>"
    yield from (f'<dt id="{word(name)}">{shown}</dt><dd>{escape(text)}</dd>' for name, shown, text in terms)
    yield "</dl></div>"


def linked(text: str) -> str:
    """The text as HTML, scenes and measures of error linked to where they are explained."""
    return PATTERN.sub(lambda match: f'<a href="#{word(match[0])}">{match[0]}</a>', escape(text))


PATTERN = re.compile(rf"(?<![\w-])(?:{'|'.join(sorted({'MAPE', 'relMSE', *known_scenes()}, reverse=True))})(?![\w-])")
