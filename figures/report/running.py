"""How far a run was when the page was written, from its manifest: what is still to come, and the time left."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from html import escape
from typing import Any

RUNNING = "running"


@dataclass(frozen=True)
class Ahead:
    """Figures without a result yet, chunks done and declared, and the seconds left at the pace so far, if known."""

    missing: tuple[str, ...]
    done: int
    chunks: int
    left: float | None


def ahead(manifest: Mapping[str, Any]) -> Ahead:
    """What is still to come; chunks of earlier runs count as done, and do not count for the pace."""
    figures = manifest.get("figures", {})
    missing = tuple(id_ for id_, each in figures.items() if each["status"] == "incomplete")
    chunks = [each["chunks"] for each in figures.values()]
    declared, reused, computed = (sum(each[name] for each in chunks) for name in ("declared", "reused", "computed"))
    elapsed = _seconds(manifest)
    left = elapsed * (declared - reused - computed) / computed if computed and elapsed is not None else None
    return Ahead(missing, reused + computed, declared, left)


def _seconds(manifest: Mapping[str, Any]) -> float | None:
    """From the start of the run to the writing of its manifest."""
    times = [manifest.get(name) for name in ("started", "noted")]
    if not all(times):
        return None
    start, noted = (datetime.fromisoformat(str(time)) for time in times)
    return (noted - start).total_seconds()


def told(manifest: Mapping[str, Any]) -> Iterator[str]:
    """A paragraph while a run is under way or after it ended early; nothing once all is there."""
    there = ahead(manifest)
    if not there.missing:
        return
    count = f"{len(manifest['figures']) - len(there.missing)} of {len(manifest['figures'])} figures are finished"
    yield '<div class="running">'
    if manifest.get("status") == RUNNING:
        time = f", {duration(there.left)} left at the pace so far" if there.left is not None else ""
        yield f"<p><strong>Under way:</strong> {count}, {there.done} of {there.chunks} chunks{time}. "
        yield f"Written at {escape(str(manifest.get('noted', '')))}; reload the page for what came since.</p>"
    else:
        yield f"<p><strong>Ended early</strong> ({escape(str(manifest.get('status')))}): {count}. "
        yield "The same command goes on from there.</p>"
    yield f"<p>Still to come: {escape(', '.join(there.missing))}.</p></div>"


def duration(seconds: float) -> str:
    """In words, no finer than the guess is."""
    minutes = seconds / 60
    if minutes < 1.5:
        return "about a minute"
    return f"about {minutes:.0f} minutes" if minutes < 90 else f"about {minutes / 60:.0f} hours"
