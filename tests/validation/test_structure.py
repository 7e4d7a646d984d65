"""Modes of structures with their contact against closed forms; receptance coupling."""

import math
from dataclasses import replace

import numpy as np
import pandas
import pytest
import scipy
import xarray

from asperity.core.errors import AsperityError, BadInput, UnreadableFile
from asperity.structure import (
    Receptances,
    Structure,
    coupled_modes,
    coupled_receptance,
    load_structure,
    receptance_modes,
    sensor_response,
    settled_modes,
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
    (found,) = sensor_response(Structure.single_mass(m), k, c, [frequency_hz])
    assert found == pytest.approx(spring / (spring - angular**2 * m), rel=1e-12)
    model = replace(chain(4, 0.5, 1e7, 2), damping=3.0 * np.eye(4))
    _, transfer, approach = receptances(model, [frequency_hz])
    expected = transfer_of_roughness(transfer, approach, spring)[0]
    assert sensor_response(model, k, c, [frequency_hz])[0] == pytest.approx(expected, rel=1e-9)


def test_modes_of_receptances_are_those_of_the_structure():
    model = replace(chain(5, 0.5, 1e7, 3), sensor=np.array([0.0, 1.0, 0.0, 0.0, -0.4]))
    frequencies_hz = np.linspace(150.0, 1600.0, 29001)
    _, transfer, approach = receptances(model, frequencies_hz)
    measured = Receptances(frequencies_hz=frequencies_hz, approach=approach, transfer=transfer)
    found = receptance_modes(measured, lambda _: (1e7, 0.0))
    found = [mode for mode in found if mode.contact_share > 1e-3]
    modes = [mode for mode in coupled_modes(model, 1e7) if mode.contact_share > 1e-3]
    assert len(found) == len(modes)
    for mode, expected in zip(found, modes, strict=True):
        assert mode.frequency_hz == pytest.approx(expected.frequency_hz, rel=1e-6)
        assert mode.contact_share == pytest.approx(expected.contact_share, rel=1e-4)
        assert mode.contact_shape == pytest.approx(abs(expected.contact_shape), rel=1e-4)
        relative = expected.sensor_shape / expected.contact_shape
        assert mode.sensor_shape / mode.contact_shape == pytest.approx(relative, rel=1e-4, abs=1e-6)


def test_modes_of_damped_receptances_are_the_complex_ones():
    """With the damping of structure and contact; modes that move by less than their width too."""
    base = chain(4, 0.5, 1e7, 1)
    model = replace(base, damping=20.0 * np.eye(4) + 1e-5 * base.stiffness)
    k, c = 2e7, 60.0
    frequencies_hz = np.arange(100.0, 2600.0)
    _, transfer, approach = receptances(model, frequencies_hz)
    measured = Receptances(frequencies_hz=frequencies_hz, approach=approach, transfer=transfer)
    inverse = np.linalg.inv(model.mass)
    both = np.outer(model.contact, model.contact)
    system = np.block(
        [
            [np.zeros((4, 4)), np.eye(4)],
            [-inverse @ (model.stiffness + k * both), -inverse @ (model.damping + c * both)],
        ]
    )
    exact = sorted(
        (abs(value) / (2.0 * math.pi), -value.real / abs(value))
        for value in np.linalg.eigvals(system)
        if value.imag > 0.0
    )
    found = receptance_modes(measured, lambda _: (k, c))
    assert len(found) == len(exact)
    for mode, (frequency_hz, damping_ratio) in zip(found, exact, strict=True):
        assert mode.frequency_hz == pytest.approx(frequency_hz, rel=1e-6)
        assert mode.damping_ratio == pytest.approx(damping_ratio, rel=1e-4)
    places = [11.0, 307.3, 807.3, 2599.0]
    expected = sensor_response(model, k, c, places)
    np.testing.assert_allclose(sensor_response(measured, k, c, places)[1:], expected[1:], rtol=1e-5)
    assert sensor_response(measured, k, c, places)[0] == 0.0


@pytest.mark.parametrize("noise", [1e-3, 3e-3])
def test_noise_of_receptances_moves_their_modes_little(noise):
    base = chain(4, 0.5, 1e7, 1)
    model = replace(base, damping=2.0 * np.eye(4) + 1e-6 * base.stiffness)
    frequencies_hz = np.arange(100.0, 2600.0)
    _, transfer, approach = receptances(model, frequencies_hz)
    rng = np.random.default_rng(4)
    parts = rng.standard_normal((2, frequencies_hz.size))
    measured = Receptances(
        frequencies_hz=frequencies_hz,
        approach=approach * (1.0 + noise * (parts[0] + 1j * parts[1]) / math.sqrt(2.0)),
        transfer=transfer,
    )
    expected = coupled_modes(model, 2e7, 6.0)
    found = [
        mode
        for mode in receptance_modes(measured, lambda _: (2e7, 6.0))
        if mode.contact_share > 0.01
    ]
    assert len(found) == len(expected)
    for mode, exact in zip(found, expected, strict=True):
        assert mode.frequency_hz == pytest.approx(exact.frequency_hz, rel=5e-4)
        assert mode.contact_share == pytest.approx(exact.contact_share, rel=0.02)


def test_receptances_with_a_stiffness_over_frequency_settle_like_the_matrices():
    model = chain(4, 0.5, 1e7, 2)
    frequencies_hz = np.arange(100.0, 2600.0, 0.5)
    _, transfer, approach = receptances(model, frequencies_hz)
    measured = Receptances(frequencies_hz=frequencies_hz, approach=approach, transfer=transfer)

    def contact(frequency_hz):
        return 1e7 * (1.0 + frequency_hz / 3e3), 0.0

    expected = [mode for mode in settled_modes(model, contact) if mode.contact_share > 1e-3]
    found = [mode for mode in receptance_modes(measured, contact) if mode.contact_share > 1e-3]
    for mode, settled in zip(found, expected, strict=True):
        assert mode.frequency_hz == pytest.approx(settled.frequency_hz, rel=1e-6)
        assert mode.contact_share == pytest.approx(settled.contact_share, rel=1e-4)


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
    assert (gear.name, gear.noise.interpolate(500.0)) == ("gear case", 1e-3)
    frequencies = [mode.frequency_hz for mode in coupled_modes(gear.structure, 0.0)]
    assert frequencies == pytest.approx([100.0, 900.0], rel=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mass = [", "is not valid TOML"),
        (MATRICES.replace("sensor = [1.0, 0.0]", ""), "sensor is missing; add it"),
        (MATRICES + "masses = 1", "unknown key 'masses' in the file"),
        (MATRICES.replace("[1.0, -1.0]", '["one", 2.0]'), "not numbers"),
        (MATRICES.replace("[1.0, -1.0]", "[1.0]"), "contact must be 2 finite numbers"),
        (MATRICES + "noise = -1.0", "noise must be a positive number"),
        ("[modes]\nfrequency_hz = [1.0]", "damping_ratio is missing; add it"),
        ("[modes]\nfrequencies = [1.0]", r"unknown key 'frequencies' in \[modes\]"),
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
    with pytest.raises(BadInput, match="mass"):
        Structure.single_mass(0.0)


MODAL = {
    "frequency_hz": [100.0, 900.0],
    "damping_ratio": [0.01, 0.02],
    "contact": [0.3, 0.5],
    "sensor": [0.1, 0.2],
}


def measured_chain():
    """Two chains of two masses each, on grounds, that meet in the contact."""
    model = replace(
        structure(
            np.diag([1.0, 0.5, 0.4, 2.0]),
            1e7
            * np.array(
                [
                    [3.0, -1.0, 0.0, 0.0],
                    [-1.0, 1.0, 0.0, 0.0],
                    [0.0, 0.0, 2.0, -2.0],
                    [0.0, 0.0, -2.0, 5.0],
                ]
            ),
            [0.0, 1.0, -1.0, 0.0],
            sensor=[1.0, 0.0, 0.0, 0.0],
        ),
        damping=10.0 * np.eye(4),
    )
    frequencies_hz = np.arange(50.0, 1500.0, 1.0)
    flexible = np.array(
        [
            np.linalg.inv(
                model.stiffness
                + 2j * math.pi * f * model.damping
                - (2.0 * math.pi * f) ** 2 * model.mass
            )
            for f in frequencies_hz
        ]
    )
    return model, frequencies_hz, flexible


def test_modes_and_receptances_of_tables_and_netcdf(tmp_path):
    pandas.DataFrame(MODAL).to_csv(tmp_path / "modes.csv", index=False)
    xarray.Dataset(
        {name: (("mode",), values) for name, values in MODAL.items()}, attrs={"noise": 2e-4}
    ).to_netcdf(tmp_path / "modes.nc", engine="h5netcdf")
    model, frequencies_hz, flexible = measured_chain()
    matrices = {
        **{n: (("row", "column"), getattr(model, n)) for n in ("mass", "stiffness", "damping")},
        **{n: (("row",), getattr(model, n)) for n in ("contact", "sensor")},
    }
    xarray.Dataset(matrices, attrs={"name": "two chains"}).to_netcdf(
        tmp_path / "matrices.nc", engine="h5netcdf"
    )
    approach = model.contact @ flexible @ model.contact
    transfer = model.sensor @ flexible @ model.contact
    table = {
        "frequency_hz": frequencies_hz,
        "approach_real": approach.real,
        "approach_imag": approach.imag,
        "transfer_real": transfer.real,
        "transfer_imag": transfer.imag,
    }
    pandas.DataFrame(table).to_csv(tmp_path / "receptances.csv", index=False)
    for name in ("modes.csv", "modes.nc"):
        loaded = load_structure(tmp_path / name)
        modes = coupled_modes(loaded.structure, 0.0)
        assert [mode.frequency_hz for mode in modes] == pytest.approx([100.0, 900.0], rel=1e-9)
    assert load_structure(tmp_path / "modes.nc").noise.interpolate(10.0) == 2e-4
    whole = load_structure(tmp_path / "matrices.nc")
    assert whole.name == "two chains"
    np.testing.assert_array_equal(whole.structure.stiffness, model.stiffness)
    np.testing.assert_array_equal(whole.structure.damping, model.damping)
    measured = load_structure(tmp_path / "receptances.csv").structure
    np.testing.assert_allclose(measured.approach, approach, rtol=1e-12)
    np.testing.assert_allclose(measured.transfer, transfer, rtol=1e-12)


NODES = """
[receptances]
file = "hammer.uff"
body_1 = "11Z"
body_2 = "21Z"
sensor = "30X"
"""


def write_universal(path, pairs, *, units=None, noise=True, label="NONE"):
    """Write accelerances: response, reference, values; node 21 is measured along -Z."""
    pyuff = pytest.importorskip("pyuff")
    _, frequencies_hz, _ = measured_chain()
    sets = (
        []
        if units is None
        else [{"type": 164, "units_code": 9, **units, "temp": 1.0, "temp_offset": 0.0}]
    )
    common = {
        "type": 58,
        **{f"id{number}": "NONE" for number in range(1, 6)},
        "ver_num": 0,
        "load_case_id": 0,
        "rsp_ent_name": "NONE",
        "ref_ent_name": "NONE",
        "abscissa_spacing": 1,
        "abscissa_min": 50.0,
        "abscissa_inc": 1.0,
        "num_pts": len(frequencies_hz),
        "z_axis_value": 0,
        "abscissa_spec_data_type": 18,
        "ordinate_spec_data_type": 12,
        "ordinate_axis_units_lab": label,
        "orddenom_spec_data_type": 13,
        "z_axis_spec_data_type": 0,
        "x": frequencies_hz,
    }
    for (response, reference), values in pairs.items():
        ends = {
            f"{name}_{part}": value
            for name, end in (("rsp", response), ("ref", reference))
            for part, value in (("node", end[0]), ("dir", end[1]))
        }
        sets.append({**common, **ends, "func_type": 4, "ord_data_type": 6, "data": values})
    if noise:
        ends = {"rsp_node": 30, "rsp_dir": 1, "ref_node": 0, "ref_dir": 0}
        density = np.full(len(frequencies_hz), 4e-6)
        sets.append({**common, **ends, "func_type": 9, "ord_data_type": 4, "data": density})
    pyuff.UFF(str(path)).write_sets(sets)


@pytest.mark.parametrize("units", [None, {"length": 1e3, "force": 0.1}])
def test_receptances_of_a_universal_file(tmp_path, units):
    """Accelerances of a hammer: both bodies and the sensor, along axes of either sign."""
    model, frequencies_hz, flexible = measured_chain()
    angular = 2.0 * math.pi * frequencies_hz
    nodes = {
        "first": (1, (11, 3), 1.0),
        "second": (2, (21, -3), -1.0),
        "sensor": (0, (30, -1), -1.0),
    }
    scale = 1.0 if units is None else units["length"] / units["force"]
    pairs = {}
    for response, reference in (
        ("first", "first"),
        ("second", "second"),
        ("sensor", "first"),
        ("sensor", "second"),
    ):
        (row, end, sign), (column, other, other_sign) = nodes[response], nodes[reference]
        values = -(angular**2) * flexible[:, row, column] * sign * other_sign
        pairs[end, other] = values * scale
    write_universal(tmp_path / "hammer.uff", pairs, units=units)
    (tmp_path / "machine.toml").write_text(NODES, "utf-8")
    loaded = load_structure(tmp_path / "machine.toml")
    expected = model.contact @ flexible @ model.contact
    np.testing.assert_allclose(loaded.structure.approach, expected, rtol=1e-5)
    # the sensor points along -X: its motion along X has the other sign
    expected = model.sensor @ flexible @ model.contact
    np.testing.assert_allclose(loaded.structure.transfer, expected, rtol=1e-5)
    factor = 1.0 if units is None else 1.0 / units["length"]
    assert loaded.noise.interpolate(400.0) == pytest.approx(2e-3 * factor, rel=1e-6)
    k = 3e7
    found = receptance_modes(loaded.structure, lambda _: (k, 0.0))
    modes = [mode for mode in coupled_modes(model, k) if mode.frequency_hz < 1500.0]
    assert len(modes) == 3
    assert [mode.frequency_hz for mode in found] == pytest.approx(
        [mode.frequency_hz for mode in modes], rel=1e-4
    )
    assert [mode.contact_share for mode in found] == pytest.approx(
        [mode.contact_share for mode in modes], rel=0.01
    )


def test_an_unusable_universal_file_is_refused_in_one_sentence(tmp_path):
    (tmp_path / "machine.toml").write_text(NODES, "utf-8")
    _, frequencies_hz, _ = measured_chain()
    values = -np.ones(len(frequencies_hz)) + 0j
    write_universal(tmp_path / "hammer.uff", {((11, 3), (11, 3)): values})
    with pytest.raises(BadInput, match="no frequency response between 30X and 11Z; it has"):
        load_structure(tmp_path / "machine.toml")
    write_universal(tmp_path / "furlongs.uff", {((11, 3), (11, 3)): values}, label="furlong")
    (tmp_path / "other.toml").write_text(NODES.replace("hammer", "furlongs"), "utf-8")
    with pytest.raises(UnreadableFile, match="unit 'furlong' is not known"):
        load_structure(tmp_path / "other.toml")
    (tmp_path / "other.toml").write_text(NODES.replace("hammer", "missing"), "utf-8")
    with pytest.raises(UnreadableFile, match=r"missing\.uff does not exist"):
        load_structure(tmp_path / "other.toml")
    (tmp_path / "hammer.uff").write_bytes(b"    -1\n    58\nnonsense\n    -1\n")
    with pytest.raises(UnreadableFile, match=r"hammer\.uff"):
        load_structure(tmp_path / "machine.toml")


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"frequencies_hz": [1.0, 2.0, 2.0, 3.0]}, "four or more increasing frequencies"),
        ({"approach": [1.0, 2.0]}, "receptance approach must be 4 finite numbers"),
        ({"transfer": [1.0, 2.0, math.nan, 1.0]}, "receptance transfer must be 4 finite"),
        ({"approach": [1.0, 0.0, 1.0, 1.0]}, "receptance approach is 0 at a frequency"),
        ({"approach": np.full(4, 1.0 + 1.0j)}, "positive imaginary part"),
    ],
)
def test_unusable_receptances_are_refused_in_one_sentence(changed, message):
    usable = {
        "frequencies_hz": [1.0, 2.0, 3.0, 4.0],
        "approach": np.ones(4) - 0.1j,
        "transfer": np.ones(4),
    }
    with pytest.raises(BadInput, match=message):
        Receptances(**{**usable, **changed})


def test_other_formats_are_refused_in_one_sentence(tmp_path):
    (tmp_path / "hammer.uff").write_text("-1", "utf-8")
    with pytest.raises(BadInput, match=r"read from \.toml, \.csv or \.nc, got hammer\.uff"):
        load_structure(tmp_path / "hammer.uff")
    (tmp_path / "modes.nc").write_bytes(b"CDF")
    with pytest.raises(UnreadableFile, match="is not a netCDF file"):
        load_structure(tmp_path / "modes.nc")
    (tmp_path / "modes.csv").write_text("frequency_hz,sensor\n1,2\n", "utf-8")
    with pytest.raises(BadInput, match="damping_ratio is missing; add it"):
        load_structure(tmp_path / "modes.csv")
