"""What of an oil was given and what was estimated: its numbers with their origins, and what is to be noted of them."""

from collections.abc import Iterator
from typing import Literal, NamedTuple

from asperity.core.quantities import quantity
from asperity.lubricant.data_sheet import MINERAL_INDEX, OilSheet
from asperity.lubricant.friction import FREEZING

Origin = Literal["given", "measured", "estimated", "computed"]

INDICES = 0.0, 250.0  # viscosity indices of oils
THICKEST = 2.0  # viscosity up to which estimates were compared with measured oils [Pa s]


class OilFact(NamedTuple):
    """A number of an oil: its key in the catalogue of quantities, SI, where it comes from, and how."""

    key: str
    value: float
    origin: Origin
    how: str = ""

    def __str__(self) -> str:
        entry = quantity(self.key)
        return f"{entry.name} {entry.text(self.value)}" + (f" ({self.how})" if self.how else "")


def oil_facts(oil: OilSheet, temperature: float) -> tuple[OilFact, ...]:
    """Every number of an oil at a temperature [K], with where it comes from; raises what `OilSheet.lubricant` does."""
    return tuple(_facts(oil, temperature))


def _facts(oil: OilSheet, temperature: float) -> Iterator[OilFact]:
    yield OilFact("oil_temperature_k", temperature, "given", f"{temperature - FREEZING:.4g} °C")
    origin: Origin = "computed" if oil.measured is None else "measured"
    if oil.measured is None:
        middle = f"the middle of {oil.grade}" if oil.viscosity_40 is None else ""
        yield OilFact("oil_viscosity_40_m2_s", oil.at_40, "given", middle)
        if oil.viscosity_100 is None:
            yield OilFact(
                "oil_viscosity_100_m2_s",
                oil.at_100,
                "computed",
                "of the viscosity index, ASTM D2270",
            )
        else:
            yield OilFact("oil_viscosity_100_m2_s", oil.at_100, "given")
        yield from _index(oil)
    if oil.density_15 is None:
        yield OilFact(
            "oil_density_15_kg_m3", oil.at_15, "estimated", "ISO/TR 15144-1, mineral oils"
        )
    else:
        yield OilFact("oil_density_15_kg_m3", oil.at_15, "given")
    line = oil.measured or "ASTM D341"
    yield OilFact(
        "oil_kinematic_viscosity_m2_s", oil.kinematic_viscosity(temperature), origin, line
    )
    yield OilFact(
        "oil_density_kg_m3", oil.density(temperature), "computed", "0.7 kg/m³ less a kelvin"
    )
    yield OilFact("oil_viscosity_pa_s", oil.viscosity(temperature), origin, line)
    yield OilFact(
        "oil_thinning_1_k", oil.walther.thinning(temperature), "computed", "slope of ASTM D341"
    )
    yield _alpha(oil, temperature)


def _index(oil: OilSheet) -> Iterator[OilFact]:
    if oil.index is None:
        return
    if oil.viscosity_100 is not None:
        yield OilFact(
            "oil_viscosity_index", oil.index, "computed", "of both viscosities, ASTM D2270"
        )
    elif oil.viscosity_index is not None:
        yield OilFact("oil_viscosity_index", oil.index, "given")
    else:
        yield OilFact(
            "oil_viscosity_index", MINERAL_INDEX, "estimated", "about what mineral oils have"
        )


def _alpha(oil: OilSheet, temperature: float) -> OilFact:
    alpha = oil.pressure_viscosity(temperature)
    if oil.measured is not None:
        return OilFact("oil_alpha_1_pa", alpha, "measured", oil.measured)
    if oil.alpha is not None:
        return OilFact("oil_alpha_1_pa", alpha, "given")
    estimator = oil.estimator
    spread = f"± {100.0 * estimator.spread:.0f} %" if oil.base == "mineral" else "spread unknown"
    return OilFact(
        "oil_alpha_1_pa", alpha, "estimated", f"{estimator.title}, {spread}, {estimator.definition}"
    )


def oil_notes(oil: OilSheet, temperature: float) -> tuple[str, ...]:
    """What a reader of results with this oil has to know, a sentence each; raises what `OilSheet.lubricant` does."""
    return tuple(_notes(oil, temperature))


def _notes(oil: OilSheet, temperature: float) -> Iterator[str]:
    facts = oil_facts(oil, temperature)
    for origin in ("given", "measured", "estimated"):
        if told := "; ".join(str(fact) for fact in facts if fact.origin == origin):
            yield f"Oil by its data sheet, {origin}: {told}."
    if oil.alpha is None and oil.base != "mineral":
        yield (
            f"Alpha of base {oil.base} is estimated by constants on which sources differ, without a measurement beside "
            "them; the film goes with about its root: give a measured alpha."
        )
    if oil.alpha is None and oil.viscosity(temperature) > THICKEST:
        yield (
            f"The viscosity of {oil.viscosity(temperature):.3g} Pa s lies above the {THICKEST:g} Pa s up to which "
            "estimates of alpha were compared with measured oils; give alpha."
        )
    if oil.measured is None and oil.index is not None and not INDICES[0] <= oil.index <= INDICES[1]:
        yield (
            f"The viscosity index of {oil.index:.4g} lies outside 0 to 250, where oils lie; check viscosity_40 and "
            "viscosity_100."
        )
