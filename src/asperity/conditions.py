"""What the two bodies are and how they are pressed and driven: elastic pair and contact conditions."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

from asperity.errors import BadInput, articled, require_positive
from asperity.hertz import HertzContact, elliptic_contact, line_contact, point_contact

Geometry = Literal["line", "point", "elliptic"]


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
                raise BadInput(f"Poisson's ratio must lie above -1 and at most at 0.5, got {ratio:g}; steel has 0.3")

    @property
    def reduced_modulus(self) -> float:
        """E* [Pa]: 1/E* = sum (1 - nu^2)/E; what Hertz's equations take."""
        return 1.0 / sum((1.0 - nu**2) / e for e, nu in zip(self.youngs_moduli, self.poisson_ratios, strict=True))

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
    geometry : "line" (needs `length`), "point" or "elliptic" (`radius` is then (Rx, Ry))
    radius : effective radius of curvature along rolling, 1/R = 1/R1 + 1/R2 [m]
    load : normal load on the whole contact [N]
    surface_speeds : speeds of the two surfaces along x [m/s]
    length : length of a line contact [m]
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

    def __post_init__(self) -> None:
        if self.geometry not in get_args(Geometry):
            raise BadInput(f"geometry must be one of {', '.join(get_args(Geometry))}, got {self.geometry!r}")
        if (self.geometry == "elliptic") != isinstance(self.radius, tuple):
            article = "an" if self.geometry == "elliptic" else "a"
            wanted = "a pair (Rx, Ry)" if self.geometry == "elliptic" else "one number"
            raise BadInput(
                f"radius of {article} {self.geometry} contact is {wanted} in metres, got {self.radius!r}; correct it"
            )
        for radius in self.radius if isinstance(self.radius, tuple) else (self.radius,):
            require_positive("radius", radius, "m")
        require_positive("load", self.load, "N")
        if self.geometry == "line":
            if self.length is None:
                raise BadInput("a line contact needs its length; give length in metres")
            require_positive("length", self.length, "m")
        elif self.length is not None:
            raise BadInput(
                f"length belongs to a line contact, got {self.length:g} m for {articled(self.geometry)} contact; "
                "leave it out"
            )
        if self.hardness is not None:
            require_positive("hardness", self.hardness, "Pa")
        require_positive("entrainment speed", self.entrainment_speed, "m/s")

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
        """Ry [m]; infinite for a line contact."""
        if isinstance(self.radius, tuple):
            return self.radius[1]
        return float("inf") if self.geometry == "line" else self.radius

    @property
    def line_load(self) -> float:
        """Load per length of a line contact [N/m]."""
        if self.length is None:
            raise BadInput(f"{articled(self.geometry)} contact has no load per length; use load")
        return self.load / self.length

    @cached_property
    def hertz(self) -> HertzContact:
        """The smooth, dry, elastic contact under these conditions."""
        modulus = self.pair.reduced_modulus
        if isinstance(self.radius, tuple):
            return elliptic_contact(self.load, self.radius, modulus)
        if self.length is not None:
            return line_contact(self.load, self.length, self.radius, modulus)
        return point_contact(self.load, self.radius, modulus)
