"""Mutations for the laws: how stationary they are, and what they do to weights alone and between passes."""

from restir_ref.decorrelation import mutate
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.laws import bias_of
from restir_ref.oracle.mutations import Mutation, always, kernel
from restir_ref.oracle.scenes import Scene, offset
from restir_ref.restir import initial, spatial, temporal


def stationarity_error(frame: Frame, mutation: Mutation = mutate) -> float:
    """Largest |(p_hat v) P - p_hat v| relative to the largest p_hat v."""
    pi = (frame.cells.p_hat * frame.cells.v)[0]
    return float(abs(pi @ kernel(frame, 0, mutation).P - pi).max() / (pi.max() or 1))


def asymmetry(frame: Frame, mutation: Mutation = mutate) -> float:
    """Largest difference of the flows between two cells, relative to the largest flow."""
    flow = (frame.cells.p_hat * frame.cells.v)[0][:, None] * kernel(frame, 0, mutation).P
    return float(abs(flow - flow.T).max() / (flow.max() or 1))


def always_accepted(X, here, chance) -> Reservoirs:
    return mutate(X, here, chance, always)


def largest_bias(scene: Scene, mutation: Mutation) -> float:
    """Per cell, of initial samples mutated so."""

    def loop(index, chance):
        here = Pixels(scene.now, index)
        return mutation(initial(here, chance), here, chance)

    return float(abs(bias_of(loop, scene.v, scene.support)).max())


def composed(scene: Scene, names: list[str], mutation: Mutation = mutate):
    before, now = scene.frames

    def loop(index, chance):
        here, there = Pixels(now, index), [offset(now, index, 1)]
        X = initial(here, chance)
        for name in names:
            if name == "temporal":
                Y = initial(Pixels(before, index), chance)
                X = temporal(X, here, Y, [offset(before, index, 1)], chance)
            else:
                X = spatial(X, here, there, chance) if name == "spatial" else mutation(X, here, chance)
        return X

    return loop
