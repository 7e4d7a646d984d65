"""Dang Van's measure of fatigue under stress that rolls by: shear about its own centre, and hydrostatic stress.

max over time of τ(t) + a σ_h(t), against a limit b = τ₋₁ of the material: τ is half of Tresca's difference of the
deviator less the centre of the smallest hypersphere round its path. Source: K. Dang Van et al. (1989).
"""

import numpy as np
import numpy.typing as npt

from asperity.arrays import Field
from asperity.errors import AsperityError, BadInput

ROUND = 1e-10  # below which a weight, or a way over a sphere's radius, is none
STEPS = 1000  # far more than a path takes
_HALF, _SIXTH = np.sqrt(0.5), np.sqrt(1.0 / 6.0)


def dang_van_slope(torsion: float, bending: float) -> float:
    """A = 3 (τ₋₁/σ₋₁ - 1/2) of the limits in reversed torsion and bending [Pa].

    Raises
    ------
    BadInput
        for limits whose ratio no metal has.
    """
    if not 0.5 <= torsion / bending <= 1.0:
        raise BadInput(
            f"fatigue_limits are of reversed torsion and bending, whose ratio lies between 0.5 and 1, got "
            f"{torsion / 1e6:g} and {bending / 1e6:g} MPa; correct them"
        )
    return 3.0 * (torsion / bending - 0.5)


def dang_van(stresses: Field, slope: float) -> float:
    """The largest measure of all paths [Pa].

    Parameters
    ----------
    stresses : xx, yy, zz, xy, yz, xz over each path [Pa], tension positive, shape (6, paths, times)
    slope : a of τ + a σ_h; hydrostatic pressure lowers the measure without bound
    """
    hydrostatic = stresses[:3].mean(axis=0)
    deviators = _as_vectors(stresses)
    middle = 0.5 * (deviators.max(axis=2) + deviators.min(axis=2))
    radius = np.sqrt(np.square(deviators - middle[:, :, None]).sum(axis=0)).max(axis=1)
    bounds = _HALF * radius + slope * hydrostatic.max(axis=1)  # half Tresca's difference is at most |s|/sqrt 2
    largest = -np.inf
    for path in np.argsort(-bounds):
        if bounds[path] <= largest:
            break
        points = deviators[:, path].T
        about = points - smallest_sphere(points)[0]
        largest = max(largest, float(np.max(_half_tresca(about) + slope * hydrostatic[path])))
    return largest


def _as_vectors(stresses: Field) -> Field:
    """Deviators as five numbers whose squares add up to those of all nine components, shape (5, ...)."""
    xx, yy, zz, xy, yz, xz = stresses
    root = np.sqrt(2.0)
    return np.stack([_HALF * (xx - yy), _SIXTH * (2.0 * zz - xx - yy), root * xy, root * yz, root * xz])


def _half_tresca(vectors: Field) -> Field:
    """Half the difference of the largest and the smallest principal value of deviators, (times, 5) to (times,)."""
    first, second, xy, yz, xz = vectors.T
    xx, yy, zz = _HALF * first - _SIXTH * second, -_HALF * first - _SIXTH * second, 2.0 * _SIXTH * second
    xy, yz, xz = _HALF * xy, _HALF * yz, _HALF * xz
    tensors = np.stack([np.stack([xx, xy, xz], -1), np.stack([xy, yy, yz], -1), np.stack([xz, yz, zz], -1)], -1)
    values = np.linalg.eigvalsh(tensors)
    return np.asarray(0.5 * (values[:, 2] - values[:, 0]))


def smallest_sphere(points: Field) -> tuple[Field, float]:
    """Centre and radius of the smallest sphere round points, shape (count, dimensions).

    The centre walks towards the circumcentre of the points that it is furthest from, until another is as far; those
    that hold it back no longer are let go. Source: K. Fischer, B. Gärtner, M. Kutz (2003).
    """
    centre = points[0].copy()
    held = [int(np.argmax(np.square(points - centre).sum(axis=1)))]
    for _ in range(STEPS):
        goal, weights = _circumcentre(points[held], centre)
        step, stop = _until_stopped(points, held, centre, goal)
        centre = centre + step * (goal - centre)
        if stop is not None:
            held.append(stop)
        elif weights.min() >= -ROUND:
            return centre, float(np.sqrt(np.square(points - centre).sum(axis=1).max()))
        else:
            held.pop(int(np.argmin(weights)))
    raise AsperityError("the smallest hypersphere round a path of stress was not found; please report the case")


def _circumcentre(held: Field, centre: Field) -> tuple[Field, Field]:
    """The point nearest to `centre` that lies in the points' own plane, and its weights on them."""
    base, edges = held[0], held[1:] - held[0]
    if edges.size == 0:
        return base, np.ones(1)
    parts, *_ = np.linalg.lstsq(edges.T, centre - base, rcond=None)
    return base + parts @ edges, np.concatenate([[1.0 - parts.sum()], parts])


def _until_stopped(points: Field, held: list[int], centre: Field, goal: Field) -> tuple[float, int | None]:
    """How far towards the goal until a further point is as far away as those held, and which it is."""
    way = goal - centre
    inside = points[held[0]] - centre
    apart = points - points[held[0]]
    along: npt.NDArray[np.float64] = -apart @ way
    room = inside @ inside - np.square(points - centre).sum(axis=1)
    ahead = along > ROUND * (way @ way + inside @ inside)
    ahead[held] = False
    steps = np.full(len(points), np.inf)
    steps[ahead] = np.maximum(room[ahead], 0.0) / (2.0 * along[ahead])
    first = int(np.argmin(steps))
    return (float(steps[first]), first) if steps[first] < 1.0 else (1.0, None)
