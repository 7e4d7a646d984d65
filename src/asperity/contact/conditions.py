"""What the two bodies are and how they are pressed and driven: elastic pair and contact conditions."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

from asperity.contact.hertz import HertzContact, elliptic_contact, line_contact, point_contact
from asperity.contact.rollers import RollerShape, SlicedLoad, sliced_load
from asperity.core.errors import BadInput, articled, require_positive

Geometry = Literal["line", "point", "elliptic", "roller"]


@dataclass(frozen=True)
class ElasticPair:
    """The two bodies' elasticity: Young's moduli [Pa] and Poisson's ratios."""

    youngs_moduli: tuple[float, float]
    poisson_ratios: tuple[float, float]

    def __post_init__(self) -> None:
        for modulus in self.youngs_moduli:
            require_positive("Young's modulus", modulus, "Pa")
        for ratio in self.poisson_ratios:
            if not -1.0 < ratio <= 0.5:
                raise BadInput(
                    f"Poisson's ratio must lie above -1 and at most at 0.5, got {ratio:g}; steel has 0.3"
                )

    @property
    def reduced_modulus(self) -> float:
        """E* [Pa]: 1/E* = sum (1 - nu^2)/E; what Hertz's equations take."""
        return 1.0 / sum(
            (1.0 - nu**2) / e for e, nu in zip(self.youngs_moduli, self.poisson_ratios, strict=True)
        )

    @property
    def effective_modulus(self) -> float:
        """E' = 2 E* [Pa]; what the EHL literature takes."""
        return 2.0 * self.reduced_modulus


@dataclass(frozen=True, kw_only=True)
class ContactConditions:
    """A contact as a tribologist states it.

    Parameters
    ----------
    pair : elasticity of the two bodies
    geometry : "line" (needs `length`), "point", "elliptic" (`radius` is then (Rx, Ry)), or "roller" (needs `length`, at
        whose ends it ends; a line goes on)
    radius : effective radius of curvature along rolling, 1/R = 1/R1 + 1/R2 [m]
    load : normal load on the whole contact [N]
    surface_speeds : speeds of the two surfaces along x [m/s]
    length : length of a line contact or a roller [m]
    shape : of a roller along its length; None for a straight one
    hardness : pressure that no point of the contact can exceed [Pa]; None for a purely elastic contact

    Raises
    ------
    BadInput
        for a quantity that is not positive, a missing length, or surfaces that draw no oil in.
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
            wanted = "a pair (Rx, Ry)" if self.geometry == "elliptic" else "one number"
            raise BadInput(
                f"radius of {article} {self.geometry} contact is {wanted} in metres, got {self.radius!r}; correct it"
            )
        for radius in self.radius if isinstance(self.radius, tuple) else (self.radius,):
            require_positive("radius", radius, "m")
        require_positive("load", self.load, "N")
        self._check_length()
        if self.hardness is not None:
            require_positive("hardness", self.hardness, "Pa")
        require_positive("entrainment speed", self.entrainment_speed, "m/s")

    def _check_length(self) -> None:
        named = f"{articled(self.geometry)} contact"
        if self.long:
            if self.length is None:
                raise BadInput(f"{named} needs its length; give length in metres")
            require_positive("length", self.length, "m")
        elif self.length is not None:
            raise BadInput(
                f"length belongs to a line contact, got {self.length:g} m for {named}; leave it out"
            )
        if self.geometry == "roller" and self.length is not None:
            self.roller.between_chamfers(self.length)
        elif self.shape is not None:
            raise BadInput(f"shape belongs to a roller contact, got one for {named}; leave it out")

    @property
    def long(self) -> bool:
        """Whether the bodies touch along a line, with or without ends: forms for line contacts hold."""
        return self.geometry in ("line", "roller")

    @property
    def endless(self) -> bool:
        """Whether the contact is a piece of one that goes on across rolling: a line contact."""
        return self.geometry == "line"

    @property
    def roller(self) -> RollerShape:
        """The shape along a roller; a straight one unless stated."""
        return self.shape or RollerShape()

    @property
    def entrainment_speed(self) -> float:
        """Mean of the two surface speeds, (u1 + u2)/2 [m/s]: what draws the oil in."""
        return sum(self.surface_speeds) / 2.0

    @property
    def sliding_speed(self) -> float:
        """Difference of the two surface speeds, |u1 - u2| [m/s]."""
        return abs(self.surface_speeds[0] - self.surface_speeds[1])

    @property
    def slide_to_roll(self) -> float:
        """Sliding over entrainment speed."""
        return self.sliding_speed / self.entrainment_speed

    @property
    def radius_along_rolling(self) -> float:
        """Rx [m]."""
        return self.radius[0] if isinstance(self.radius, tuple) else self.radius

    @property
    def radius_across_rolling(self) -> float:
        """Ry [m]; infinite for a line contact and a roller, whose crown is its shape's."""
        if isinstance(self.radius, tuple):
            return self.radius[1]
        return float("inf") if self.long else self.radius

    @property
    def line_load(self) -> float:
        """Load per length of a line contact, or of a roller between its chamfers, in the mean [N/m]."""
        return self.load / self.line_length

    @property
    def line_length(self) -> float:
        """Length of a line contact, or of a roller between its chamfers [m]."""
        if self.length is None:
            raise BadInput(f"{articled(self.geometry)} contact has no load per length; use load")
        return self.roller.between_chamfers(self.length)

    @property
    def end(self) -> float:
        """Where a roller ends to both sides of its middle [m]; infinite for a line contact, which does not."""
        if self.geometry != "roller" or self.length is None:
            return float("inf")
        return self.roller.ends(self.length)

    @property
    def sliced_load(self) -> SlicedLoad:
        """The load along a roller by slices."""
        if self.length is None:
            raise BadInput(f"{articled(self.geometry)} contact has no slices; use a roller")
        radius, modulus = self.radius_along_rolling, self.pair.reduced_modulus
        return sliced_load(self.roller, self.length, self.load, radius, modulus)

    @cached_property
    def hertz(self) -> HertzContact:
        """The smooth, dry, elastic contact under these conditions."""
        modulus = self.pair.reduced_modulus
        if isinstance(self.radius, tuple):
            return elliptic_contact(self.load, self.radius, modulus)
        if self.length is not None:
            return line_contact(self.load, self.line_length, self.radius, modulus)
        return point_contact(self.load, self.radius, modulus)
