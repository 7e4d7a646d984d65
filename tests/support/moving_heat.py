"""Temperature rise of half-spaces under moving heat sources, in closed form and by quadrature of
point sources.

Unit heat flux unless given; `speed` of the body along x, so the wake lies at larger x.
"""

from itertools import pairwise

import numpy as np
from scipy.integrate import quad
from scipy.special import k0e


def band(x, half_width, speed, conductivity, diffusivity, depth=0.0):
    """Steady rise at (x, depth) under heat on |x| < half_width, infinite in y: line sources of
    Jaeger (1942).
    """
    v = speed / (2.0 * diffusivity)

    def source(position):
        distance = np.hypot(x - position, depth)
        return np.exp(v * (x - position) - abs(v) * distance) * k0e(abs(v) * distance)

    breakpoints = [
        x + side * reach / abs(v) for side in (-1, 1) for reach in (1e-3, 1e-1, 1, 30)
    ] + [x]
    ends = [
        -half_width,
        *sorted(point for point in breakpoints if abs(point) < half_width),
        half_width,
    ]
    parts = [quad(source, low, high, epsabs=0.0, epsrel=1e-8)[0] for low, high in pairwise(ends)]
    return sum(parts) / (np.pi * conductivity)


def rectangle_at_rest(half_length, half_width, conductivity):
    """Steady rise at the centre of a heated rectangle on a stationary body: Carslaw and Jaeger
    (1959), section 10.5.
    """
    a, b = half_length, half_width
    return 2.0 / (np.pi * conductivity) * (a * np.arcsinh(b / a) + b * np.arcsinh(a / b))


def rectangle(x, y, half_length, half_width, speed, conductivity, diffusivity):
    """Steady rise at (x, y) under heat on |x| < half_length, |y| < half_width: point sources in
    polar coordinates.
    """
    v = speed / (2.0 * diffusivity)

    def ray(angle):
        # the 1/r of the source cancels the r of the area element: a closed-form integral
        dx, dy = np.cos(angle), np.sin(angle)
        reach = min(
            ((np.sign(d) * half - at) / d if d != 0.0 else np.inf)
            for d, half, at in ((dx, half_length, x), (dy, half_width, y))
        )
        # the source lies upstream at -r (dx, dy) of the rise: exponent v * (x - x') - |v| r
        rate = abs(v) + v * dx
        return reach if rate * reach < 1e-9 else -np.expm1(-rate * reach) / rate

    corners = sorted(
        np.arctan2(sy * half_width - y, sx * half_length - x) % (2.0 * np.pi)
        for sx in (-1, 1)
        for sy in (-1, 1)
    )
    ends = [*corners, corners[0] + 2.0 * np.pi]
    wake = (
        np.pi - 30.0 / np.sqrt(max(abs(v) * half_length, 1.0)),
        np.pi,
        np.pi + 30.0 / np.sqrt(max(abs(v) * half_length, 1.0)),
    )
    ends = sorted({*ends, *(a for a in wake if ends[0] < a < ends[-1])})
    total = sum(
        quad(ray, low, high, epsabs=0.0, epsrel=1e-9, limit=400)[0] for low, high in pairwise(ends)
    )
    return total / (2.0 * np.pi * conductivity)


def tian_kennedy_square(half_width, peclet, conductivity):
    """Largest rise under a uniform square source: 2 q b/(k sqrt(π (1.011 + Pe))), Pe = u b/(2 κ).

    Source: X. Tian, F. E. Kennedy, J. Tribol. 116 (1994) 167; from memory. Its limits are the
    closed forms at rest, 4 ln(1 + √2)/π = 1.122, and Jaeger's at high speed; between them it is
    accurate to about 5 %.
    """
    return 2.0 * half_width / (conductivity * np.sqrt(np.pi * (1.011 + peclet)))
