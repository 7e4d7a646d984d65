"""Dang Van's measure of fatigue under stress that rolls by: shear about its own centre, and hydrostatic stress.

max over time of τ(t) + a σ_h(t), against a limit b = τ₋₁ of the material: τ is half of Tresca's
difference of the deviator less the centre of the smallest hypersphere round its path. Source: K.
Dang Van et al. (1989).
"""

import numpy as np
import numpy.typing as npt

from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput

ROUND = 1e-10  # below which a weight, or a way over a sphere's radius, is none
STEPS = 1000  # far more than a path takes
WALK = 50  # steps towards the centres of many spheres at once
PATHS_AT_ONCE = 20_000  # so that they take some 10 MB
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
    bounds = _bounds(deviators, hydrostatic, slope)
    largest = -np.inf
    for path in np.argsort(-bounds):
        if bounds[path] <= largest:
            break
        points = deviators[:, path].T
        about = points - smallest_sphere(points)[0]
        largest = max(largest, float(np.max(_half_tresca(about) + slope * hydrostatic[path])))
    return largest


def dang_van_of_each(stresses: Field, slope: float, *, above: float = -np.inf) -> Field:
    """The measure of every path [Pa], shape (paths,), for as many as a surface has.

    Like `dang_van` but for the spheres, whose centres are walked to, all paths at once: they are 1
    % too large, or two, at most. A path that cannot exceed `above` [Pa] is given a bound that does
    not either.
    """
    hydrostatic = stresses[:3].mean(axis=0)
    deviators = _as_vectors(stresses)
    measure = _bounds(deviators, hydrostatic, slope)
    asked = np.flatnonzero(measure > above)
    for part in np.array_split(asked, max(1, -(-asked.size // PATHS_AT_ONCE))):
        points = np.moveaxis(deviators[:, part], 0, -1)
        about = points - _centres(points)[:, None, :]
        shear = _half_tresca(about.reshape(-1, 5)).reshape(about.shape[:2])
        measure[part] = (shear + slope * hydrostatic[part]).max(axis=1)
    return measure


def _bounds(deviators: Field, hydrostatic: Field, slope: float) -> Field:
    """What the measure of each path cannot exceed [Pa]: half Tresca's difference is at most |s|/sqrt 2."""
    middle = 0.5 * (deviators.max(axis=2) + deviators.min(axis=2))
    radius = np.sqrt(np.square(deviators - middle[:, :, None]).sum(axis=0)).max(axis=1)
    return np.asarray(_HALF * radius + slope * hydrostatic.max(axis=1))


def _centres(points: Field) -> Field:
    """About the centres of the smallest spheres round paths of shape (paths, times, dimensions).

    The middle of two points that are far apart is one where all others lie between. Else the
    centre goes ever shorter ways towards the furthest point; the best of all places is kept.
    Source: M. Bădoiu, K. L. Clarkson (2003).
    """
    squares = np.square(points).sum(axis=2)
    one, _ = _furthest(points, squares, points[:, 0])
    other, apart = _furthest(points, squares, one)
    best = 0.5 * (one + other)
    _, least = _furthest(points, squares, best)
    walking = np.flatnonzero(least > 0.25 * apart * (1.0 + ROUND) + np.finfo(float).tiny)
    points, squares, centre, closest = (
        points[walking],
        squares[walking],
        best[walking],
        least[walking],
    )
    kept = centre.copy()
    for step in range(WALK):
        furthest, distance = _furthest(points, squares, centre)
        closer = distance < closest
        kept[closer], closest[closer] = centre[closer], distance[closer]
        centre += (furthest - centre) / (step + 3.0)
    best[walking] = kept
    return best


def _furthest(points: Field, squares: Field, centre: Field) -> tuple[Field, Field]:
    """Of each path the point that is furthest from its centre, and the squared distance."""
    distances = squares - 2.0 * np.matmul(points, centre[:, :, None])[:, :, 0]
    which, each = distances.argmax(axis=1), np.arange(len(points))
    return points[each, which], distances[each, which] + np.square(centre).sum(axis=1)


def _as_vectors(stresses: Field) -> Field:
    """Deviators as five numbers whose squares add up to those of all nine components, shape (5, ...)."""
    xx, yy, zz, xy, yz, xz = stresses
    root = np.sqrt(2.0)
    return np.stack(
        [_HALF * (xx - yy), _SIXTH * (2.0 * zz - xx - yy), root * xy, root * yz, root * xz]
    )


def _half_tresca(vectors: Field) -> Field:
    """Half the difference of the largest and the smallest principal value of deviators, (times, 5) to (times,)."""
    first, second, xy, yz, xz = vectors.T
    xx, yy, zz = (
        _HALF * first - _SIXTH * second,
        -_HALF * first - _SIXTH * second,
        2.0 * _SIXTH * second,
    )
    xy, yz, xz = _HALF * xy, _HALF * yz, _HALF * xz
    tensors = np.stack(
        [np.stack([xx, xy, xz], -1), np.stack([xy, yy, yz], -1), np.stack([xz, yz, zz], -1)], -1
    )
    values = np.linalg.eigvalsh(tensors)
    return np.asarray(0.5 * (values[:, 2] - values[:, 0]))


def smallest_sphere(points: Field) -> tuple[Field, float]:
    """Centre and radius of the smallest sphere round points, shape (count, dimensions).

    The centre walks towards the circumcentre of the points that it is furthest from, until another
    is as far; those that hold it back no longer are let go. Source: K. Fischer, B. Gärtner, M.
    Kutz (2003).
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
    raise AsperityError(
        "the smallest hypersphere round a path of stress was not found; please report the case"
    )


def _circumcentre(held: Field, centre: Field) -> tuple[Field, Field]:
    """The point nearest to `centre` that lies in the points' own plane, and its weights on them."""
    base, edges = held[0], held[1:] - held[0]
    if edges.size == 0:
        return base, np.ones(1)
    parts, *_ = np.linalg.lstsq(edges.T, centre - base, rcond=None)
    return base + parts @ edges, np.concatenate([[1.0 - parts.sum()], parts])


def _until_stopped(
    points: Field, held: list[int], centre: Field, goal: Field
) -> tuple[float, int | None]:
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
