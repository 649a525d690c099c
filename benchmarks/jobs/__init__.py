"""The jobs of `make evidence`, one module per question."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from benchmarks.jobs import (
    baselines,
    cached,
    deep_references,
    extremes,
    indirect_references,
    map_gradients,
    means,
    mutations,
    offline,
    probes,
    references,
    retracing,
    roundtrips,
    row_gradients,
    space_gradients,
    space_means,
    space_offline,
    space_references,
    tracing,
    witness,
)
from benchmarks.jobs.job import Done, Job

JOBS: Mapping[str, Job] = MappingProxyType(
    {
        "references": references.JOB,
        "indirect references": indirect_references.JOB,
        "space references": space_references.JOB,
        "all bounces references": deep_references.JOB,
        "round trips": roundtrips.JOB,
        "re-tracing": retracing.JOB,
        "extremes": extremes.JOB,
        "means": means.JOB,
        "space means": space_means.JOB,
        "tracing": tracing.JOB,
        "baselines": baselines.JOB,
        "offline": offline.JOB,
        "space offline": space_offline.JOB,
        "cached": cached.JOB,
        "probes": probes.JOB,
        "gradients": row_gradients.JOB,
        "map gradients": map_gradients.JOB,
        "space gradients": space_gradients.JOB,
        "mutations": mutations.JOB,
        "witness": witness.JOB,
    }
)
PUBLISH: Mapping[str, Callable[[Done, Path], None]] = MappingProxyType(
    {
        "references": references.publish,
        "indirect references": indirect_references.publish,
        "space references": space_references.publish,
        "all bounces references": deep_references.publish,
        "witness": witness.publish,
    }
)
"""What else a job leaves behind, in the checkout at a path."""
