"""How tests make the workers of a cluster differ: `alter` something on them, later `restore` it."""

import importlib

from threadpoolctl import threadpool_info, threadpool_limits

KEPT = {}


def alter(module, name, value):
    """Put a value in the place of module.name, in this process."""
    here = importlib.import_module(module)
    KEPT[module, name] = getattr(here, name)
    setattr(here, name, value)


def restore(module, name):
    """Undo `alter`."""
    setattr(importlib.import_module(module), name, KEPT.pop((module, name)))


def other_version(*_):
    return "0.9.9"


def other_code(_):
    return {"code of the engine": "0", "code of DEMO-F01": "1"}


def four_threads():
    return [{"num_threads": 4}]


def no_package(_):
    raise ModuleNotFoundError("No module named 'figures'")


def more_threads():
    threadpool_limits(4)


def blas_threads():
    return max(pool["num_threads"] for pool in threadpool_info())
