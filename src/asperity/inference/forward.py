"""From unknowns to what a recording shows of them, by two laws of the contact's spring, for many at once.

"hertz-point" is the paper's: a sphere's spring under the asperities' load alone, with a damping
that is the machine's. "own" is the solved contact's: its tangent stiffness, and its own damping
beside the machine's.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from asperity.contact.hertz import point_stiffness
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity
from asperity.coupling import NoiseExcitation
from asperity.inference.emulator import Emulator, EmulatorGridError
from asperity.inference.observations import OperatingPoint
from asperity.inference.outputs import CAR, CLR, DAMPING, OUTPUTS, STIFFNESS
from asperity.inference.priors import Unknown, share_of
from asperity.inference.settings import GRID_ERROR, LOAD, OFFSET, SPEED, TEMPERATURE, Setting

Law = Literal["hertz-point", "own"]
LAWS: tuple[Law, ...] = ("hertz-point", "own")
LEAST_SHARE = 1e-4  # of the load: below it, its logarithm means nothing
LEAST_DAMPING = 1e-4


class ChannelPrediction(NamedTuple):
    """What a law says that recordings show: arrays of (unknowns, operating points); logarithms, and their deviations.

    That of CRFA is the emulator's of CAR. `lever` is by how much ln CRF moves with the law's
    exponent of the load.
    """

    crf: Field
    crf_std: Field
    damping: Field
    damping_std: Field
    crfa: Field
    crfa_std: Field
    lever: Field


@dataclass(frozen=True)
class Forward:
    """A contact's laws over its emulator, at operating points.

    Parameters
    ----------
    setting, emulator : what is asked, and what answers
    points : operating points, all within the emulator's ranges
    """

    setting: Setting
    emulator: Emulator
    points: tuple[OperatingPoint, ...]

    def __post_init__(self) -> None:
        for point in self.points:
            require_inside(self.setting, point)

    @property
    def dims(self) -> int:
        """How many unknowns there are."""
        return len(self.setting.unknowns)

    @cached_property
    def _place(self) -> Mapping[str, int]:
        return {unknown.key: number for number, unknown in enumerate(self.setting.unknowns)}

    @cached_property
    def heard(self) -> "Forward":
        """The same at those operating points alone where something was heard; at all of them where nothing was."""
        heard = tuple(point for point in self.points if not math.isnan(point.crf.value))
        return replace(self, points=heard) if heard else self

    def unknown(self, z: Field, key: str, known: float) -> Field:
        """Values of an unknown, SI, shape (n,); those of the case where it is known."""
        if key not in self._place:
            return np.full(len(z), known)
        number = self._place[key]
        return self.setting.unknowns[number].value(z[:, number])

    def shares(self, z: Field) -> Field:
        """What the emulator is asked by: (n, points, ranges)."""
        contact = np.stack([u.share(z[:, i]) for i, u in enumerate(self.setting.contact)], axis=1)
        shares = np.empty((len(z), len(self.points), len(self.setting.ranges)))
        shares[:, :, : contact.shape[1]] = contact[:, None]
        offset = self.unknown(z, OFFSET, 0.0)
        for number, entry in enumerate(self.setting.operating, contact.shape[1]):
            for place, point in enumerate(self.points):
                stated = _operating_value(self.setting, point, entry.key)
                value = Unknown("", entry).from_si(
                    stated + (offset if entry.key == TEMPERATURE else 0.0)
                )
                shares[:, place, number] = np.clip(share_of(entry, value), 0.0, 1.0)
        return shares

    def emulated(
        self, z: Field, keys: Sequence[str], *, deviations: bool = True
    ) -> dict[str, tuple[Field, Field]]:
        """Mean and deviation of outputs, on their scales, shape (n, points); zeros where no `deviations` are wanted."""
        shares = self.shares(z)
        rows, places, ranges = shares.shape
        flat = shares.reshape(-1, ranges)
        if deviations:
            answers = self.emulator(flat, keys)
        else:
            answers = {
                key: (mean, np.zeros(len(mean)))
                for key, mean in self.emulator.means(flat, keys).items()
            }
        z_grid = self.unknown(z, GRID_ERROR, 0.0)[:, None]
        found: dict[str, tuple[Field, Field]] = {}
        for key, (mean, std) in answers.items():
            error = self.emulator.grid.get(key, EmulatorGridError())
            found[key] = mean.reshape(rows, places) + error.at(z_grid), std.reshape(rows, places)
        return found

    def correlations(self, z: Field, law: Law) -> dict[str, Field]:
        """Of the emulator's errors at the operating points, (n, points, points), in CRF, damping and CRFA."""
        count, places = len(z), len(self.points)
        stiff, damped = (CLR, CLR) if law == "hertz-point" else (STIFFNESS, DAMPING)
        keys = {"crf": stiff, "damping": damped, "crfa": CAR}
        if places == 1:
            return dict.fromkeys(keys, np.ones((count, 1, 1)))
        x = self.emulator.features(self.shares(z).reshape(count * places, -1)).reshape(
            count, places, -1
        )
        found = {
            key: self.emulator.processes[key].correlations(x)
            for key in dict.fromkeys(keys.values())
        }
        return {channel: found[key] for channel, key in keys.items()}

    def states(self, z: Field, keys: Sequence[str]) -> dict[str, Field]:
        """Outputs in their own units, shape (n, points)."""
        return {key: OUTPUTS[key].back(mean) for key, (mean, _) in self.emulated(z, keys).items()}

    def outputs(self, law: Law, *, heights: bool = True) -> tuple[str, ...]:
        """What a law asks the emulator for."""
        own: tuple[str, ...] = (CLR,) if law == "hertz-point" else (STIFFNESS, DAMPING)
        return (*own, CAR) if heights and self._noisy else own

    @property
    def _noisy(self) -> bool:
        """Whether the case's excitation is one whose height is known but for a gain."""
        model = self.setting.case.vibration
        return model is not None and isinstance(model.excitation, NoiseExcitation)

    def shown(
        self, z: Field, law: Law, *, heights: bool = True, deviations: bool = True
    ) -> ChannelPrediction:
        """What recordings show at unknowns z, shape (n, dims), by a law.

        CRFA is nan where no `heights` are wanted, deviations are 0 where none are.
        """
        emulated = self.emulated(z, self.outputs(law, heights=heights), deviations=deviations)
        return self.shown_by(z, law, emulated, heights=heights)

    def shown_by(
        self,
        z: Field,
        law: Law,
        emulated: Mapping[str, tuple[Field, Field]],
        *,
        heights: bool = True,
    ) -> ChannelPrediction:
        """The same of outputs that are emulated already: those of `outputs` at least."""
        model = self.setting.case.vibration
        assert model is not None
        mass = self.unknown(z, "mass_kg", model.mass)[:, None]
        rest = self.unknown(z, "damping_ratio", model.damping_ratio)[:, None]
        loads = np.array([point.load_n for point in self.points])
        if law == "hertz-point":
            stiffness, stiffness_std, lever = self._sphere(emulated[CLR], loads)
            damping, damping_std = np.log(rest) + np.zeros_like(stiffness), np.zeros_like(stiffness)
        else:
            stiffness, stiffness_std = emulated[STIFFNESS]
            lever = np.broadcast_to(np.log(loads), stiffness.shape)
            own, own_std = emulated[DAMPING]
            scale = OUTPUTS[DAMPING]
            total = np.maximum(rest + scale.back(own), LEAST_DAMPING)
            damping, damping_std = np.log(total), own_std / scale.slope(scale.back(own)) / total
        crf = 0.5 * (stiffness - np.log(mass)) - math.log(2.0 * math.pi)
        crfa, crfa_std = np.full(crf.shape, np.nan), np.full(crf.shape, np.nan)
        if heights and self._noisy:
            crfa, crfa_std = self._height(z, crf, damping, emulated[CAR])
        return ChannelPrediction(
            crf, 0.5 * stiffness_std, damping, damping_std, crfa, crfa_std, lever
        )

    def _sphere(self, emulated: tuple[Field, Field], loads: Field) -> tuple[Field, Field, Field]:
        """Logarithm of the sphere's stiffness under CLR F, its deviation, and ln(CLR F)."""
        mean, std = emulated
        share = OUTPUTS[CLR].back(mean)
        borne = np.maximum(share, LEAST_SHARE)
        conditions = self.setting.case.conditions
        one_newton = point_stiffness(
            1.0, conditions.radius_along_rolling, conditions.pair.reduced_modulus
        )
        lever = np.log(borne * loads)
        return (
            math.log(one_newton) + lever / 3.0,
            std / OUTPUTS[CLR].slope(share) / borne / 3.0,
            lever,
        )

    def _height(
        self, z: Field, crf: Field, damping: Field, emulated: tuple[Field, Field]
    ) -> tuple[Field, Field]:
        """Logarithm of CRFA but for a gain, and its deviation by CAR's.

        Sq^2 fc^p f^(4 - 2n) / 4 ζ^2, over noise behind a low pass of order n.
        """
        model = self.setting.case.vibration
        assert model is not None
        law = model.excitation
        assert isinstance(law, NoiseExcitation)
        order = law.filter_order
        power = 2 * order - (law.coefficient == "readjusted")
        exponent = self.unknown(z, "cutoff_exponent", law.cutoff_exponent)[:, None]
        sq = self.unknown(z, "sq_m", math.nan)[:, None]
        if "sq_m" not in self._place:
            sq = np.ones((len(z), 1))
        car = np.maximum(OUTPUTS[CAR].back(emulated[0]), LEAST_SHARE)
        cutoff = exponent * np.log(car / law.car_reference)
        height = (
            2.0 * np.log(sq)
            + power * cutoff
            + (4 - 2 * order) * crf
            - 2.0 * damping
            - math.log(4.0)
        )
        return np.asarray(height), power * exponent * emulated[1] / (OUTPUTS[CAR].slope(car) * car)


def _operating_value(setting: Setting, point: OperatingPoint, key: str) -> float:
    """An operating quantity of a point, SI; the case's own temperature where the point has none."""
    if key == LOAD:
        return point.load_n
    if key == SPEED:
        return point.entrainment_m_s
    if point.temperature_k is not None:
        return point.temperature_k
    return float(setting.case.contents.lubricant.temperature)  # type: ignore[union-attr]


def require_inside(setting: Setting, point: OperatingPoint) -> None:
    """BadInput for an operating point that the emulator does not reach, or a temperature that its oil has not."""
    if point.temperature_k is not None and all(
        entry.key != TEMPERATURE for entry in setting.operating
    ):
        raise BadInput(
            "a recording's temperature needs an oil by its data sheet, whose viscosity over temperature is known; "
            "state [lubricant] by grade and temperature, or leave the column temperature_degc out"
        )
    names = {LOAD: "load_n", SPEED: "entrainment_speed_m_s", TEMPERATURE: "oil_temperature_k"}
    for entry in setting.operating:
        value = _operating_value(setting, point, entry.key)
        low, high = (
            float(end) for end in Unknown("", entry).to_si(np.array([entry.low, entry.high]))
        )
        if not low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9):
            shown = quantity(names[entry.key])
            whose = f" of {point.names[0]}" if point.names and point.names[0] else ""
            raise BadInput(
                f"{shown.name}{whose} must lie within {shown.number(low)} to {shown.text(high)}, where the contact is "
                f"emulated, got {shown.text(value)}; widen infer.{entry.key.rpartition('.')[2]} in the case"
            )
