"""Conditions of a contact: elastic pair, geometry, load and surface speeds."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

from asperity.contact.hertz import HertzContact, elliptic_contact, line_contact, point_contact
from asperity.contact.rollers import RollerShape, SlicedLoad, sliced_load
from asperity.core.errors import BadInput, require_positive, with_article

Geometry = Literal["line", "point", "elliptic", "roller"]


@dataclass(frozen=True)
class ElasticPair:
    """Elastic constants of the two bodies: Young's moduli [Pa] and Poisson's ratios.

    Examples
    --------
    >>> from asperity.contact.conditions import ElasticPair
    >>> pair = ElasticPair(youngs_moduli=(206e9, 206e9), poisson_ratios=(0.3, 0.3))
    >>> f"{pair.reduced_modulus / 1e9:.1f} GPa"
    '113.2 GPa'
    """

    youngs_moduli: tuple[float, float]
    poisson_ratios: tuple[float, float]

    def __post_init__(self) -> None:
        for modulus in self.youngs_moduli:
            require_positive("Young's modulus", modulus, "Pa")
        for ratio in self.poisson_ratios:
            if not -1.0 < ratio <= 0.5:
                raise BadInput(
                    f"Poisson's ratio must lie above -1 and be at most 0.5, got {ratio:g}; steel "
                    "has 0.3"
                )

    @property
    def reduced_modulus(self) -> float:
        """E* [Pa], 1/E* = sum (1 - nu^2)/E, as in Hertz's equations."""
        return 1.0 / sum(
            (1.0 - nu**2) / e for e, nu in zip(self.youngs_moduli, self.poisson_ratios, strict=True)
        )

    @property
    def effective_modulus(self) -> float:
        """E' = 2 E* [Pa], as in the EHL literature."""
        return 2.0 * self.reduced_modulus


@dataclass(frozen=True, kw_only=True)
class ContactConditions:
    """Operating conditions of a contact.

    Parameters
    ----------
    pair : elasticity of the two bodies
    geometry : "line" (needs `length`), "point", "elliptic" (`radius` is then (Rx, Ry)) or "roller"
        (needs `length`; unlike a line contact it has ends)
    radius : effective radius of curvature along rolling, 1/R = 1/R1 + 1/R2 [m]
    load : normal load on the whole contact [N]
    surface_speeds : speeds of the two surfaces along x [m/s]
    length : length of a line contact or a roller [m]
    shape : profile of a roller along its length; None for a straight one
    hardness : upper limit of the pressure [Pa]; None for a purely elastic contact

    Raises
    ------
    BadInput
        A quantity is not positive, the length is missing, or the entrainment speed is negative.

    Examples
    --------
    >>> from asperity.contact.conditions import ContactConditions, ElasticPair
    >>> pair = ElasticPair(youngs_moduli=(206e9, 206e9), poisson_ratios=(0.3, 0.3))
    >>> conditions = ContactConditions(
    ...     pair=pair,
    ...     geometry="line",
    ...     radius=0.01,
    ...     length=0.01,
    ...     load=1000.0,
    ...     surface_speeds=(2.0, 1.0),
    ... )
    >>> f"{conditions.entrainment_speed} m/s, {conditions.hertz.p_max / 1e9:.2f} GPa"
    '1.5 m/s, 0.60 GPa'
    """

    pair: ElasticPair
    geometry: Geometry
    radius: float | tuple[float, float]
    load: float
    surface_speeds: tuple[float, float]
    length: float | None = None
    hardness: float | None = None
    shape: RollerShape | None = None

    def __post_init__(self) -> None:
        if self.geometry not in get_args(Geometry):
            raise BadInput(
                f"geometry must be one of {', '.join(get_args(Geometry))}, got {self.geometry!r}"
            )
        if (self.geometry == "elliptic") != isinstance(self.radius, tuple):
            article = "an" if self.geometry == "elliptic" else "a"
            required = "a pair (Rx, Ry)" if self.geometry == "elliptic" else "one number"
            raise BadInput(
                f"radius of {article} {self.geometry} contact is {required} in metres, got "
                f"{self.radius!r}; correct it"
            )
        for radius in self.radius if isinstance(self.radius, tuple) else (self.radius,):
            require_positive("radius", radius, "m")
        require_positive("load", self.load, "N")
        self._check_length()
        if self.hardness is not None:
            require_positive("hardness", self.hardness, "Pa")
        if self.entrainment_speed != 0.0:  # a dry contact may rest
            require_positive("entrainment speed", self.entrainment_speed, "m/s")

    def _check_length(self) -> None:
        subject = f"{with_article(self.geometry)} contact"
        if self.long:
            if self.length is None:
                raise BadInput(f"{subject} needs its length; give length in metres")
            require_positive("length", self.length, "m")
        elif self.length is not None:
            raise BadInput(
                f"length belongs to a line contact, got {self.length:g} m for {subject}; "
                "leave it out"
            )
        if self.geometry == "roller" and self.length is not None:
            self.roller.between_chamfers(self.length)
        elif self.shape is not None:
            raise BadInput(
                f"shape belongs to a roller contact, got one for {subject}; leave it out"
            )

    @property
    def long(self) -> bool:
        """True for line contacts and rollers, for which formulas for line contacts hold."""
        return self.geometry in ("line", "roller")

    @property
    def endless(self) -> bool:
        """True for a line contact, a section of an infinitely long one."""
        return self.geometry == "line"

    @property
    def roller(self) -> RollerShape:
        """Profile of a roller along its length; straight unless given."""
        return self.shape or RollerShape()

    @property
    def entrainment_speed(self) -> float:
        """Mean of the two surface speeds, (u1 + u2)/2 [m/s]."""
        return sum(self.surface_speeds) / 2.0

    @property
    def sliding_speed(self) -> float:
        """Difference of the two surface speeds, |u1 - u2| [m/s]."""
        return abs(self.surface_speeds[0] - self.surface_speeds[1])

    @property
    def slide_to_roll(self) -> float:
        """Sliding over entrainment speed; 0 at rest, infinite where only sliding is left."""
        if self.entrainment_speed == 0.0:
            return math.inf if self.sliding_speed else 0.0
        return self.sliding_speed / self.entrainment_speed

    @property
    def radius_along_rolling(self) -> float:
        """Rx [m]."""
        return self.radius[0] if isinstance(self.radius, tuple) else self.radius

    @property
    def radius_across_rolling(self) -> float:
        """Ry [m]; infinite for a line contact and a roller, whose crown belongs to its shape."""
        if isinstance(self.radius, tuple):
            return self.radius[1]
        return float("inf") if self.long else self.radius

    @property
    def line_load(self) -> float:
        """Mean load per length of a line contact, or of a roller between its chamfers [N/m]."""
        return self.load / self.line_length

    @property
    def line_length(self) -> float:
        """Length of a line contact, or of a roller between its chamfers [m]."""
        if self.length is None:
            raise BadInput(
                f"{with_article(self.geometry)} contact has no load per length; use load"
            )
        return self.roller.between_chamfers(self.length)

    @property
    def end(self) -> float:
        """Distance of a roller's ends from its middle [m]; infinite for a line contact."""
        if self.geometry != "roller" or self.length is None:
            return float("inf")
        return self.roller.ends(self.length)

    @property
    def sliced_load(self) -> SlicedLoad:
        """Load distribution along a roller by the slice model."""
        if self.length is None:
            raise BadInput(f"{with_article(self.geometry)} contact has no slices; use a roller")
        radius = self.radius_along_rolling
        modulus = self.pair.reduced_modulus
        return sliced_load(self.roller, self.length, self.load, radius, modulus)

    @cached_property
    def hertz(self) -> HertzContact:
        """Hertz contact (smooth, dry, elastic) under these conditions."""
        modulus = self.pair.reduced_modulus
        if isinstance(self.radius, tuple):
            return elliptic_contact(self.load, self.radius, modulus)
        if self.length is not None:
            return line_contact(self.load, self.line_length, self.radius, modulus)
        return point_contact(self.load, self.radius, modulus)
