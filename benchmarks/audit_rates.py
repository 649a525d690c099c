"""How often the audits accuse somebody right, and how often they find what was planted: slow, run by hand.

`python benchmarks/audit_rates.py JOB COUNT`, for JOB passes 1000, estimators 1000, images 1000, fuzz 5000, blind 30,
zoo 50 or matrix 1 (there COUNT is a seed).
"""

import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from restir_ref.audit import BadDump, audit_dump, audit_estimator, audit_images
from restir_ref.audit.estimator import TOLERANCE, facts_of
from restir_ref.audit.known import needing_the_same
from restir_ref.audit.likeness import FEW_LEAVES, OTHER_LOOPS, loops, table_of
from restir_ref.integrals import Pixels
from restir_ref.mis import ALL_CANONICAL, WEIGHTS, Weights
from restir_ref.oracle.scenes import (
    Loop,
    Scene,
    random_scene,
    reference_scene,
    spatial_loop,
    three_pixel_scene,
    two_frame_loop,
)
from restir_ref.oracle.zoo import BUGS
from restir_ref.restir import initial
from tests.audit.corrupted import BASES, FAMILIES, one_of
from tests.audit.planted import PLANTED
from tests.audit.shader import dumped
from tests.audit.test_conventions import WRITTEN, accused
from tests.audit.test_images import NOISES, TRUTH


def passes(count: int) -> str:
    """Right passes, written in random conventions."""
    found = accused(count)
    return f"{len(found)} of {count} right passes accused"


KINDS: dict[str, Callable[[Scene, Weights, np.random.Generator], Loop]] = {
    "one pass": lambda scene, mis, rng: spatial_loop(scene, mis, 1),
    "two passes": lambda scene, mis, rng: (
        spatial_loop(scene, mis, 2) if scene.now.n == 2 else spatial_loop(scene, mis, 1)
    ),
    "two frames": lambda scene, mis, rng: two_frame_loop(scene, mis, mis, cap=float(rng.choice([0.5, 1, 3]))),
    "candidates": lambda scene, mis, rng: lambda index, chance: initial(Pixels(scene.now, index), chance, M=2),
    "the zoo's": lambda scene, mis, rng: BUGS[str(rng.choice(FIT))].right(scene),
}
"""Right loops, given a scene, MIS weights and a generator."""

FIT = [name for name, bug in BUGS.items() if bug.scene is reference_scene and bug.right.steps in OTHER_LOOPS.values()]
"""Bugs whose right loop runs on two frames of two pixels."""


def estimators(count: int) -> str:
    """Right loops on random scenes: one is accused if it is called biased, or told where to look, or given a name."""
    rng, wrong = np.random.default_rng(17), Counter[str]()
    names = [name for name, mis in WEIGHTS.items() if mis.unbiased_for != ALL_CANONICAL]
    for k in range(count):
        kind = [*KINDS][k % len(KINDS)]
        two = k % 2 == 0 or kind in ("two frames", "the zoo's")
        scene = random_scene((reference_scene if two else three_pixel_scene)(), rng=rng)
        report = audit_estimator(KINDS[kind](scene, WEIGHTS[str(rng.choice(names))], rng), scene)
        wrong[kind] += not report.unbiased or bool(report.look_at or report.lookalikes or report.kin)
    return f"{wrong.total()} of {count} right estimators accused; by 95 % fewer than {3 / count:.2%} ({dict(wrong)})"


def images(count: int) -> str:
    """Right images under three kinds of noise, 64 frames of 24 x 24 pixels."""
    rng, wrong = np.random.default_rng(int(time.time())), Counter[str]()
    for k in range(count):
        name = [*NOISES][k % len(NOISES)]
        wrong[name] += audit_images(TRUTH * NOISES[name](rng, (64, 24, 24)), TRUTH).biased
    return f"{wrong.total()} of {count} right images accused ({dict(wrong)})"


def fuzz(count: int) -> str:
    """Corrupted dumps, in memory and as files: a report or a refusal on one line."""
    rng, found = np.random.default_rng(19), Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        for k in range(count):
            name = [*FAMILIES][int(rng.integers(len(FAMILIES)))]
            family = FAMILIES[name]
            broken = family.corrupt(one_of(BASES, rng), rng)
            if family.suffix:
                path = Path(folder, f"{k % 7}{family.suffix}")
                path.write_bytes(broken)
                broken = path
            try:
                str(audit_dump(broken))
                found["report"] += 1
            except BadDump as refused:
                found["refusal" if len(str(refused).splitlines()) == 1 else "two lines"] += 1
    return f"{dict(found)} of {count}, no traceback"


def blind(count: int) -> str:
    """Planted mistakes of passes, in random conventions, by a hidden choice: named, or named wrongly."""
    rng, named, other, silent = np.random.default_rng(int(time.time())), 0, 0, 0
    for _ in range(count):
        name = [*PLANTED][int(rng.integers(len(PLANTED)))]
        shader, mis, given, _ = PLANTED[name]
        ways = [way for way in WRITTEN if "divides W_Y" not in name or way != "undivided"]
        dump = WRITTEN[str(rng.choice(ways))](dumped(given(n=40), mis, shader))
        complete = [each.mistake for each in audit_dump(dump).explanations if each.complete]
        named += name in complete
        other += bool(complete) and name not in complete
        silent += not complete
    return f"{named} of {count} named, {other} named wrongly, {silent} only located"


def zoo(count: int) -> str:
    """Bugs of the zoo in random loops on random scenes, where nothing is kept: named, others named, or none named."""
    rng, found = np.random.default_rng(int(time.time())), Counter[str]()
    while found.total() < count:
        bug = BUGS[str(rng.choice([*BUGS]))]
        steps = [*OTHER_LOOPS.values()][int(rng.integers(len(OTHER_LOOPS)))]
        scene = random_scene(bug.scene(), rng=rng)
        try:
            facts = facts_of(replace(bug.wrong, steps=steps)(scene), scene, FEW_LEAVES)
        except ValueError:
            continue
        if abs(facts.bias).max() > TOLERANCE:
            kin = needing_the_same(facts)
            found["named" if bug.name in kin else "others named" if kin else "none named"] += 1
    return f"{dict(found)} of {count}"


def matrix(seed: int) -> str:
    """Every bug in every loop on a random scene of a seed: named exactly, by what it needs, or not, or wrongly.

    Exactly: the bug in that loop has the table that it has there, so what counts is whether others have it, too, and
    whether the pattern of needs, for loops that are in no table, leads to the bug.
    """
    found, lists = Counter[str](), []
    for bug in BUGS.values():
        scene = random_scene(bug.scene(), rng=np.random.default_rng(seed))
        for loop, right, wrong in loops(bug):
            if abs(table_of(right, scene)).max() > TOLERANCE or abs(table_of(wrong, scene)).max() <= TOLERANCE:
                continue
            try:
                kin = needing_the_same(facts_of(wrong(scene), scene, FEW_LEAVES))
            except ValueError:  # too many outcomes to be run again, or columns that are mixed
                found["not run again"] += 1
                continue
            said = "named" if bug.name in kin else "others named" if kin else "none named"
            found[said] += 1
            if said != "named":
                lists.append(f"  {said}: {bug.name}, {loop}: {', '.join(kin)}")
    return "\n".join([*lists, f"{dict(found)} by what they need, of {found.total()} that show"])


JOBS = {job.__name__: job for job in (passes, estimators, images, fuzz, blind, zoo, matrix)}

if __name__ == "__main__":
    start = time.process_time()
    print(JOBS[sys.argv[1]](int(sys.argv[2])), f"({time.process_time() - start:.0f} s)")
