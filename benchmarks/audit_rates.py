"""How often the audits accuse somebody right, and how often they find what was planted: slow, run by hand.

`python benchmarks/audit_rates.py passes 1000 | images 1000 | estimators 100 | fuzz 5000 | blind 30 | zoo 50`
"""

import sys
import tempfile
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from restir_ref.audit import BadDump, audit_dump, audit_estimator, audit_images
from restir_ref.audit.estimator import TOLERANCE, facts_of
from restir_ref.audit.known import needing_the_same
from restir_ref.audit.likeness import FEW_LEAVES, OTHER_LOOPS
from restir_ref.mis import ALL_CANONICAL, WEIGHTS
from restir_ref.oracle.scenes import random_scene, reference_scene, spatial_loop, three_pixel_scene, two_frame_loop
from restir_ref.oracle.zoo import BUGS
from tests.audit.corrupted import BASES, FAMILIES, one_of
from tests.audit.planted import PLANTED
from tests.audit.shader import dumped
from tests.audit.test_conventions import WRITTEN, accused
from tests.audit.test_images import NOISES, TRUTH


def passes(count: int) -> str:
    """Right passes, written in random conventions."""
    found = accused(count)
    return f"{len(found)} of {count} right passes accused"


def estimators(count: int) -> str:
    """Right loops on random scenes."""
    rng, wrong = np.random.default_rng(17), 0
    for k in range(count):
        scene = random_scene([reference_scene, three_pixel_scene][k % 2](), rng=rng)
        names = [name for name, mis in WEIGHTS.items() if mis.unbiased_for != ALL_CANONICAL]
        mis = WEIGHTS[str(rng.choice(names))]
        loop = two_frame_loop(scene, mis, mis) if k % 4 == 0 else spatial_loop(scene, mis, 1)
        wrong += not audit_estimator(loop, scene).unbiased
    return f"{wrong} of {count} right estimators accused"


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


JOBS = {job.__name__: job for job in (passes, estimators, images, fuzz, blind, zoo)}

if __name__ == "__main__":
    start = time.process_time()
    print(JOBS[sys.argv[1]](int(sys.argv[2])), f"({time.process_time() - start:.0f} s)")
