"""Two discs that run against each other, as on a twin-disc rig."""

from dataclasses import dataclass

from asperity.conditions import ElasticPair
from asperity.errors import BadInput, require_positive
from asperity.machine.element import MachineContact, turns


@dataclass(frozen=True, kw_only=True)
class TwinDisc:
    """Two discs pressed together, turning in opposite senses so that their surfaces run along.

    Parameters
    ----------
    radii : of the discs [m]
    speeds : of the discs [rad/s]
    load : [N]
    length : of the line contact [m]; None where a disc is crowned
    crown_radius : across rolling, of the pair [m]; None for cylinders

    Raises
    ------
    BadInput
        for a quantity that is not positive, or not exactly one of length and crown_radius.
    """

    radii: tuple[float, float]
    speeds: tuple[float, float]
    load: float
    length: float | None = None
    crown_radius: float | None = None

    def __post_init__(self) -> None:
        for radius in self.radii:
            require_positive("radii", radius, "m")
        for speed in self.speeds:
            require_positive("speeds", speed, "rad/s")
        require_positive("load", self.load, "N")
        if (self.length is None) == (self.crown_radius is None):
            both = "both are" if self.length is not None else "neither is"
            raise BadInput(f"discs have length (cylinders) or crown_radius (one is crowned), {both} given; give one")
        for name, value in (("length", self.length), ("crown_radius", self.crown_radius)):
            if value is not None:
                require_positive(name, value, "m")

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:  # noqa: ARG002 (one contact, all the load)
        """The one contact."""
        (first, second), (slow, fast) = self.radii, self.speeds
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
            overrolling_hz=(turns(slow), turns(fast)),
        )
        return (contact,)

    @property
    def frequencies(self) -> dict[str, float]:
        """Of both discs [Hz]."""
        return {"disc_1_hz": turns(self.speeds[0]), "disc_2_hz": turns(self.speeds[1])}

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:  # noqa: ARG002 (whatever they are made of)
        """None: the model leaves nothing out that a rig has."""
        return ()

    def title(self) -> str:
        """What it is."""
        return "Twin disc"
