"""`python -m restir_ref.audit.make_known` makes known/zoo.json from the bug zoo: some minutes."""

import json
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from restir_ref.audit.estimator import TOLERANCE, facts_of
from restir_ref.audit.known import FILE, digest, pattern
from restir_ref.audit.likeness import FEW_LEAVES, OTHER_LOOPS, loops, signatures
from restir_ref.oracle.scenes import Scene, reference_scene, three_pixel_scene, two_technique_scene
from restir_ref.oracle.zoo import BUGS, Bug

SCENES = (reference_scene, three_pixel_scene, two_technique_scene)


def patterns(bug: Bug, scene: Scene) -> Iterator[tuple[str, str]]:
    """What the bug needs in every loop that runs on this scene and shows it: loop and pattern."""
    for loop, _, wrong in loops(bug):
        if loop in ("its own loop", *OTHER_LOOPS):
            try:
                facts = facts_of(wrong(scene), scene, FEW_LEAVES)
            except ValueError:  # a loop over two frames on a scene of one, mutations without a table, too many leaves
                continue
            if abs(facts.bias).max() > TOLERANCE:
                yield loop, pattern(facts)


def main() -> None:
    """Write the file."""
    tables = {
        digest(make()): [[each.bug, each.loop, each.bias.tolist()] for each in signatures(make(), TOLERANCE)]
        for make in SCENES
    }
    needs = defaultdict(set)
    for bug in BUGS.values():
        for make in SCENES:
            for _, found in patterns(bug, make()):
                needs[found].add(bug.name)
    ordered = {key: sorted(names) for key, names in sorted(needs.items())}
    text = json.dumps({"tables": tables, "patterns": ordered}, indent=0)
    folder = Path(__file__).parent / "known"
    folder.mkdir(exist_ok=True)
    (folder / FILE).write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
