"""Forward model: predicted CRF, damping and CRFA for unknowns, by two spring laws.

"hertz-point" is the paper's law: the spring of a sphere under the asperities' load, with the
machine's damping. "own" uses the tangent stiffness of the solved contact, and its damping in
addition to the machine's.
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
from asperity.inference.observations import ObservationPoint
from asperity.inference.outputs import CAPACITANCE, CAR, CLR, DAMPING, OUTPUTS, STIFFNESS
from asperity.inference.priors import Unknown, share_of
from asperity.inference.settings import GRID_ERROR, LOAD, OFFSET, SPEED, TEMPERATURE, Setting

Law = Literal["hertz-point", "own"]
LAWS: tuple[Law, ...] = ("hertz-point", "own")
MIN_SHARE = 1e-4  # of the load, lower bound for logarithms
MIN_DAMPING = 1e-4


class ChannelPrediction(NamedTuple):
    """Predicted logarithms and their emulator standard deviations, shape (n, points) each.

    `log_force` is the derivative of ln CRF with respect to the law's exponent of the load.
    """

    crf: Field
    crf_std: Field
    damping: Field
    damping_std: Field
    crfa: Field
    crfa_std: Field
    log_force: Field
    capacitance: Field
    capacitance_std: Field


@dataclass(frozen=True)
class ForwardModel:
    """Spring laws of a contact on its emulator, at operating points.

    Parameters
    ----------
    setting, emulator : unknowns and ranges; emulated contact quantities
    points : operating points, all within the emulator's ranges
    """

    setting: Setting
    emulator: Emulator
    points: tuple[ObservationPoint, ...]

    def __post_init__(self) -> None:
        for point in self.points:
            require_inside(self.setting, point)

    @property
    def dims(self) -> int:
        """Number of unknowns."""
        return len(self.setting.unknowns)

    @cached_property
    def _index(self) -> Mapping[str, int]:
        return {unknown.key: number for number, unknown in enumerate(self.setting.unknowns)}

    @cached_property
    def observed(self) -> "ForwardModel":
        """The model at the measured operating points only; at all points if none was measured."""
        measured = tuple(point for point in self.points if point.measured)
        return replace(self, points=measured) if measured else self

    def unknown(self, z: Field, key: str, known: float) -> Field:
        """Return values of an unknown in SI, shape (n,), or the `known` value."""
        if key not in self._index:
            return np.full(len(z), known)
        number = self._index[key]
        return self.setting.unknowns[number].value(z[:, number])

    def shares(self, z: Field) -> Field:
        """Return the emulator's inputs, shape (n, points, ranges)."""
        contact = np.stack([u.share(z[:, i]) for i, u in enumerate(self.setting.contact)], axis=1)
        shares = np.empty((len(z), len(self.points), len(self.setting.ranges)))
        shares[:, :, : contact.shape[1]] = contact[:, None]
        offset = self.unknown(z, OFFSET, 0.0)
        for number, entry in enumerate(self.setting.operating, contact.shape[1]):
            for column, point in enumerate(self.points):
                nominal = _operating_value(self.setting, point, entry.key)
                value = Unknown("", entry).from_si(
                    nominal + (offset if entry.key == TEMPERATURE else 0.0)
                )
                shares[:, column, number] = np.clip(share_of(entry, value), 0.0, 1.0)
        return shares

    def emulate(
        self, z: Field, keys: Sequence[str], *, deviations: bool = True
    ) -> dict[str, tuple[Field, Field]]:
        """Return mean and deviation (or 0) of outputs on their scales, shape (n, points)."""
        shares = self.shares(z)
        rows, points, ranges = shares.shape
        flat = shares.reshape(-1, ranges)
        if deviations:
            emulated = self.emulator(flat, keys)
        else:
            emulated = {
                key: (mean, np.zeros(len(mean)))
                for key, mean in self.emulator.means(flat, keys).items()
            }
        z_grid = self.unknown(z, GRID_ERROR, 0.0)[:, None]
        outputs: dict[str, tuple[Field, Field]] = {}
        for key, (mean, std) in emulated.items():
            error = self.emulator.grid.get(key, EmulatorGridError())
            corrected = mean.reshape(rows, points) + error.correction(z_grid)
            outputs[key] = corrected, std.reshape(rows, points)
        return outputs

    def correlations(self, z: Field, law: Law) -> dict[str, Field]:
        """Return correlations of the emulator's errors by channel, shape (n, points, points)."""
        count, points = len(z), len(self.points)
        spring, damper = (CLR, CLR) if law == "hertz-point" else (STIFFNESS, DAMPING)
        keys = {"crf": spring, "damping": damper, "crfa": CAR}
        if points == 1:
            return dict.fromkeys(keys, np.ones((count, 1, 1)))
        x = self.emulator.features(self.shares(z).reshape(count * points, -1)).reshape(
            count, points, -1
        )
        by_output = {
            key: self.emulator.processes[key].correlations(x)
            for key in dict.fromkeys(keys.values())
        }
        return {channel: by_output[key] for channel, key in keys.items()}

    def states(self, z: Field, keys: Sequence[str]) -> dict[str, Field]:
        """Return mean outputs in their own units, shape (n, points)."""
        return {key: OUTPUTS[key].back(mean) for key, (mean, _) in self.emulate(z, keys).items()}

    def required_outputs(self, law: Law, *, heights: bool = True) -> tuple[str, ...]:
        """Return the emulator outputs that a law needs."""
        required: tuple[str, ...] = (CLR,) if law == "hertz-point" else (STIFFNESS, DAMPING)
        if any(not math.isnan(point.capacitance.value) for point in self.points):
            required = (*required, CAPACITANCE)
        return (*required, CAR) if heights and self._noise_excited else required

    @property
    def _noise_excited(self) -> bool:
        """True if the excitation is noise, whose CRFA is known up to a gain."""
        model = self.setting.case.vibration
        return model is not None and isinstance(model.excitation, NoiseExcitation)

    def predict(
        self, z: Field, law: Law, *, heights: bool = True, deviations: bool = True
    ) -> ChannelPrediction:
        """Predict measurements at unknowns z, shape (n, dims), by a law.

        CRFA is nan without `heights`, standard deviations are 0 without `deviations`.
        """
        emulated = self.emulate(
            z, self.required_outputs(law, heights=heights), deviations=deviations
        )
        return self.predict_from(z, law, emulated, heights=heights)

    def predict_from(
        self,
        z: Field,
        law: Law,
        emulated: Mapping[str, tuple[Field, Field]],
        *,
        heights: bool = True,
    ) -> ChannelPrediction:
        """Predict measurements from emulated outputs, at least those of `required_outputs`."""
        model = self.setting.case.vibration
        assert model is not None
        mass = self.unknown(z, "mass_kg", model.mass)[:, None]
        machine_damping = self.unknown(z, "damping_ratio", model.damping_ratio)[:, None]
        loads = np.array([point.load_n for point in self.points])
        if law == "hertz-point":
            spring = self._sphere(emulated[CLR], loads, machine_damping)
        else:
            spring = _emulated_spring(emulated, loads, machine_damping)
        crf = 0.5 * (spring.stiffness - np.log(mass)) - math.log(2.0 * math.pi)
        crfa = np.full(crf.shape, np.nan)
        crfa_std = np.full(crf.shape, np.nan)
        if heights and self._noise_excited:
            crfa, crfa_std = self._log_crfa(z, crf, spring.damping, emulated[CAR])
        absent = np.full(crf.shape, np.nan), np.full(crf.shape, np.nan)
        return ChannelPrediction(
            crf,
            0.5 * spring.stiffness_std,
            spring.damping,
            spring.damping_std,
            crfa,
            crfa_std,
            spring.log_force,
            *emulated.get(CAPACITANCE, absent),
        )

    def _sphere(
        self, emulated: tuple[Field, Field], loads: Field, machine_damping: Field
    ) -> "_Spring":
        """Return the spring of a sphere under CLR F, with the machine's damping."""
        mean, std = emulated
        share = OUTPUTS[CLR].back(mean)
        bounded = np.maximum(share, MIN_SHARE)
        conditions = self.setting.case.conditions
        one_newton = point_stiffness(
            1.0, conditions.radius_along_rolling, conditions.pair.reduced_modulus
        )
        log_force = np.log(bounded * loads)
        stiffness = math.log(one_newton) + log_force / 3.0
        return _Spring(
            stiffness,
            std / OUTPUTS[CLR].slope(share) / bounded / 3.0,
            np.log(machine_damping) + np.zeros_like(stiffness),
            np.zeros_like(stiffness),
            log_force,
        )

    def _log_crfa(
        self, z: Field, crf: Field, damping: Field, emulated: tuple[Field, Field]
    ) -> tuple[Field, Field]:
        """Return ln CRFA up to a gain, and its standard deviation from that of CAR.

        CRFA ∝ Sq^2 fc^p f^(4 - 2n) / 4 ζ^2 for noise behind a low-pass filter of order n.
        """
        model = self.setting.case.vibration
        assert model is not None
        law = model.excitation
        assert isinstance(law, NoiseExcitation)
        order = law.filter_order
        power = 2 * order - (law.coefficient == "readjusted")
        exponent = self.unknown(z, "cutoff_exponent", law.cutoff_exponent)[:, None]
        sq = self.unknown(z, "sq_m", math.nan)[:, None]
        if "sq_m" not in self._index:
            sq = np.ones((len(z), 1))
        car = np.maximum(OUTPUTS[CAR].back(emulated[0]), MIN_SHARE)
        cutoff = exponent * np.log(car / law.car_reference)
        height = (
            2.0 * np.log(sq)
            + power * cutoff
            + (4 - 2 * order) * crf
            - 2.0 * damping
            - math.log(4.0)
        )
        return np.asarray(height), power * exponent * emulated[1] / (OUTPUTS[CAR].slope(car) * car)


class _Spring(NamedTuple):
    """Logarithms of stiffness, damping ratio and force, with standard deviations, (n, points)."""

    stiffness: Field
    stiffness_std: Field
    damping: Field
    damping_std: Field
    log_force: Field


def _emulated_spring(
    emulated: Mapping[str, tuple[Field, Field]], loads: Field, machine_damping: Field
) -> _Spring:
    """Return the spring of the emulated contact, whose damping adds to the machine's."""
    stiffness, stiffness_std = emulated[STIFFNESS]
    contact_damping, contact_std = emulated[DAMPING]
    scale = OUTPUTS[DAMPING]
    total = np.maximum(machine_damping + scale.back(contact_damping), MIN_DAMPING)
    return _Spring(
        stiffness,
        stiffness_std,
        np.log(total),
        contact_std / scale.slope(scale.back(contact_damping)) / total,
        np.broadcast_to(np.log(loads), stiffness.shape),
    )


def _operating_value(setting: Setting, point: ObservationPoint, key: str) -> float:
    """Return an operating quantity of a point in SI; by default the case's temperature."""
    if key == LOAD:
        return point.load_n
    if key == SPEED:
        return point.entrainment_m_s
    if point.temperature_k is not None:
        return point.temperature_k
    return float(setting.case.contents.lubricant.temperature)  # type: ignore[union-attr]


def require_inside(setting: Setting, point: ObservationPoint) -> None:
    """Raise BadInput for a point outside the emulator's ranges or an unusable temperature."""
    if point.temperature_k is not None and all(
        limits.key != TEMPERATURE for limits in setting.operating
    ):
        raise BadInput(
            "a recording's temperature needs an oil given by its data sheet; "
            "set [lubricant] by grade and temperature, or remove the column temperature_degc"
        )
    names = {LOAD: "load_n", SPEED: "entrainment_speed_m_s", TEMPERATURE: "oil_temperature_k"}
    for limits in setting.operating:
        value = _operating_value(setting, point, limits.key)
        low, high = (
            float(end) for end in Unknown("", limits).to_si(np.array([limits.low, limits.high]))
        )
        if not low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9):
            entry = quantity(names[limits.key])
            label = f" of {point.names[0]}" if point.names and point.names[0] else ""
            raise BadInput(
                f"{entry.name}{label} must lie within {entry.number(low)} to {entry.text(high)}, "
                f"the emulator's range, got {entry.text(value)}; "
                f"widen infer.{limits.key.rpartition('.')[2]} in the case"
            )
