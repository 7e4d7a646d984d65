"""Measured receptances of a structure, displacement per force, and their coupling by the contact.

Motion is the real part of a complex amplitude times exp(iωt), so that a damped receptance has a
negative imaginary part. `spring` is the contact's k + iωc [N/m].
Source: R. E. D. Bishop and D. C. Johnson, The Mechanics of Vibration (1960).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import scipy
from numpy.typing import ArrayLike

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.structure.modes import CoupledMode
from asperity.structure.rational import RationalFit, rational_fit

MIN_FREQUENCIES = 4
MIN_SHARE = 1e-3  # of the contact in the strain energy of a mode
MAX_DAMPING = 0.3  # of a mode
UNDAMPED = 1e-7  # rounding of a damping ratio; with noise, growing modes are none
SAME_MODE = 1e-4  # relative difference of two roots
SETTLED, NEARLY_SETTLED, MAX_STEPS = 1e-10, 1e-5, 50  # relative; the second with noise


@dataclass(frozen=True, eq=False, kw_only=True)
class Receptances:
    """Receptances of a structure, measured without the spring of its contact.

    The frequencies must lie closer together than the contact moves a mode.

    Parameters
    ----------
    frequencies_hz : increasing, shape (n,)
    approach : approach of the bodies per pair of forces that press them together [m/N], complex,
        (n,); with receptances of the two bodies H11 + H22 - H12 - H21 along one axis
    transfer : displacement at the sensor per such pair [m/N], complex, (n,)

    Raises
    ------
    BadInput
        for fewer than four frequencies, frequencies that do not increase, values that are not
        finite, or an approach in phase with the velocity against the forces.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.structure import Receptances, receptance_modes
    >>> frequencies_hz = np.linspace(100.0, 2000.0, 400)
    >>> angular = 2.0 * np.pi * frequencies_hz
    >>> mass = -1.0 / (2.0 * angular**2) + 0j  # 2 kg, free
    >>> measured = Receptances(frequencies_hz=frequencies_hz, approach=mass, transfer=mass)
    >>> (mode,) = receptance_modes(measured, lambda frequency_hz: (1e7, 50.0))
    >>> f"{mode.frequency_hz:.1f} Hz, share {mode.contact_share:.3f}, {mode.damping_ratio:.4f}"
    '355.9 Hz, share 1.000, 0.0056'
    """

    frequencies_hz: Field
    approach: npt.NDArray[np.complex128]
    transfer: npt.NDArray[np.complex128]

    def __post_init__(self) -> None:
        frequencies_hz = np.asarray(self.frequencies_hz, dtype=float)
        approach, transfer = (
            np.asarray(getattr(self, n), complex) for n in ("approach", "transfer")
        )
        if (
            frequencies_hz.ndim != 1
            or frequencies_hz.size < MIN_FREQUENCIES
            or not np.all(np.diff(frequencies_hz) > 0.0)
            or not frequencies_hz[0] > 0.0
        ):
            raise BadInput(
                "receptances need four or more increasing frequencies above 0 Hz; sort and "
                "complete them"
            )
        for name, values in (("approach", approach), ("transfer", transfer)):
            if values.shape != frequencies_hz.shape or not np.all(np.isfinite(values)):
                raise BadInput(
                    f"receptance {name} must be {frequencies_hz.size} finite numbers, one for each "
                    f"frequency, got shape {values.shape}"
                )
        if not np.all(approach):
            raise BadInput("receptance approach is 0 at a frequency; leave that frequency out")
        if float(np.sum(approach.imag / np.abs(approach))) > 0.0:
            raise BadInput(
                "receptance approach has a positive imaginary part: forces and displacements have "
                "opposite directions, or the phase the other sign; correct it"
            )
        for name, array in (
            ("frequencies_hz", frequencies_hz),
            ("approach", approach),
            ("transfer", transfer),
        ):
            object.__setattr__(self, name, array)

    @cached_property
    def fit(self) -> RationalFit:
        """Rational fit of the approach."""
        return rational_fit(self.frequencies_hz, self.approach)

    @cached_property
    def between(self) -> tuple[Field, npt.NDArray[np.complex128]]:
        """Middles between the frequencies [Hz], and the fitted approach there."""
        middles = 0.5 * (self.frequencies_hz[1:] + self.frequencies_hz[:-1])
        return middles, self.fit.values_at(middles)

    def response(
        self, spring: npt.NDArray[np.complex128], frequencies_hz: Field
    ) -> npt.NDArray[np.complex128]:
        """Return the displacement of the sensor per displacement that roughness imposes, (n,).

        `spring` is k + iωc of the contact [N/m]; beyond the measured frequencies the result is 0.
        """
        # its poles are the antiresonances alone
        inverse = scipy.interpolate.CubicSpline(self.frequencies_hz, 1.0 / self.approach)
        ratio = scipy.interpolate.CubicSpline(self.frequencies_hz, self.transfer / self.approach)
        low, high = self.frequencies_hz[0], self.frequencies_hz[-1]
        inside = (frequencies_hz >= low) & (frequencies_hz <= high)
        at = np.clip(frequencies_hz, low, high)
        return np.where(inside, ratio(at) * spring / (inverse(at) + spring), 0.0)

    def ratio_at(self, frequency_hz: float) -> complex:
        """Return the displacement of the sensor per approach in the contact."""
        ratio = scipy.interpolate.CubicSpline(self.frequencies_hz, self.transfer / self.approach)
        return complex(ratio(frequency_hz))


def coupled_receptance(
    sensor: ArrayLike, transfer: ArrayLike, approach: ArrayLike, spring: ArrayLike
) -> Field:
    """Return the receptance of the sensor with the contact, from that without, `sensor`."""
    free, across, relative, stiffness = map(np.asarray, (sensor, transfer, approach, spring))
    return np.asarray(free - across**2 * stiffness / (1.0 + stiffness * relative))


def transfer_of_roughness(transfer: ArrayLike, approach: ArrayLike, spring: ArrayLike) -> Field:
    """Return the displacement of the sensor per displacement that roughness imposes."""
    across, relative, stiffness = map(np.asarray, (transfer, approach, spring))
    return np.asarray(across * stiffness / (1.0 + stiffness * relative))


def receptance_modes(
    receptances: Receptances, contact: Callable[[float], tuple[float, float]]
) -> tuple[CoupledMode, ...]:
    """Return the modes of measured receptances with the contact, within the measured frequencies.

    A mode is a complex root of 1/H + k + iωc of a rational fit of H; with mass-normalised shapes
    the slope there is -2ω over the square of the approach. Modes of which the contact has less than
    a thousandth are left out: with noise, such roots are no modes.

    Parameters
    ----------
    contact : returns stiffness and damping of the contact [N/m, N s/m] at a frequency [Hz]
    """
    frequencies_hz = receptances.frequencies_hz
    fit = receptances.fit
    springs = np.array([_spring(contact, complex(entry)) for entry in fit.support])
    modes: dict[int, CoupledMode] = {}
    for start in (*fit.roots_with(springs), *_dips(receptances, contact)):
        root = _settled(fit, contact, complex(start))
        if root is None or not frequencies_hz[0] <= root.real <= frequencies_hz[-1]:
            continue
        mode = _mode(receptances, fit, contact, root)
        damped = -UNDAMPED < root.imag / root.real < MAX_DAMPING
        if mode.contact_share > MIN_SHARE and damped:
            modes[round(math.log(mode.frequency_hz) / SAME_MODE)] = mode
    return tuple(sorted(modes.values(), key=lambda mode: mode.frequency_hz))


def _mode(
    receptances: Receptances,
    fit: RationalFit,
    contact: Callable[[float], tuple[float, float]],
    root: complex,
) -> CoupledMode:
    """Return the mode at a complex root."""
    stiffness, damping = contact(root.real)
    slope = -fit.slope(root) / fit(root) ** 2  # of 1/H
    share = (-2.0 * stiffness / (root * slope)).real
    in_contact = 2.0 * math.pi * abs(root) * math.sqrt(max(share, 0.0) / stiffness)
    return CoupledMode(
        frequency_hz=abs(root),
        damping_ratio=max(root.imag, 0.0) / abs(root),
        contact_share=share,
        contact_shape=in_contact,
        sensor_shape=in_contact * receptances.ratio_at(root.real).real,
        stiffness=stiffness,
        damping=damping,
    )


def _dips(
    receptances: Receptances, contact: Callable[[float], tuple[float, float]]
) -> npt.NDArray[np.complex128]:
    """Return the frequencies with a least |1 + (k + iωc) H| between neighbours, slightly damped.

    With noise the roots of the fit may be too far from those they settle at.
    """
    middles, values = receptances.between
    springs = np.array([_spring(contact, complex(place)) for place in middles])
    sizes = np.abs(1.0 + springs * values)
    least = (sizes[1:-1] < sizes[:-2]) & (sizes[1:-1] < sizes[2:])
    return np.asarray(middles[1:-1][least] * (1.0 + 0.01j), dtype=np.complex128)


def _spring(contact: Callable[[float], tuple[float, float]], frequency_hz: complex) -> complex:
    stiffness, damping = contact(frequency_hz.real)
    return stiffness + 2j * math.pi * frequency_hz * damping


def _settled(
    fit: RationalFit, contact: Callable[[float], tuple[float, float]], root: complex
) -> complex | None:
    """Return a root of 1 + (k + iωc) H by Newton's method; None if it does not settle."""
    for _ in range(MAX_STEPS):
        if not root.real > 0.0:
            return None
        spring = _spring(contact, root)
        slope = spring * fit.slope(root)
        if slope == 0.0 or not np.isfinite(slope):
            return None
        step = (1.0 + spring * fit(root)) / slope
        root -= step
        if abs(step) < SETTLED * abs(root):
            return root
    return root if abs(step) < NEARLY_SETTLED * abs(root) else None
