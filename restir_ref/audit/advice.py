"""From facts to advice: where in the code to look first, said as an engine programmer would.

A rule speaks only of what its facts show.  No bug is named here: names need the same exact table (`likeness`), or the
same needs (`patterns`).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from restir_ref.audit.changes import mass_of
from restir_ref.audit.facts import LEAST, Draw, Facts, techniques_of
from restir_ref.batch import Array


@dataclass(frozen=True)
class Rule:
    """When it speaks, what it says, and how it is called in patterns of the zoo."""

    name: str
    holds: Callable[[Facts], bool]
    say: Callable[[Facts], str]


def advice(facts: Facts) -> Iterator[str]:
    """What the rules that hold say, the most telling first."""
    yield from (rule.say(facts) for rule in RULES if rule.holds(facts))


# ---------------------------------------------------------------- pieces of rules


def numbered(values: Sequence[int] | Array) -> str:
    """1, 2 and 4."""
    words = [str(int(each)) for each in values]
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def pixels(values: Array) -> str:
    """pixel 1, or pixels 0 and 1."""
    return f"pixel{'s' if len(values) > 1 else ''} {numbered(values)}"


def fraction(value: float) -> str:
    """A factor, with the small fraction that it is."""
    near = Fraction(value).limit_denominator(16)
    exact = abs(float(near) - value) <= LEAST and near.denominator > 1
    return f"{value:.6g} = {near}" if exact else f"{value:.6g}"


def foreign(facts: Facts) -> list[Draw]:
    """Draws of cells with probabilities that no density of the scene has.

    Equal probabilities may be those of something else (a proposal, a neighbour), if other calls draw the samples.
    """
    tables = facts.scene.now.cells
    among = [each for each in facts.draws if len(each.p) == tables.v.shape[-1]]
    odd = [each for each in among if not techniques_of(each, tables)]
    return [each for each in odd if len(odd) == len(among) or np.ptp(each.p) > LEAST]


def coins(facts: Facts) -> list[Draw]:
    """Draws that look at nothing, among another number of options than there are cells."""
    return [each for each in facts.draws if len(each.p) != facts.scene.v.shape[-1]]


def own_draw_only(facts: Facts) -> bool:
    """Neither other pixels nor earlier frames enter, as far as that was tried."""
    return bool(facts.gone or facts.stays) and not (facts.neighbours or facts.history)


def needs(*names: str) -> Callable[[Facts], bool]:
    """Without one of these the bias is gone."""
    return lambda facts: any(name in facts.gone for name in names)


def sources(facts: Facts) -> str:
    """Whose samples enter."""
    found = [name for name, enters in (("neighbours", facts.neighbours), ("history", facts.history)) if enters]
    return " and ".join(found)


# ---------------------------------------------------------------- what they say


def _foreign(facts: Facts) -> str:
    (draw, *_), mass = foreign(facts), mass_of(facts.scene.now.cells)
    ids = facts.scene.now.ids(np.arange(facts.scene.now.n))
    off = abs(draw.p.T - mass[:, ids]).min(axis=0)
    pixel, cell = np.unravel_index(off.argmax(), off.shape)
    theirs = " or ".join(dict.fromkeys(f"{p:.4f}" for p in mass[:, ids[pixel], cell]))
    return (
        f"how samples are drawn: call {draw.call} of choose() draws cell {cell} of pixel {pixel} with probability "
        f"{draw.p[cell, pixel]:.4f}, but its density times its volume is {theirs}. Compare the sampler with its pdf: "
        "tables off by one, a last entry that is never drawn, a remapped random number."
    )


def _black(facts: Facts) -> str:
    return (
        f"what multiplies the pixel's own sample: {pixels(facts.black)} returned nothing in any outcome, which is no "
        "bias but a zero: a MIS weight that starts at 0 and grows with accepted neighbours, a count of 0, a flag."
    )


def _rates(facts: Facts) -> str:
    return (
        f"MIS between techniques: the weights know the density of technique {numbered(facts.rates)}, but nothing is "
        "drawn from it: its share is never collected. A light that only one technique can find (a point, a direction) "
        "has weight 1; or add the partner's samples."
    )


def _cut_off(facts: Facts) -> str:
    kinds = {
        "bright": "with targets 2^20 times as large: something drops or fades small targets, below an absolute limit",
        "dim": "with targets 2^-20 times as large: something clamps large targets, above an absolute limit",
        "large W": "with weights 2^20 times as large: something drops small W (or large densities)",
        "small W": "with weights 2^-20 times as large: W, or what it is made of, is clamped",
    }
    said = "; ".join(text for name, text in kinds.items() if name in facts.gone)
    return f"absolute limits: the bias is gone {said}."


def _counts(facts: Facts) -> str:
    pixel = int((facts.of.largest - facts.of.least).argmax())
    return (
        f"the confidence (M): in pixel {pixel} it is {facts.of.least[pixel]:.4g} to {facts.of.largest[pixel]:.4g}, "
        "depending on the samples. Something is left out of the count because of its sample: `continue` before M is "
        "added, M = 0 for a sample without light. Count first, then look. [GRIS 6.2]"
    )


def _chosen(facts: Facts) -> str:
    return (
        "the choice, not the weights: E[p_hat W], the mean sum of weights, is right in every pixel, and yet cells are "
        "not. The probability of replacement (the sum before or after w is added), one random number used twice, "
        "colliding seeds of two passes, a sample copied without its number."
    )


def _factor(facts: Facts) -> str:
    return (
        f"counts and normalisations: every cell of every pixel is off by the same factor {fraction(facts.factor)}: "
        "divided by M twice or never, k + 1 inputs where the weights are made for k, MIS weights that sum to it, "
        "a fade or an exposure."
    )


def _shares(facts: Facts) -> str:
    double = " by exactly one more share: both techniques are added in full" if _added(facts) else ""
    return (
        f"MIS between techniques: only cells that several techniques reach are off{double}. The weights of the "
        "techniques do not sum to 1 there: one density is of another measure (area, solid angle), or not the "
        "one that was sampled, or no weight is applied."
    )


def _added(facts: Facts) -> bool:
    now = facts.scene.now
    reach = (now.cells.pdf[:, now.ids(np.arange(now.n))] > 0).sum(axis=0)
    return not differ_from(facts.inside, (reach - 1)[facts.scene.support])


def differ_from(a: Array, b: Array) -> bool:
    """By more than rounding."""
    return bool((abs(a - b) > LEAST).any())


def _outside(facts: Facts) -> str:
    return (
        f"whose target and visibility: {pixels(facts.outside)} returned samples without light there, with a weight. A "
        "sample was taken over with another pixel's answer (shadow ray, target), or without selecting by its target."
    )


def _by_place(facts: Facts) -> str:
    coin = next((c for c in coins(facts) if (abs(c.p - facts.factor) <= LEAST).any()), None)
    thrown = f"; call {coin.call} of choose() is a coin of that probability" if coin else ""
    return (
        f"what is done to some samples only: cells are right or off by the factor {fraction(facts.factor)}{thrown}. "
        "Roulette that is not divided by its probability, a share that is dropped, a cut-off by bounce or distance."
    )


def _own(facts: Facts) -> str:
    return (
        "new samples: no other pixel and no earlier frame enters. Look at how they are drawn, at the pdf they are "
        "divided by, at how many there are, and at the MIS weights between techniques."
    )


def _jacobian(facts: Facts) -> str:
    return (
        f"Jacobians of {sources(facts)}: the bias is gone where J = 1. In w and in every density of the MIS weights, "
        "forth and back; the right exponent; clamped or refused one way only."
    )


def _dark(facts: Facts) -> str:
    return (
        f"dark samples of {sources(facts)}: the bias is gone where every sample has light. Samples that are black "
        "here (hidden, below the horizon, failed shift) still count in M; what cannot make a sample must not "
        "(MIS, 1/Z); visibility must be in the MIS weights if it is in the target."
    )


def _holes(facts: Facts) -> str:
    return (
        f"shifts that fail, from {sources(facts)}: the bias is gone where every shift is defined. An input whose "
        "shift fails has weight 0 but stays in the count; what fails one way has to fail the other way; "
        "MIS must use the same tests as the merge."
    )


def _frames(facts: Facts) -> str:
    return (
        "the previous frame: the bias is gone where both frames are alike. History has to be rated with its own "
        "target, camera and visibility, and evaluated anew in this frame."
    )


def _alike(facts: Facts) -> str:
    return (
        f"what is taken from {sources(facts)} as it is: the bias is gone where all pixels are alike. Target evaluated "
        "anew here, W = sum w / p_hat with p_hat of *this* pixel, MIS weights of the shifted sample, the neighbour's "
        "own visibility, normal or material; 1/M where supports differ."
    )


def _early(facts: Facts) -> str:
    return (
        "new samples and counts: the bias stays where no sample can be shifted, and where all pixels and frames are "
        "alike, so it does not need reuse. Candidates first: their number, their pdf, what divides them; then counts "
        "and confidences of the merge (k asked for against k accepted), the cap, what divides the sum."
    )


def _steps(facts: Facts) -> str:
    draw = next(each for each in steps(facts))
    size = len(draw.p)
    return (
        f"random numbers in steps: call {draw.call} of choose() takes one of {size} equal numbers, which errs by up to "
        f"1/{size} = {1 / size:.1%} by itself. Hold it against fresh numbers in the same steps; or say which numbers "
        "coincide with restir_ref.oracle.seeds, which is exact."
    )


def _trivial(facts: Facts) -> str:
    return (
        f"the arithmetic of merging {sources(facts)}: the bias stays where all pixels and frames are alike, so "
        "geometry, targets and Jacobians are not to blame, and is gone without shifted samples. The sum of weights, "
        "when it grows, W from the sum and not from the selected input, MIS weights that sum to 1, confidences, "
        "the cap, inputs merged twice, who is asked and why, the random numbers."
    )


def _number(facts: Facts) -> str:
    return (
        "tables of its own: with the cells renumbered the bias is another one, so something goes by the number of a "
        "cell (bounce, visibility, conversion). Read the scene's tables when called, or take 'stays' below with care."
    )


STEPS = 8
"""So many equal options are taken for the steps of a random number."""


def steps(facts: Facts) -> list[Draw]:
    """Draws of one of many equal numbers."""
    return [each for each in coins(facts) if len(each.p) >= STEPS and np.ptp(each.p) <= LEAST]


def merges(facts: Facts) -> bool:
    """Samples of others enter."""
    return facts.neighbours or facts.history


def _both(*conditions: Callable[[Facts], bool]) -> Callable[[Facts], bool]:
    return lambda facts: all(holds(facts) for holds in conditions)


def same_everywhere(facts: Facts) -> bool:
    """It stays where everything is alike, and not because of tables of its own."""
    return "all alike" in facts.stays and not facts.by_number


def by_place(facts: Facts) -> bool:
    """Some cells are right, all others off by one factor, in every scene."""
    return facts.factor > 0 and not facts.everywhere and not facts.gone and len(facts.biased) > 1


RULES = (
    Rule("black", lambda facts: len(facts.black) > 0, _black),
    Rule("steps", lambda facts: bool(steps(facts)), _steps),
    Rule("foreign draw", lambda facts: bool(foreign(facts)), _foreign),
    Rule("rates", lambda facts: bool(facts.rates), _rates),
    Rule("one factor", lambda facts: facts.factor > 0 and facts.everywhere, _factor),
    Rule("shares", _both(lambda facts: facts.shared_only, needs("techniques apart")), _shares),
    Rule("confidence", lambda facts: facts.counts_samples, _counts),
    Rule("choice", lambda facts: facts.sum_is_right and len(facts.outside) == 0, _chosen),
    Rule("cut-off", needs("bright", "dim", "large W", "small W"), _cut_off),
    Rule("by place", by_place, _by_place),
    Rule("outside", lambda facts: len(facts.outside) > 0 and not foreign(facts), _outside),
    Rule("J", _both(merges, needs("equal volumes")), _jacobian),
    Rule("dark", _both(merges, needs("lit")), _dark),
    Rule("holes", _both(merges, needs("no holes")), _holes),
    Rule("frames", _both(merges, needs("frames alike")), _frames),
    Rule("alike", _both(merges, needs("all alike")), _alike),
    Rule("early", _both(merges, same_everywhere, lambda facts: "no shifts" in facts.stays), _early),
    Rule("trivial", _both(merges, same_everywhere, needs("no shifts")), _trivial),
    Rule("own", own_draw_only, _own),
    Rule("by number", lambda facts: facts.by_number, _number),
)
"""In this order."""
