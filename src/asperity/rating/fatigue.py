"""Dang Van criterion of multiaxial fatigue for rolling contacts.

The measure, the maximum over time of τ(t) + a σ_h(t), is compared with the material's limit b =
τ₋₁. τ is half the Tresca stress of the deviator relative to the centre of the smallest hypersphere
around its path. Source: K. Dang Van et al. (1989).
"""

import numpy as np
import numpy.typing as npt

from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput

ROUNDING = 1e-10  # tolerance of weights, and of steps over a sphere's radius
MAX_STEPS = 1000  # of the exact algorithm, far more than needed
APPROXIMATION_STEPS = 50  # of the approximate algorithm for many paths
BATCH_PATHS = 20_000  # about 10 MB
_SQRT_HALF, _SQRT_SIXTH = np.sqrt(0.5), np.sqrt(1.0 / 6.0)


def dang_van_slope(torsion: float, bending: float) -> float:
    """Return a = 3 (τ₋₁/σ₋₁ - 1/2) from the limits in reversed torsion and bending [Pa].

    Raises
    ------
    BadInput
        The ratio of the limits is impossible for metals.

    Examples
    --------
    >>> from asperity.rating import dang_van_slope
    >>> f"{dang_van_slope(torsion=400e6, bending=600e6):.3f}"
    '0.500'
    """
    if not 0.5 <= torsion / bending <= 1.0:
        raise BadInput(
            "fatigue_limits are of reversed torsion and bending, whose ratio lies between 0.5 and "
            f"1, got {torsion / 1e6:g} and {bending / 1e6:g} MPa; correct them"
        )
    return 3.0 * (torsion / bending - 0.5)


def dang_van(stresses: Field, slope: float) -> float:
    """Return the largest measure of all paths [Pa].

    Parameters
    ----------
    stresses : xx, yy, zz, xy, yz, xz over each path [Pa], tension positive, shape (6, paths, times)
    slope : a of τ + a σ_h; hydrostatic pressure lowers the measure
    """
    hydrostatic = stresses[:3].mean(axis=0)
    deviators = _as_vectors(stresses)
    bounds = _bounds(deviators, hydrostatic, slope)
    largest = -np.inf
    for path in np.argsort(-bounds):
        if bounds[path] <= largest:
            break
        points = deviators[:, path].T
        relative = points - smallest_sphere(points)[0]
        largest = max(largest, float(np.max(_half_tresca(relative) + slope * hydrostatic[path])))
    return largest


def dang_van_per_path(stresses: Field, slope: float, *, above: float = -np.inf) -> Field:
    """Return the measure of every path [Pa], shape (paths,), for many paths such as a surface's.

    The spheres are approximated, all paths at once; they are at most 1 to 2 % too large. A path
    that cannot exceed `above` [Pa] gets an upper bound instead, which does not exceed it either.
    """
    hydrostatic = stresses[:3].mean(axis=0)
    deviators = _as_vectors(stresses)
    measure = _bounds(deviators, hydrostatic, slope)
    relevant = np.flatnonzero(measure > above)
    for part in np.array_split(relevant, max(1, -(-relevant.size // BATCH_PATHS))):
        points = np.moveaxis(deviators[:, part], 0, -1)
        relative = points - _centres(points)[:, None, :]
        shear = _half_tresca(relative.reshape(-1, 5)).reshape(relative.shape[:2])
        measure[part] = (shear + slope * hydrostatic[part]).max(axis=1)
    return measure


def _bounds(deviators: Field, hydrostatic: Field, slope: float) -> Field:
    """Return an upper bound of each path's measure [Pa]: half Tresca is at most |s|/sqrt 2."""
    middle = 0.5 * (deviators.max(axis=2) + deviators.min(axis=2))
    radius = np.sqrt(np.square(deviators - middle[:, :, None]).sum(axis=0)).max(axis=1)
    return np.asarray(_SQRT_HALF * radius + slope * hydrostatic.max(axis=1))


def _centres(points: Field) -> Field:
    """Return approximate centres of the smallest spheres around paths (paths, times, dimensions).

    The mid-point of two distant points is the centre if all others lie within their sphere.
    Otherwise the centre moves by decreasing steps towards the furthest point, and the best position
    counts. Source: M. Bădoiu, K. L. Clarkson (2003).
    """
    squares = np.square(points).sum(axis=2)
    first, _ = _furthest(points, squares, points[:, 0])
    second, separation = _furthest(points, squares, first)
    centres = 0.5 * (first + second)
    _, smallest = _furthest(points, squares, centres)
    open_paths = np.flatnonzero(
        smallest > 0.25 * separation * (1.0 + ROUNDING) + np.finfo(float).tiny
    )
    points, squares, centre, smallest = (
        points[open_paths],
        squares[open_paths],
        centres[open_paths],
        smallest[open_paths],
    )
    best = centre.copy()
    for step in range(APPROXIMATION_STEPS):
        furthest, distance = _furthest(points, squares, centre)
        closer = distance < smallest
        best[closer], smallest[closer] = centre[closer], distance[closer]
        centre += (furthest - centre) / (step + 3.0)
    centres[open_paths] = best
    return centres


def _furthest(points: Field, squares: Field, centre: Field) -> tuple[Field, Field]:
    """Return each path's point that is furthest from its centre, and the squared distance."""
    distances = squares - 2.0 * np.matmul(points, centre[:, :, None])[:, :, 0]
    furthest = distances.argmax(axis=1)
    paths = np.arange(len(points))
    return points[paths, furthest], distances[paths, furthest] + np.square(centre).sum(axis=1)


def _as_vectors(stresses: Field) -> Field:
    """Return deviators as five components with the same Euclidean norm, shape (5, ...)."""
    xx, yy, zz, xy, yz, xz = stresses
    root = np.sqrt(2.0)
    return np.stack(
        [
            _SQRT_HALF * (xx - yy),
            _SQRT_SIXTH * (2.0 * zz - xx - yy),
            root * xy,
            root * yz,
            root * xz,
        ]
    )


def _half_tresca(vectors: Field) -> Field:
    """Return half the Tresca stress of deviators, shape (times, 5) to (times,)."""
    first, second, xy, yz, xz = vectors.T
    xx = _SQRT_HALF * first - _SQRT_SIXTH * second
    yy = -_SQRT_HALF * first - _SQRT_SIXTH * second
    zz = 2.0 * _SQRT_SIXTH * second
    xy, yz, xz = _SQRT_HALF * xy, _SQRT_HALF * yz, _SQRT_HALF * xz
    tensors = np.stack(
        [np.stack([xx, xy, xz], -1), np.stack([xy, yy, yz], -1), np.stack([xz, yz, zz], -1)], -1
    )
    values = np.linalg.eigvalsh(tensors)
    return np.asarray(0.5 * (values[:, 2] - values[:, 0]))


def smallest_sphere(points: Field) -> tuple[Field, float]:
    """Return centre and radius of the smallest sphere around points, shape (count, dimensions).

    The centre moves towards the circumcentre of its support, the furthest points, until another
    point is as far; points with negative weights leave the support. Source: K. Fischer, B. Gärtner,
    M. Kutz (2003).
    """
    centre = points[0].copy()
    support = [int(np.argmax(np.square(points - centre).sum(axis=1)))]
    for _ in range(MAX_STEPS):
        target, weights = _circumcentre(points[support], centre)
        step, new_point = _step_to_next_point(points, support, centre, target)
        centre = centre + step * (target - centre)
        if new_point is not None:
            support.append(new_point)
        elif weights.min() >= -ROUNDING:
            return centre, float(np.sqrt(np.square(points - centre).sum(axis=1).max()))
        else:
            support.pop(int(np.argmin(weights)))
    raise AsperityError(
        "the smallest hypersphere around a stress path was not found; please report the case"
    )


def _circumcentre(support: Field, centre: Field) -> tuple[Field, Field]:
    """Return the point of the support's affine hull nearest to `centre`, and its weights."""
    base = support[0]
    edges = support[1:] - support[0]
    if edges.size == 0:
        return base, np.ones(1)
    parts, *_ = np.linalg.lstsq(edges.T, centre - base, rcond=None)
    return base + parts @ edges, np.concatenate([[1.0 - parts.sum()], parts])


def _step_to_next_point(
    points: Field, support: list[int], centre: Field, target: Field
) -> tuple[float, int | None]:
    """Return the relative step to the target at which another point joins the support, and it."""
    direction = target - centre
    radius = points[support[0]] - centre
    offsets = points - points[support[0]]
    along: npt.NDArray[np.float64] = -offsets @ direction
    margin = radius @ radius - np.square(points - centre).sum(axis=1)
    ahead = along > ROUNDING * (direction @ direction + radius @ radius)
    ahead[support] = False
    steps = np.full(len(points), np.inf)
    steps[ahead] = np.maximum(margin[ahead], 0.0) / (2.0 * along[ahead])
    first = int(np.argmin(steps))
    return (float(steps[first]), first) if steps[first] < 1.0 else (1.0, None)
