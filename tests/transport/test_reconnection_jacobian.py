"""The geometric Jacobian of a reconnection, |cos_y / cos_x| (r_x / r_y)^(d-1), by finite differences.  [GRIS Eq. 52]"""

import numpy as np
import pytest

every_dimension = pytest.mark.parametrize("d", [2, 3, 4])
H = 1e-5


def geometry(d: int, seed: int) -> tuple[np.ndarray, ...]:
    """x_i, y_i above the plane through z with normal n: one random configuration."""
    rng = np.random.default_rng(seed)
    n = rng.normal(size=d)
    n /= np.linalg.norm(n)
    z = rng.normal(size=d)
    x, y = (z + v + (1.5 - n @ v) * n for v in rng.normal(size=(2, d)))
    return x, y, z, n


def formula(x, y, z, n, power: int) -> float:
    """dw_y / dw_x with the distances to the given power."""
    r_x, r_y = np.linalg.norm(z - x), np.linalg.norm(z - y)
    return float(abs(((z - y) @ n / r_y) / ((z - x) @ n / r_x)) * (r_x / r_y) ** power)


def measured(x, y, z, n) -> float:
    """Move the direction at x, meet the plane again, and see how the direction at y moves: a determinant."""
    tangents_x, tangents_y = (np.linalg.svd((z - p)[None])[2][1:] for p in (x, y))
    w = (z - x) / np.linalg.norm(z - x)
    columns = []
    for t in tangents_x:
        ends = []
        for sign in (1, -1):
            turned = w + sign * H * t
            met = x + turned * ((z - x) @ n) / (turned @ n)
            ends.append((met - y) / np.linalg.norm(met - y))
        columns.append(tangents_y @ (ends[0] - ends[1]) / (2 * H))
    return float(abs(np.linalg.det(np.array(columns))))


@pytest.mark.claims("GRIS-E52")
@every_dimension
def test_the_reconnection_jacobian_is_that_of_finite_differences(d) -> None:
    errors = [abs(formula(*geometry(d, k), d - 1) / measured(*geometry(d, k)) - 1) for k in range(200)]
    assert max(errors) < 1e-5


@pytest.mark.claims("GRIS-E52")
@every_dimension
def test_a_wrong_power_of_the_distance_or_swapped_ends_are_caught(d) -> None:
    """Among them r^2 in flatland, which is off by more than 3 somewhere."""
    wrong = [formula(*geometry(d, k), d) / measured(*geometry(d, k)) for k in range(200)]
    assert max(np.maximum(wrong, 1 / np.array(wrong))) > 2
    swapped = [1 / formula(*geometry(d, k), d - 1) / measured(*geometry(d, k)) for k in range(200)]
    assert np.median(np.abs(np.log(swapped))) > 0.1
