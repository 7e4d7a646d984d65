"""Hertz theory of smooth, dry, elastic contact in closed form, in SI units.

E* is the reduced modulus, 1/E* = sum (1 - nu^2)/E; the EHL literature's E' is 2 E*.
Source: K. L. Johnson, Contact Mechanics (1985), chapter 4 and appendix 3.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from asperity.core.arrays import Field


@dataclass(frozen=True, slots=True)
class HertzContact:
    """Solution of a Hertz contact.

    `half_widths` (a, b) are the semi-axes along and across rolling [m] (b is half the length of a
    line contact), `p_max` the maximum pressure [Pa], `p_mean` load over area [Pa], `area` [m^2],
    `approach` of the two bodies [m] (None for a line contact, where it depends on the size of the
    bodies).
    """

    half_widths: tuple[float, float]
    p_max: float
    p_mean: float
    area: float
    approach: float | None


def line_contact(load: float, length: float, radius: float, reduced_modulus: float) -> HertzContact:
    """Solve cylinder on plane: a = sqrt(4 w' R / (pi E*)), p_h = 2 w' / (pi a), w' = F/length.

    Examples
    --------
    >>> from asperity.contact.hertz import line_contact
    >>> hertz = line_contact(load=1000.0, length=0.01, radius=0.01, reduced_modulus=227e9)
    >>> f"half-width {hertz.half_widths[0] * 1e6:.0f} um, pressure {hertz.p_max / 1e9:.2f} GPa"
    'half-width 75 um, pressure 0.85 GPa'
    """
    line_load = load / length
    a = np.sqrt(4.0 * line_load * radius / (np.pi * reduced_modulus))
    p_max = 2.0 * line_load / (np.pi * a)
    return HertzContact(
        (float(a), length / 2.0),
        float(p_max),
        float(np.pi / 4.0 * p_max),
        float(2.0 * a * length),
        None,
    )


def point_contact(load: float, radius: float, reduced_modulus: float) -> HertzContact:
    """Solve sphere on plane: a = (3 F R / (4 E*))^(1/3), p_h = 3 F / (2 pi a^2), approach a^2/R.

    Examples
    --------
    >>> from asperity.contact.hertz import point_contact
    >>> hertz = point_contact(load=20.0, radius=9.525e-3, reduced_modulus=117e9)
    >>> f"radius {hertz.half_widths[0] * 1e6:.0f} um, pressure {hertz.p_max / 1e9:.2f} GPa"
    'radius 107 um, pressure 0.84 GPa'
    """
    a = float(np.cbrt(3.0 * load * radius / (4.0 * reduced_modulus)))
    area = float(np.pi * a**2)
    return HertzContact((a, a), 1.5 * load / area, load / area, area, a**2 / radius)


def elliptic_contact(
    load: float, radii: tuple[float, float], reduced_modulus: float
) -> HertzContact:
    """Solve the contact of radii (Rx, Ry) by elliptic integrals (Johnson eqs 4.25-4.28).

    The ellipse is longer along the axis with the larger radius.

    Examples
    --------
    >>> from asperity.contact.hertz import elliptic_contact
    >>> hertz = elliptic_contact(load=100.0, radii=(4e-3, 40e-3), reduced_modulus=227e9)
    >>> f"{hertz.half_widths[0] * 1e6:.0f} by {hertz.half_widths[1] * 1e6:.0f} um"
    '71 by 320 um'
    """
    ellipe = scipy.special.ellipe
    ellipk = scipy.special.ellipk
    r_large, r_small = max(radii), min(radii)
    if np.isclose(r_large, r_small, rtol=3e-9, atol=0.0):  # no bracket, or a root without digits
        return point_contact(load, r_small, reduced_modulus)

    k = _axis_ratio(r_large / r_small)
    m = 1.0 - k**2
    # 1/R_small = 2 p0 k c (E/k^2 - K)/(E* m c^2), c: long semi-axis, p0 = 3F/(2 pi k c^2)
    long_axis = float(
        np.cbrt(
            3.0 * load * r_small * (ellipe(m) / k**2 - ellipk(m)) / (np.pi * reduced_modulus * m)
        )
    )
    short_axis = k * long_axis
    p_max = 1.5 * load / (np.pi * long_axis * short_axis)
    approach = p_max * short_axis * ellipk(m) / reduced_modulus
    axes = (short_axis, long_axis) if radii[0] < radii[1] else (long_axis, short_axis)
    area = float(np.pi * long_axis * short_axis)
    return HertzContact(axes, float(p_max), load / area, area, float(approach))


def _axis_ratio(radius_ratio: float) -> float:
    """Return the ratio of short to long semi-axis for a ratio of large to small radius."""
    ellipe = scipy.special.ellipe
    ellipk = scipy.special.ellipk

    def residual(log_k: float) -> float:
        k = np.exp(log_k)
        m = 1.0 - k**2
        return float((ellipe(m) / k**2 - ellipk(m)) / (ellipk(m) - ellipe(m)) - radius_ratio)

    limits = np.log(1e-6), np.log(1.0 - 1e-9)
    return float(np.exp(scipy.optimize.brentq(residual, *limits, xtol=1e-15, rtol=1e-14)))


def point_compression(load: float, radius: float, reduced_modulus: float) -> float:
    """Return the compression of sphere on plane [m]: z0 = (9 F^2/(16 E*^2 R))^(1/3), paper Eq 2.

    Examples
    --------
    >>> from asperity.contact.hertz import point_compression
    >>> f"{point_compression(load=20.0, radius=9.525e-3, reduced_modulus=117e9) * 1e6:.2f} um"
    '1.20 um'
    """
    return float(np.cbrt(9.0 * load**2 / (16.0 * reduced_modulus**2 * radius)))


def point_stiffness(load: float, radius: float, reduced_modulus: float) -> float:
    """Return the stiffness dF/dz0 of sphere on plane [N/m]: S0 = 1.5 F / z0, paper Eq 3.

    Examples
    --------
    >>> from asperity.contact.hertz import point_stiffness
    >>> f"{point_stiffness(load=20.0, radius=9.525e-3, reduced_modulus=117e9) / 1e6:.2f} N/um"
    '25.01 N/um'
    """
    return 1.5 * load / point_compression(load, radius, reduced_modulus)


def line_stiffness(
    load: float, length: float, radius: float, reduced_modulus: float, depth: float
) -> float:
    """Return the stiffness dF/dδ of cylinder on plane [N/m]: π E* L / (2 ln(2d/a)).

    δ is the approach of points at the depth d = `depth`: δ = (P'/πE*) (2 ln(2d/a) + 1), a ~
    sqrt(P'). Source: K. L. Johnson, Contact Mechanics (1985), section 5.6.

    Examples
    --------
    >>> from asperity.contact.hertz import line_stiffness
    >>> k = line_stiffness(load=1000.0, length=0.01, radius=0.01, reduced_modulus=227e9, depth=0.01)
    >>> f"{k / 1e6:.0f} N/um"
    '638 N/um'
    """
    half_width = line_contact(load, length, radius, reduced_modulus).half_widths[0]
    return float(np.pi * reduced_modulus * length / (2.0 * np.log(2.0 * depth / half_width)))


def line_pressure(x: Field, half_width: float, p_max: float) -> Field:
    """Return the pressure of a line contact at x [Pa]: p_h sqrt(1 - (x/a)^2), zero for |x| > a.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.contact.hertz import line_pressure
    >>> line_pressure(np.array([0.0, 0.5e-4, 1e-4, 2e-4]), half_width=1e-4, p_max=1e9) / 1e9
    array([1.       , 0.8660254, 0.       , 0.       ])
    """
    return np.asarray(p_max * np.sqrt(np.maximum(1.0 - (x / half_width) ** 2, 0.0)))


def ellipse_pressure(
    x: Field, y: Field | float, half_widths: tuple[float, float], p_max: float
) -> Field:
    """Return the pressure of a point or elliptic contact at x and y, which broadcast [Pa].

    p = p_h sqrt(1 - (x/a)^2 - (y/b)^2), zero outside.
    Source: K. L. Johnson, Contact Mechanics (1985), section 3.2 and eq. 4.24.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.contact.hertz import ellipse_pressure
    >>> ellipse_pressure(
    ...     np.array([0.0, 0.5e-4, 2e-4]), y=0.0, half_widths=(1e-4, 2e-4), p_max=1e9
    ... ) / 1e9
    array([1.       , 0.8660254, 0.       ])
    """
    a, b = half_widths
    return np.asarray(p_max * np.sqrt(np.maximum(1.0 - (x / a) ** 2 - (y / b) ** 2, 0.0)))


def line_gap(x: Field, half_width: float, radius: float) -> Field:
    """Return the gap of a dry line contact at x [m], zero inside.

    h = a²/(2R) (X √(X²−1) − ln(X + √(X²−1))), X = |x|/a.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.contact.hertz import line_gap
    >>> (line_gap(np.array([0.5e-4, 1e-4, 2e-4]), half_width=1e-4, radius=0.01) * 1e9).round(1)
    array([   0. ,    0. , 1073.6])
    """
    outside = np.maximum(np.abs(x) / half_width, 1.0)
    root = np.sqrt(outside**2 - 1.0)
    return np.asarray(half_width**2 / (2.0 * radius) * (outside * root - np.log(outside + root)))
