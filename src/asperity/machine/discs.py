"""Contact of a twin-disc rig."""

from dataclasses import dataclass
from typing import ClassVar

from asperity.contact.conditions import ElasticPair
from asperity.core.errors import BadInput, require_positive
from asperity.machine.element import MachineContact, rotation_hz


@dataclass(frozen=True, kw_only=True)
class TwinDisc:
    """Two discs pressed together whose surfaces move in the same direction at the contact.

    Parameters
    ----------
    radii : radii of the discs [m]
    speeds : angular speeds of the discs [rad/s]; alternative: the next two
    entrainment_speed : mean of both surface speeds [m/s]
    slide_to_roll : (u1 - u2) over the entrainment speed, with sign
    load : normal load [N]
    length : length of the line contact [m]; None if a disc is crowned
    crown_radius : effective radius across rolling [m]; None for cylinders

    Raises
    ------
    BadInput
        A quantity is not positive, length and crown_radius are both or neither given, or so are
        speeds and entrainment_speed.

    Examples
    --------
    >>> from asperity.contact.conditions import ElasticPair
    >>> from asperity.machine import TwinDisc
    >>> steel = ElasticPair(youngs_moduli=(206e9, 206e9), poisson_ratios=(0.3, 0.3))
    >>> discs = TwinDisc(radii=(0.02, 0.02), load=500.0, speeds=(105.0, 95.0), length=0.01)
    >>> contact = discs.contacts(steel)[0]
    >>> f"{contact.radius * 1e3:.0f} mm, {contact.entrainment_speed:.2f} m/s"
    '10 mm, 2.00 m/s'
    """

    place: ClassVar[str] = "cycle_angle"

    radii: tuple[float, float]
    load: float
    speeds: tuple[float, float] | None = None
    entrainment_speed: float | None = None
    slide_to_roll: float | None = None
    length: float | None = None
    crown_radius: float | None = None

    def __post_init__(self) -> None:
        for radius in self.radii:
            require_positive("radii", radius, "m")
        self._require_speeds()
        require_positive("load", self.load, "N")
        if (self.length is None) == (self.crown_radius is None):
            word = "both are" if self.length is not None else "neither is"
            raise BadInput(
                f"discs have length (cylinders) or crown_radius (one is crowned), {word} given; "
                "give one"
            )
        for name, value in (("length", self.length), ("crown_radius", self.crown_radius)):
            if value is not None:
                require_positive(name, value, "m")

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:  # noqa: ARG002 (one contact, all the load)
        """Return the contact."""
        (first, second) = self.radii
        (slow, fast) = self.turning
        radius = first * second / (first + second)
        contact = MachineContact(
            name="discs",
            bodies=("disc 1", "disc 2"),
            position=0.0,
            load=self.load,
            geometry="line" if self.crown_radius is None else "elliptic",
            radius=radius if self.crown_radius is None else (radius, self.crown_radius),
            length=self.length,
            surface_speeds=(slow * first, fast * second),
            overrolling_hz=(rotation_hz(slow), rotation_hz(fast)),
        )
        return (contact,)

    @property
    def turning(self) -> tuple[float, float]:
        """Angular speeds of the discs [rad/s], given or by entrainment and slide-to-roll ratio."""
        if self.speeds is not None:
            return self.speeds
        assert self.entrainment_speed is not None
        half = 0.5 * (self.slide_to_roll or 0.0)
        first, second = (self.entrainment_speed * (1.0 + side * half) for side in (1.0, -1.0))
        return first / self.radii[0], second / self.radii[1]

    def _require_speeds(self) -> None:
        if (self.speeds is None) == (self.entrainment_speed is None):
            both = "both are" if self.speeds is not None else "neither is"
            raise BadInput(
                f"discs have speeds, or entrainment_speed with slide_to_roll, {both} given; give "
                "one"
            )
        if self.speeds is not None:
            if self.slide_to_roll is not None:
                raise BadInput(
                    "slide_to_roll follows from both speeds, which are given; leave it out"
                )
            if min(self.speeds) < 0.0 or max(self.speeds) <= 0.0:
                raise BadInput(
                    f"speeds must not be negative nor both 0, got {self.speeds[0]:g} and "
                    f"{self.speeds[1]:g} rad/s; only one disc may be at rest"
                )
            return
        require_positive("entrainment_speed", self.entrainment_speed or 0.0, "m/s")
        if abs(self.slide_to_roll or 0.0) > 2.0:
            raise BadInput(
                "slide_to_roll must lie between -2 and 2, where one disc is at rest, got "
                f"{self.slide_to_roll:g}: beyond, the surfaces move in opposite directions; "
                "correct it"
            )

    @property
    def frequencies(self) -> dict[str, float]:
        """Rotational frequencies of both discs [Hz]."""
        return {
            "disc_1_hz": rotation_hz(self.turning[0]),
            "disc_2_hz": rotation_hz(self.turning[1]),
        }

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:  # noqa: ARG002 (independent of the material)
        """Return no notes, as the model of a rig is complete."""
        return ()

    def title(self) -> str:
        """Return the name of the machine."""
        return "Twin disc"
