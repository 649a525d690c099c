"""What a run tells while it works: one bar over all chunks on a terminal, plain lines elsewhere."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from tqdm import tqdm

# Mode -> tqdm's `disable`, whose None means "unless on a terminal".
DISABLE: dict[str, bool | None] = {"auto": None, "bar": False, "log": True}


@dataclass
class Progress:
    """A bar or lines on stderr; `mode` is a key of DISABLE."""

    mode: str = "auto"
    _bar: Any = field(default=None, repr=False)

    @contextmanager
    def bar(self, total: int) -> Iterator[None]:
        """Show progress over `total` chunks while the block runs."""
        with tqdm(total=total, unit="chunk", file=sys.stderr, disable=DISABLE[self.mode]) as self._bar:
            yield
        self._bar = None

    def step(self, text: str) -> None:
        """One more chunk is stored."""
        if self._bar is None or self._bar.disable:
            self.say(text)
        else:
            self._bar.set_description_str(text, refresh=False)
            self._bar.update()

    def say(self, text: str) -> None:
        """A line of its own, above the bar if there is one."""
        tqdm.write(f"figures: {text}", file=sys.stderr)


@dataclass
class Sparing:
    """Does something whenever it is called, if since the last time `part` of the time or less went into it."""

    do: Callable[[], object]
    part: float = 0.02
    _again: float = field(default=0.0, repr=False)

    def __call__(self) -> None:
        """Do it, or leave it out."""
        start = time.monotonic()
        if start >= self._again:
            self.do()
            end = time.monotonic()
            self._again = end + (end - start) / self.part
