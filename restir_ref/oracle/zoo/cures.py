"""The cure of every mistake in the zoo: what the code has to do instead, in one line.

Kept beside the bugs, not in them: a bug is what goes wrong, and its numbers do not depend on what one says of it.
"""

from collections.abc import Mapping
from types import MappingProxyType

CURES: Mapping[str, str] = MappingProxyType(
    {
        # shifts
        "Jacobian left out": "multiply w by J, and every density that MIS shifts by the J of the shift back",
        "inverted Jacobian": "derive J = |dy/dx| for x -> y, then measure it by differences; w is times J, not over",
        "Jacobian of another dimension": "the power of distances is d - 1: 2 in space, 1 in flatland; measure it",
        "rejection not mirrored": "refuse where J > r or 1/J > r, in the merge and in p_hat_from alike",
        "rejection unknown to MIS": "one function `shift` with all its tests, called by the merge and by MIS",
        "rejection only in MIS": "one function `shift` with all its tests, called by the merge and by MIS",
        "two-to-one shift": "return J = 0 where the shift, or its inverse, is not defined; no fallback",
        "target beyond the sampler's support": "let p_hat be 0 where the pixel's own sampler cannot reach",
        # weights
        "1/M over unequal supports": "MIS weights that ask who can make y: Talbot, pairwise, or 1/Z at least",
        "contribution weights over all inputs": "normalise W by the weights that selected, or by 1/Z over the possible",
        "undefined shift kept in MIS": "J = 0 means density 0: p_hat_from = 0 before anything else is read",
        "pairwise targets swapped": "c_i goes with p_hat_from i, C_R with the pixel's own target; try c = (1, 20)",
        "visibility left out of MIS": "the target of MIS is the target of the selection, shadow ray and all",
        "current target for history": "keep last frame's camera and scene, and rate p_hat_from history with them",
        "history overrated in the canonical weight": "form m_c and the others' m from the same p_hat_from",
        "history underrated in the canonical weight": "form m_c and the others' m from the same p_hat_from",
        "history forgotten in the canonical weight": "one test of the motion vector, whose result all weights read",
        "cap only in the denominator": "cap c once, where history is read, and use that number everywhere",
        # passes
        "Jacobian left out of w": "w = m p_hat(y) W J: J belongs into w and into the densities of m",
        "Jacobian clamped in w": "do not clamp J; refuse the shift both ways if it is too large, in MIS too",
        "W clamped": "do not clamp W; cap the confidence of history, or clamp the final radiance and say so",
        "neighbour skipped if its sample cannot be shifted": "add the neighbour's c first, then give it w = 0",
        "neighbour skipped if its shifted target is 0": "add the neighbour's c first, then give it w = 0",
        "input streamed twice": "draw neighbours without repetition, or let the MIS weights count every copy",
        "early out on either Jacobian": "refuse each sample by its own shift; the other keeps its weight",
        "MIS at the unshifted sample": "evaluate m_i at y_i = T_i(X_i), after the shift, with the J of that shift",
        "own MIS term without Jacobian": "p_hat_from i (y_i) = p_hat_i(X_i) / J: divide by the J of the way forth",
        "W of the selected sample kept": "W = sum w / p_hat(Y), with p_hat of this pixel",
        "W of the selected sample times J": "W = sum w / p_hat(Y), with p_hat of this pixel",
        "W formed with the stored target": "evaluate p_hat(Y) anew in this pixel, and divide by that",
        "1/p of the chosen candidate": "store W = (1 / p_hat(Y)) (1/M) sum p_hat / p in place of 1/p",
        "divided by M twice": "either m = 1/M in every w, or 1/M at the end: not both",
        "candidates without light not counted": "count M before looking at the candidate",
        "1/T over unequal samplers": "balance heuristic between techniques: m_t = n_t p_t / sum of n p",
        "streaming against the old sum": "w_sum += w first, then take the candidate if u w_sum < w",
        "sum grown only on accept": "w_sum += w before the branch, whatever is taken",
        # confidence, chance
        "null confidence 0": "a null sample has W = 0 and the confidence of any other",
        "confidence lowered for duplicates": "confidence must not look at samples: lower the cap for all instead",
        "M capped, sum of weights not": "cap c where it is read; never change the c of a stored reservoir alone",
        "neighbour chosen by sample value": "choose neighbours by geometry, or by chance; never by their samples",
        "one seed for two passes": "hash the number of the pass into the seed, or advance one generator",
        "torn reservoirs": "read from one buffer and write into the other",
        "neighbour's shadow ray reused": "trace a shadow ray for the pixel that takes the sample",
        "seeds of pixels and passes collide": "hash (pixel, frame, pass) by a real hash; no sums of multiples",
        # mutations
        "inverted weight update": "W' = W p_hat(x) / p_hat(x'): base over mutated target, so that W p_hat stays",
        "only the last proposal updates": "update x and W in every iteration that accepts, inside the loop",
        "proposal clamped to the unit interval": "wrap the step around, or reject what leaves [0, 1)",
        "blue noise averaged into the acceptance": "accept by the ratio of targets alone, or prefer by p_hat itself",
        "transition ratio left out": "a = p_hat(x') T(x' -> x) / (p_hat(x) T(x -> x')), T in the numbers that follow",
        "transition ratio upside down": "T of the way back stands above, T of the way forth below",
        "blue noise by the printed algorithm": "accept by the ratio of targets alone, in every iteration",
        # candidates
        "sampler one entry off": "test the sampler against its pdf: counts of 10^6 draws, entry by entry",
        "last entry never drawn": "min(int(u n), n - 1); test the sampler against its pdf",
        "two densities for one sampler": "one function that draws and says how likely that was",
        "both techniques added in full": "m_t = p_t / (p_1 + p_2) on both: on rays that miss, and on light samples",
        "partner never sampled": "weigh against techniques that are sampled only; or switch the partner on",
        "lamp without area weighed against directions": "m = 1 for what only light sampling can find",
        "one density in the other measure": "convert by cos / r^2 before comparing, on both sides, in one function",
        "roulette not compensated": "divide the throughput of those that go on by their probability",
        "small targets cut off": "drop by chance, and divide those that stay by their probability",
        "everything faded": "no factor on W or on the contribution; fade in by the display, after the mean",
        "W stored in too few bits": "store W as float; if packed, round at random so that the mean stays",
        "new candidate always taken": "take the candidate if u w_sum < w, with a new u for each",
        "replacement by a shorter sum": "compare with the whole sum, the first candidate included",
        "weight of the chosen group stored": "after the outer level form W anew: sum w / p_hat(Y)",
        "W written on accept only": "write W once, after the last candidate",
        # noise
        "no Jacobian in any MIS weight": "p_hat_from j (y) = p_hat_j(T y) |dT/dy|: Jacobians in all densities",
        "flat proxy target in MIS": "use the target itself as the proxy, visibility included where it can be had",
        "1/Z weights": "Talbot or pairwise weights in the selection",
        "cap after the merge": "cap history where it is read, before it is weighed; then M_c means what it says",
        "no cap on history": "cap the confidence of history, c <- min(c, M_c), with M_c about 20",
        "neighbour merged twice, MIS knows": "draw neighbours without repetition",
        "own sample merged twice, MIS knows": "leave the pixel itself out of its neighbours",
        "result merged with its inputs again": "let the second pass read what the first one wrote",
        "spatial reuse in place": "read from one buffer and write into the other",
        "shifts rejected both ways": "nothing is wrong; widen the threshold until variance no longer falls",
        "neighbour chosen by a coin": "nothing is wrong; choose similar neighbours by depth and normal to gain more",
        "confidence made up per pixel": "the confidence is the number of samples behind a reservoir: add, then cap",
        "densities of two measures compared as they are": "convert all densities to one measure before comparing",
        "reuse that does nothing": "count accepted neighbours; compare both depths in one format; write results back",
    }
)
"""By the names of bugs."""
