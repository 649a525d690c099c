"""`python -m restir_ref.audit.make_known` makes known/zoo.json from the bug zoo: half an hour."""

import json
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from restir_ref.audit.estimator import FEW_TO_RERUN, TOLERANCE, facts_of
from restir_ref.audit.known import FILE, digest, pattern
from restir_ref.audit.likeness import loops, signatures, table_of
from restir_ref.oracle.scenes import Scene, random_scene, reference_scene, three_pixel_scene, two_technique_scene
from restir_ref.oracle.zoo import BUGS, Bug

SCENES = (reference_scene, three_pixel_scene, two_technique_scene)

SEEDS = (101,)
"""Of random scenes like a bug's own, on which it may need less, or more."""


def patterns(bug: Bug, scene: Scene) -> Iterator[tuple[str, str]]:
    """What the bug needs in every loop that runs on this scene, is right without it, and shows it: loop and pattern."""
    for loop, right, wrong in loops(bug):
        if abs(table_of(right, scene)).max() <= TOLERANCE < abs(table_of(wrong, scene)).max():
            try:
                yield loop, pattern(facts_of(wrong(scene), scene, FEW_TO_RERUN))
            except ValueError:  # as many outcomes as audits do not run again, or a mistake that mixes columns
                continue


def scenes_of(bug: Bug) -> Iterator[Scene]:
    """Those that ship, and random ones like its own."""
    yield from (make() for make in SCENES)
    yield from (random_scene(bug.scene(), rng=np.random.default_rng(seed)) for seed in SEEDS)


def main() -> None:
    """Write the file."""
    tables = {
        digest(make()): [[each.bug, each.loop, each.bias.tolist()] for each in signatures(make(), TOLERANCE)]
        for make in SCENES
    }
    needs = defaultdict(set)
    for bug in BUGS.values():
        for scene in scenes_of(bug):
            for _, found in patterns(bug, scene):
                needs[found].add(bug.name)
    ordered = {key: sorted(names) for key, names in sorted(needs.items())}
    text = json.dumps({"tables": tables, "patterns": ordered}, indent=0)
    folder = Path(__file__).parent / "known"
    folder.mkdir(exist_ok=True)
    (folder / FILE).write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
