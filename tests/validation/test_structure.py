"""Modes of structures with their contact against closed forms; receptance coupling."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy

from asperity.core.errors import AsperityError, BadInput
from asperity.structure import (
    Structure,
    coupled_modes,
    coupled_receptance,
    load_structure,
    sensor_response,
    settled_modes,
    share_of_receptance,
    transfer_of_roughness,
)


def structure(mass, stiffness, contact, *, damping=None, sensor=None):
    size = len(mass)
    return Structure(
        mass=mass,
        stiffness=stiffness,
        damping=np.zeros((size, size)) if damping is None else damping,
        contact=contact,
        sensor=np.eye(size)[0] if sensor is None else sensor,
    )


def chain(count, mass, spring, missing):
    """Masses between walls on equal springs, without the spring that is the contact."""
    stiffness, contact = np.zeros((count, count)), np.zeros(count)
    for number in range(count + 1):
        ends = np.zeros(count)
        if number < count:
            ends[number] = 1.0
        if number > 0:
            ends[number - 1] = -1.0
        if number == missing:
            contact = ends
        else:
            stiffness += spring * np.outer(ends, ends)
    return structure(mass * np.eye(count), stiffness, contact)


def beam(elements, length=0.3, rigidity=500.0, line_mass=2.0):
    """Cantilever of cubic elements whose tip is in the contact."""
    size = 2 * (elements + 1)
    h = length / elements
    bending = (
        rigidity
        / h**3
        * np.array(
            [
                [12.0, 6.0 * h, -12.0, 6.0 * h],
                [6.0 * h, 4.0 * h**2, -6.0 * h, 2.0 * h**2],
                [-12.0, -6.0 * h, 12.0, -6.0 * h],
                [6.0 * h, 2.0 * h**2, -6.0 * h, 4.0 * h**2],
            ]
        )
    )
    inertia = (
        line_mass
        * h
        / 420.0
        * np.array(
            [
                [156.0, 22.0 * h, 54.0, -13.0 * h],
                [22.0 * h, 4.0 * h**2, 13.0 * h, -3.0 * h**2],
                [54.0, 13.0 * h, 156.0, -22.0 * h],
                [-13.0 * h, -3.0 * h**2, -22.0 * h, 4.0 * h**2],
            ]
        )
    )
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    for number in range(elements):
        place = np.s_[2 * number : 2 * number + 4]
        stiffness[place, place] += bending
        mass[place, place] += inertia
    tip = np.zeros(size)
    tip[-2] = 1.0
    return structure(mass[2:, 2:], stiffness[2:, 2:], tip[2:], sensor=tip[2:])


def test_two_free_masses_on_their_contact():
    m1, m2, k = 2.0, 3.0, 5e8
    rigid, mode = coupled_modes(structure(np.diag([m1, m2]), np.zeros((2, 2)), [1.0, -1.0]), k)
    assert rigid.frequency_hz == 0.0
    assert rigid.contact_share == 0.0
    angular = math.sqrt(k * (m1 + m2) / (m1 * m2))
    assert mode.frequency_hz == pytest.approx(angular / (2.0 * math.pi), rel=1e-6)
    assert mode.contact_share == pytest.approx(1.0, rel=1e-6)
    assert mode.shift(0.02) == pytest.approx(0.01)


def test_a_mass_on_a_holder_and_the_contact():
    """Springs in parallel: the contact's share is its share of the stiffness."""
    (mode,) = coupled_modes(structure([[0.4]], [[3e7]], [1.0]), 1e8)
    assert mode.frequency_hz == pytest.approx(math.sqrt(1.3e8 / 0.4) / (2.0 * math.pi), rel=1e-6)
    assert mode.contact_share == pytest.approx(100.0 / 130.0, rel=1e-6)


@pytest.mark.parametrize("missing", [0, 2, 7])
def test_a_chain_of_masses(missing):
    """ω = 2 √(k/m) sin(iπ/2(n + 1)), amplitudes sin(ijπ/(n + 1)), shares of one spring."""
    count, mass, spring = 7, 0.3, 2e7
    modes = coupled_modes(chain(count, mass, spring, missing), spring)
    for i, mode in enumerate(modes, 1):
        angle = i * math.pi / (count + 1)
        angular = 2.0 * math.sqrt(spring / mass) * math.sin(0.5 * angle)
        assert mode.frequency_hz == pytest.approx(angular / (2.0 * math.pi), rel=1e-6)
        stretch = np.diff([math.sin(j * angle) for j in range(count + 2)])
        assert mode.contact_share == pytest.approx(
            stretch[missing] ** 2 / (stretch**2).sum(), rel=1e-6
        )


def test_a_beam_on_the_contact():
    """Cantilever with a spring at its tip: β³(1 + cos cosh) + κ(sin cosh - cos sinh) = 0."""
    length, rigidity, line_mass, k = 0.3, 500.0, 2.0, 4e5
    kappa = k * length**3 / rigidity

    def residual(beta):
        cos, sin, cosh, sinh = math.cos(beta), math.sin(beta), math.cosh(beta), math.sinh(beta)
        return beta**3 * (1.0 + cos * cosh) + kappa * (sin * cosh - cos * sinh)

    modes = coupled_modes(beam(60, length, rigidity, line_mass), k)
    grid = np.linspace(0.1, 11.0, 4000)
    signs = [i for i in range(len(grid) - 1) if residual(grid[i]) * residual(grid[i + 1]) < 0.0]
    for number, i in enumerate(signs[:3]):
        beta = scipy.optimize.brentq(residual, grid[i], grid[i + 1], xtol=1e-14)
        angular = beta**2 * math.sqrt(rigidity / line_mass) / length**2
        assert modes[number].frequency_hz == pytest.approx(angular / (2.0 * math.pi), rel=1e-6)


def test_the_shift_of_a_frequency_is_half_the_share():
    model = beam(20)
    before, after = (coupled_modes(model, k) for k in (4e5 * (1.0 - 5e-4), 4e5 * (1.0 + 5e-4)))
    for number, mode in enumerate(coupled_modes(model, 4e5)[:5]):
        change = math.log(after[number].frequency_hz / before[number].frequency_hz)
        assert mode.shift(1e-3) == pytest.approx(change, rel=1e-5)
    shares = [mode.contact_share for mode in coupled_modes(model, 4e5)]
    assert all(0.0 <= share <= 1.0 for share in shares)


def test_light_damping_is_that_of_the_complex_modes():
    rng = np.random.default_rng(1)
    mass, stiffness = np.diag([1.0, 2.0, 0.5]), np.diag([4e7, 1e7, 9e7])
    part = rng.standard_normal((3, 3))
    damping, contact = 2.0 * part @ part.T, np.array([1.0, -0.5, 0.2])
    model = structure(mass, stiffness, contact, damping=damping)
    k, c = 3e7, 20.0
    modes = coupled_modes(model, k, c)
    inverse = np.linalg.inv(mass)
    whole = np.block(
        [
            [np.zeros((3, 3)), np.eye(3)],
            [
                -inverse @ (stiffness + k * np.outer(contact, contact)),
                -inverse @ (damping + c * np.outer(contact, contact)),
            ],
        ]
    )
    values = [value for value in np.linalg.eigvals(whole) if value.imag > 0.0]
    exact = sorted((abs(value) / (2.0 * math.pi), -value.real / abs(value)) for value in values)
    for mode, (frequency_hz, ratio) in zip(modes, exact, strict=True):
        assert mode.frequency_hz == pytest.approx(frequency_hz, rel=1e-5)
        assert mode.damping_ratio == pytest.approx(ratio, rel=1e-4)


def test_modes_settle_at_the_stiffness_of_their_own_frequency():
    """k = k0 (1 + f/f0) on one mass: ω² m = k0 (1 + f/f0), a quadratic."""
    m, k0, f0 = 0.1, 1e8, 5e3
    (mode,) = settled_modes(
        Structure.single_mass(m), lambda frequency_hz: (k0 * (1.0 + frequency_hz / f0), 0.0)
    )
    a, b = 4.0 * math.pi**2 * m, k0 / f0
    expected = (b + math.sqrt(b**2 + 4.0 * a * k0)) / (2.0 * a)
    assert mode.frequency_hz == pytest.approx(expected, rel=1e-6)
    assert mode.stiffness == pytest.approx(k0 * (1.0 + expected / f0), rel=1e-6)
    assert not settled_modes(Structure.single_mass(m), lambda _: (k0, 0.0), highest_hz=1e3)
    with pytest.raises(AsperityError, match="does not settle"):
        settled_modes(
            Structure.single_mass(m), lambda frequency_hz: (k0 if frequency_hz < 4e3 else 1e7, 0.0)
        )


def receptances(model, frequencies_hz):
    """Receptances without the contact's spring: sensor, sensor from contact, contact."""
    found = []
    for frequency_hz in frequencies_hz:
        angular = 2.0 * math.pi * frequency_hz
        dynamic = model.stiffness + 1j * angular * model.damping - angular**2 * model.mass
        flexible = np.linalg.inv(dynamic)
        found.append(
            (
                model.sensor @ flexible @ model.sensor,
                model.sensor @ flexible @ model.contact,
                model.contact @ flexible @ model.contact,
            )
        )
    return np.array(found).T


def test_receptance_coupling_equals_the_assembled_structure():
    model = replace(
        chain(4, 0.5, 1e7, 2), damping=3.0 * np.eye(4), sensor=np.array([0.0, 0.0, 1.0, 0.3])
    )
    k, c = 2e7, 15.0
    frequencies_hz = np.linspace(20.0, 1500.0, 41)
    both = np.outer(model.contact, model.contact)
    whole = replace(model, stiffness=model.stiffness + k * both, damping=model.damping + c * both)
    spring = k + 2j * np.pi * frequencies_hz * c
    sensor, transfer, approach = receptances(model, frequencies_hz)
    expected, across, _ = receptances(whole, frequencies_hz)
    np.testing.assert_allclose(
        coupled_receptance(sensor, transfer, approach, spring), expected, rtol=1e-9
    )
    np.testing.assert_allclose(
        transfer_of_roughness(transfer, approach, spring), across * spring, rtol=1e-9
    )


def test_the_sensor_follows_roughness_through_a_single_mass():
    """x/w = z/(z - ω² m), and the coupling of receptances of a larger structure."""
    m, k, c, frequency_hz = 0.1, 1e8, 30.0, 3000.0
    angular = 2.0 * math.pi * frequency_hz
    spring = k + 1j * angular * c
    found = sensor_response(Structure.single_mass(m), k, c, frequency_hz)
    assert found == pytest.approx(spring / (spring - angular**2 * m), rel=1e-12)
    model = replace(chain(4, 0.5, 1e7, 2), damping=3.0 * np.eye(4))
    _, transfer, approach = receptances(model, [frequency_hz])
    expected = transfer_of_roughness(transfer, approach, spring)[0]
    assert sensor_response(model, k, c, frequency_hz) == pytest.approx(expected, rel=1e-9)


def test_shares_from_receptances_are_those_of_the_modes():
    model = chain(5, 0.5, 1e7, 3)
    frequencies_hz = np.linspace(150.0, 1600.0, 29001)
    _, _, approach = receptances(model, frequencies_hz)
    found = [pair for pair in share_of_receptance(frequencies_hz, approach, 1e7) if pair[1] > 1e-3]
    modes = [mode for mode in coupled_modes(model, 1e7) if mode.contact_share > 1e-3]
    assert len(found) == len(modes)
    for (frequency_hz, share), mode in zip(found, modes, strict=True):
        assert frequency_hz == pytest.approx(mode.frequency_hz, rel=1e-6)
        assert share == pytest.approx(mode.contact_share, rel=1e-4)


def test_a_structure_of_modes_has_the_coupled_modes_of_its_matrices():
    model = chain(4, 0.5, 1e7, 1)
    free = coupled_modes(model, 0.0)
    modal = Structure.from_modes(
        [mode.frequency_hz for mode in free],
        0.01,
        contact=[mode.contact_shape for mode in free],
        sensor=[mode.sensor_shape for mode in free],
    )
    for mode, expected in zip(coupled_modes(modal, 3e7), coupled_modes(model, 3e7), strict=True):
        assert mode.frequency_hz == pytest.approx(expected.frequency_hz, rel=1e-9)
        assert mode.contact_share == pytest.approx(expected.contact_share, rel=1e-9)
        assert abs(mode.sensor_shape) == pytest.approx(abs(expected.sensor_shape), rel=1e-6)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"mass": [[1.0, 2.0]]}, "mass must be a square matrix"),
        ({"mass": [[1.0, 0.0], [0.5, 1.0]]}, "mass must be symmetric"),
        ({"mass": [[1.0, 0.0], [0.0, 0.0]]}, "mass matrix must be positive definite"),
        ({"stiffness": [[1.0]]}, "stiffness has 1 degrees of freedom and mass 2"),
        ({"stiffness": [[-1.0, 0.0], [0.0, 1.0]]}, "negative eigenvalue"),
        ({"stiffness": [[math.nan, 0.0], [0.0, 1.0]]}, "not finite"),
        ({"contact": [0.0, 0.0]}, "contact is 0 for every degree"),
        ({"sensor": [1.0]}, "sensor must be 2 finite numbers"),
    ],
)
def test_an_unusable_structure_is_refused_in_one_sentence(changed, message):
    usable = {
        "mass": np.eye(2),
        "stiffness": np.eye(2),
        "damping": np.zeros((2, 2)),
        "contact": [1.0, 0.0],
        "sensor": [1.0, 0.0],
    }
    with pytest.raises(BadInput, match=message):
        Structure(**{**usable, **changed})


MATRICES = """
mass = [[2.0, 0.0], [0.0, 20.0]]
stiffness = [[1e6, 0.0], [0.0, 2e8]]
contact = [1.0, -1.0]
sensor = [1.0, 0.0]
"""
MODES = """
name = "gear case"
noise = 1e-3
[modes]
frequency_hz = [100.0, 900.0]
damping_ratio = [0.01, 0.02]
contact = [0.3, 0.5]
sensor = [0.1, 0.2]
"""


def test_a_file_has_matrices_or_modes(tmp_path):
    (tmp_path / "holder.toml").write_text(MATRICES, "utf-8")
    holder = load_structure(tmp_path / "holder.toml")
    assert (holder.name, holder.noise) == ("holder", None)
    np.testing.assert_array_equal(holder.structure.stiffness, np.diag([1e6, 2e8]))
    np.testing.assert_array_equal(holder.structure.damping, np.zeros((2, 2)))
    (tmp_path / "gear.toml").write_text(MODES, "utf-8")
    gear = load_structure(tmp_path / "gear.toml")
    assert (gear.name, gear.noise) == ("gear case", 1e-3)
    frequencies = [mode.frequency_hz for mode in coupled_modes(gear.structure, 0.0)]
    assert frequencies == pytest.approx([100.0, 900.0], rel=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mass = [", "is not valid TOML"),
        (MATRICES.replace("sensor = [1.0, 0.0]", ""), "sensor is missing; add it"),
        (MATRICES + "masses = 1", "unknown key 'masses'"),
        (MATRICES.replace("[1.0, -1.0]", '["one", 2.0]'), "not numbers"),
        (MATRICES.replace("[1.0, -1.0]", "[1.0]"), "contact must be 2 finite numbers"),
        (MATRICES + "noise = -1.0", "noise must be a positive number"),
        ("[modes]\nfrequency_hz = [1.0]", r"\[modes\] must have contact, damping_ratio"),
    ],
)
def test_an_unusable_file_is_refused_in_one_sentence(tmp_path, text, message):
    path = tmp_path / "structure.toml"
    path.write_text(text, "utf-8")
    with pytest.raises(BadInput, match=message) as refused:
        load_structure(path)
    assert str(refused.value).startswith(str(path))


def test_further_inputs_are_checked():
    with pytest.raises(BadInput, match="contact stiffness must be 0 N/m or more"):
        coupled_modes(Structure.single_mass(1.0), -1.0)
    with pytest.raises(BadInput, match="must be 0 or more"):
        Structure.from_modes([-1.0], 0.01, contact=[1.0], sensor=[1.0])
    with pytest.raises(BadInput, match="four or more increasing frequencies"):
        share_of_receptance([1.0, 2.0, 2.0, 3.0], np.ones(4), 1.0)
    with pytest.raises(BadInput, match="mass"):
        Structure.single_mass(0.0)
