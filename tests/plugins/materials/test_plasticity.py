"""Plasticity against closed forms: J2 with hardening, and the law of Johnson & Cook."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pytest

from solidsph import Simulation
from solidsph.engines.compiled.history_law import CompiledLaw
from solidsph.engines.law_forces import LawForces
from solidsph.errors import BuildError, SceneError
from solidsph.interfaces.history import History, HistoryMaterial
from solidsph.maths.tensors import cauchy_stress
from solidsph.testing import example_part
from solidsph_builtin.materials.j2_plasticity import PLASTIC_STRAIN, J2Plasticity
from solidsph_builtin.materials.johnson_cook import TEMPERATURE, JohnsonCook

E, NU, RHO = 200e9, 0.3, 7800.0
G = E / 2.0 / (1.0 + NU)
K = E / 3.0 / (1.0 - 2.0 * NU)

# Small strains: a yield strain of 1e-6, so that what is not linear shows by about as much.
TINY = {"youngs_modulus": E, "poissons_ratio": NU, "density": RHO, "yield_stress": 1e-6 * E}
LINEAR = J2Plasticity(**TINY, hardening=0.05 * E)

COPPER = {
    "youngs_modulus": 124e9,
    "poissons_ratio": 0.34,
    "density": 8960.0,
    "yield_stress": 90e6,
    "hardening_modulus": 292e6,
    "hardening_exponent": 0.31,
    "rate_coefficient": 0.025,
    "softening_exponent": 1.09,
    "melting_temperature": 1356.0,
    "specific_heat": 383.0,
}


class Point:
    """One point of a material, led along a path of deformation gradients."""

    def __init__(self, material: HistoryMaterial, dimension: int = 3) -> None:
        self.material, self.F = material, np.eye(dimension)
        self.names = list(material.initial_history(dimension))
        self.history: History = tuple(material.initial_history(dimension).values())

    def lead(self, path: Iterable[np.ndarray], step: float = 1.0) -> Point:
        for F in path:
            self.F = F
            self.history = self.material.advance(F, self.history, step, self.material.params)
        return self

    def __getitem__(self, name: str) -> float:
        return float(self.history[self.names.index(name)])

    @property
    def nominal(self) -> np.ndarray:
        return np.array(self.material.stress(self.F, self.history, self.material.params))

    @property
    def sigma(self) -> np.ndarray:
        return np.array(cauchy_stress(self.F, self.nominal))

    @property
    def equivalent(self) -> float:
        """sqrt(3/2) |dev tau|, of a point in 3D."""
        tau = np.linalg.det(self.F) * self.sigma
        s = tau - np.trace(tau) / 3.0 * np.eye(3)
        return float(np.sqrt(1.5) * np.linalg.norm(s))


def pulled(stretch: float) -> np.ndarray:
    return np.diag([stretch, 1.0, 1.0])


def sheared(gamma: float) -> np.ndarray:
    F = np.eye(3)
    F[0, 1] = gamma
    return F


def steps(make: Callable[[float], np.ndarray], start: float, end: float, count: int) -> list:
    return [make(value) for value in np.linspace(start, end, count + 1)[1:]]


# --- J2 ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_uniaxial_strain_has_an_elastic_and_a_plastic_slope(dimension: int) -> None:
    """K + 4/3 G, then K + 4/3 G H / (3 G + H); turned back, elastic over twice the yield stress."""
    H, first = LINEAR.hardening, LINEAR.yield_stress
    knee = first / (2.0 * G)
    elastic, plastic = K + 4.0 / 3.0 * G, K + 4.0 / 3.0 * G * H / (3.0 * G + H)
    point = Point(LINEAR, dimension)

    def stress(strain: float) -> float:
        F = pulled(1.0 + strain)[:dimension, :dimension]
        return float(point.lead([F]).sigma[0, 0])

    # The law is not linear: a strain of some 1e-6 shows by as much.
    close = {"rel": 2e-5}
    assert stress(0.5 * knee) == pytest.approx(0.5 * knee * elastic, **close)
    top = knee * elastic + 3.0 * knee * plastic
    assert stress(4.0 * knee) == pytest.approx(top, **close)
    strain = (2.0 * G * 4.0 * knee - first) / (3.0 * G + H)
    assert point[PLASTIC_STRAIN] == pytest.approx(strain, **close)
    # Isotropic hardening: what has flowed to q flows back at -q, after 2 q / (2 G) of strain.
    q = first + H * strain
    back = q / G
    assert stress(4.0 * knee - 0.9 * back) == pytest.approx(
        top - 0.9 * back * elastic, abs=2e-5 * top
    )
    assert point[PLASTIC_STRAIN] == pytest.approx(strain, **close)
    turned = top - back * elastic - 0.5 * back * plastic
    assert stress(4.0 * knee - 1.5 * back) == pytest.approx(turned, abs=2e-5 * top)
    assert point[PLASTIC_STRAIN] > 1.1 * strain
    # Loaded anew, elastic up to where it was.
    now = point[PLASTIC_STRAIN]
    stress(4.0 * knee - 0.7 * back)
    assert point[PLASTIC_STRAIN] == now


def test_pure_shear_yields_at_the_stress_over_root_three() -> None:
    perfect = J2Plasticity(**TINY)
    limit = perfect.yield_stress / np.sqrt(3.0)
    gamma = limit / G
    point = Point(perfect).lead([sheared(0.99 * gamma)])
    assert point[PLASTIC_STRAIN] == 0.0
    assert point.sigma[0, 1] == pytest.approx(0.99 * limit, rel=1e-5)
    point.lead([sheared(1.01 * gamma)])
    assert point[PLASTIC_STRAIN] > 0.0
    point.lead(steps(sheared, 1.01 * gamma, 20.0 * gamma, 50))
    assert point.sigma[0, 1] == pytest.approx(limit, rel=1e-5)
    # Of the shear beyond the limit the equivalent strain is 1/sqrt(3).
    assert point[PLASTIC_STRAIN] == pytest.approx(19.0 * gamma / np.sqrt(3.0), rel=1e-5)


def test_the_flow_stress_follows_the_law_of_saturation() -> None:
    """Necking steel of the literature, to 60 % of plastic strain, in steps up to 3 per cent."""
    first, last, exponent, slope = 0.45e9, 0.715e9, 16.93, 0.129e9
    material = J2Plasticity(
        youngs_modulus=206.9e9,
        poissons_ratio=0.29,
        density=7800.0,
        yield_stress=first,
        hardening=slope,
        saturation_stress=last,
        saturation_exponent=exponent,
    )
    for count in (1000, 30):
        point = Point(material)
        for F in steps(pulled, 1.0, 2.5, count):
            e = point.lead([F])[PLASTIC_STRAIN]
            if e == 0.0:  # the first of a thousand steps is elastic
                continue
            flow = first + (last - first) * (1.0 - np.exp(-exponent * e)) + slope * e
            # The scalar equation is solved to rounding, of stresses of the order of mu.
            assert abs(point.equivalent - flow) < 1e-12 * G
        assert point[PLASTIC_STRAIN] > 0.5


def test_a_bar_carries_most_at_considere_s_strain() -> None:
    """Pulled with free sides: P = flow(e) / s with ln s = e + flow(e) / E, whose maximum is known.

    The steel of the necking bar, Simo & Hughes (1998), section 9.3: it necks where the load is
    largest, Considere (1885), which is where the flow stress is its own slope but for elasticity.
    """
    from scipy.optimize import brentq, minimize_scalar

    bulk, shear = 164.21e9, 80.1938e9
    E = 9.0 * bulk * shear / (3.0 * bulk + shear)
    material = J2Plasticity(
        youngs_modulus=E,
        poissons_ratio=E / 2.0 / shear - 1.0,
        density=7800.0,
        yield_stress=0.45e9,
        hardening=0.129e9,
        saturation_stress=0.715e9,
        saturation_exponent=16.93,
    )

    def flow(e: float) -> float:
        return 0.45e9 + 0.265e9 * (1.0 - np.exp(-16.93 * e)) + 0.129e9 * e

    def load(e: float) -> float:
        return flow(e) / np.exp(e + flow(e) / E)

    known = minimize_scalar(lambda e: -load(e), bounds=(0.01, 0.5), method="bounded")
    point, across = Point(material), 1.0
    loads, strains = [], []
    for s in np.linspace(1.0, 1.3, 151)[1:]:

        def side(r: float, s: float = s) -> float:
            F = np.diag([s, r, r])
            after = material.advance(F, point.history, 1.0, material.params)
            return float(np.array(material.stress(F, after, material.params))[1, 1])

        across = brentq(side, 0.99 * across, 1.0001 * across, xtol=1e-15)
        point.lead([np.diag([s, across, across])])
        loads.append(point.nominal[0, 0])
        strains.append(point[PLASTIC_STRAIN])
    # The elastic strain is 0.3 %: its square is what the closed form leaves out.
    assert max(loads) == pytest.approx(-known.fun, rel=2e-5)
    assert strains[int(np.argmax(loads))] == pytest.approx(known.x, abs=0.002)
    assert np.allclose(loads[20:], [load(e) for e in strains[20:]], rtol=5e-5)


@pytest.mark.validation  # tests/engines compile both
@pytest.mark.parametrize("name", ["j2-plasticity", "johnson-cook"])
def test_the_laws_compile(name: str) -> None:
    """They are not left to arrays of all particles without a word."""
    simulation = (
        Simulation.builder()
        .body("bar", shape={"type": "interval", "length": 1.0}, spacing=0.1)
        .kernel("cubic-spline", cover=2.6)
        .material(example_part("materials", name))
        .duration(1e-3)
        .engine("compiled")
        .build()
    )
    internal = simulation.dynamics.internal
    assert isinstance(internal, LawForces)
    assert [type(law) for law in internal.laws] == [CompiledLaw]
    simulation.start()  # the loop, too: what it returns has the types of what it is given


@pytest.mark.parametrize("stretch", [0.4, 2.5])
def test_large_uniaxial_strain_follows_the_closed_form(stretch: float) -> None:
    """Coaxial flow: mu (B^2 - 1/B) = yield + H e with e = ln(s^(2/3) / B), B the elastic stretch.

    The isochoric part of the stretch s is s^(2/3); what of it is not elastic is plastic, and its
    logarithm is the strain that the equivalent stress does its work on.
    """
    from scipy.optimize import brentq

    material = J2Plasticity(
        youngs_modulus=1e6, poissons_ratio=0.3, density=1e3, yield_stress=5e4, hardening=3e4
    )
    kappa, mu = material.params[:2]
    total, sign = stretch ** (2.0 / 3.0), np.sign(stretch - 1.0)

    def miss(B: float) -> float:
        e = sign * np.log(total / B)
        return mu * (B**2 - 1.0 / B) - sign * (5e4 + 3e4 * e)

    B = brentq(miss, min(1.0, total), max(1.0, total), xtol=1e-15)
    tau = kappa / 2.0 * (stretch**2 - 1.0) + 2.0 / 3.0 * mu * (B**2 - 1.0 / B)
    strains, stresses = [], []
    for count in (200, 400):
        point = Point(material).lead(steps(pulled, 1.0, stretch, count))
        strains.append(point[PLASTIC_STRAIN] / (sign * np.log(total / B)) - 1.0)
        stresses.append(point.nominal[0, 0] / (tau / stretch) - 1.0)
    # Of the second order: with steps of a per cent and less, and a quarter with half the step.
    assert abs(strains[0]) < 2e-5
    assert strains[0] / strains[1] == pytest.approx(4.0, rel=0.1)
    assert abs(stresses[1]) < 1e-6


def test_the_plastic_metric_keeps_its_volume() -> None:
    """Through 2000 steps of random deformation, to rounding."""
    material = example_part("materials", "j2-plasticity")
    rng = np.random.default_rng(5)
    point, F = Point(material), np.eye(3)
    for _ in range(2000):
        change = rng.normal(scale=0.01, size=(3, 3))
        F = F @ (np.eye(3) + change)
        F = F / np.linalg.det(F) ** (1.0 / 3.0)
        point.lead([F])
    xx, yy, zz, yz, xz, xy = point.history[:6]
    metric = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    assert point[PLASTIC_STRAIN] > 1.0
    # The eigenvalues are some powers of ten apart by then, and rounding grows with their ratio.
    assert np.linalg.det(metric) == pytest.approx(1.0, abs=1e-15 * np.linalg.cond(metric))


def test_a_rigid_turn_after_flow_turns_the_stress_and_nothing_more() -> None:
    material = example_part("materials", "j2-plasticity")
    point = Point(material).lead(steps(pulled, 1.0, 1.2, 40))
    before, strain, F = point.sigma, point[PLASTIC_STRAIN], point.F
    for angle in np.linspace(0.0, np.pi / 2.0, 31)[1:]:
        Q = np.array(
            [[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0, 0, 1.0]]
        )
        point.lead([Q @ F])
    # Rounding of thirty small returns to where it already is.
    assert point[PLASTIC_STRAIN] == pytest.approx(strain, rel=1e-13)
    assert np.allclose(point.sigma, Q @ before @ Q.T, atol=1e-12 * material.lame_parameters[1])


def test_a_bar_in_the_time_loop_has_the_plastic_slope() -> None:
    """Led slowly by its particles to four times the yield strain and back to no strain."""
    material = {"type": "j2-plasticity", **TINY, "hardening": 0.05 * E}
    H, first = 0.05 * E, 1e-6 * E
    knee, T = first / (2.0 * G), 2e-3
    simulation = (
        Simulation.builder()
        .body("bar", shape={"type": "interval", "length": 1.0}, spacing=0.02)
        .kernel("cubic-spline", cover=2.6)
        .material(material)
        .boundary(
            "prescribed-motion",
            where="all",
            displacement={"x": f"{4.0 * knee!r}*X*(1 - abs(2*t/{T!r} - 1))"},
        )
        .duration(T)
        .outputs(2)
        .build()
    )
    state, loop, found = simulation.start(), simulation.time_loop(), []
    for stop in simulation.output_steps():
        state = loop.advance(state, stop)
        found.append(float(simulation.dynamics.observe(state).stresses[25, 0, 0]))
    q = first + H * (8.0 * G * knee - first) / (3.0 * G + H)
    # At the turn q pulls; back at no strain it pushes, having flowed anew.
    top = K * 4.0 * knee + 2.0 / 3.0 * q
    e = (2.0 * G * 4.0 * knee - 2.0 * q) / (3.0 * G + H)
    bottom = -2.0 / 3.0 * (q + H * e)
    # The loop turns within a step, one of some thousand.
    assert found[0] == pytest.approx(top, rel=5e-3)
    assert found[1] == pytest.approx(bottom, rel=5e-2)


# --- Johnson & Cook ------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [1e-2, 1.0, 1e3, 1e6])
@pytest.mark.parametrize("temperature", [293.0, 700.0, 1400.0])
def test_the_flow_stress_at_a_rate_and_a_temperature(rate: float, temperature: float) -> None:
    material = JohnsonCook(**COPPER, temperature=temperature, heat_share=0.0)
    count = 400
    step = 0.3 / count / rate
    point = Point(material).lead(steps(pulled, 1.0, 1.3, count - 1), step)
    before = point[PLASTIC_STRAIN]
    point.lead([pulled(1.3 * (1.0 + 0.3 / count))], step)
    e = point[PLASTIC_STRAIN]
    measured = (e - before) / step
    warm = min((temperature - 293.0) / (1356.0 - 293.0), 1.0)
    expected = (
        (90e6 + 292e6 * e**0.31) * (1.0 + 0.025 * np.log(max(measured, 1.0))) * (1.0 - warm**1.09)
    )
    assert 0.1 < e < 0.3
    assert 0.4 * rate < measured < rate
    # Solved to rounding of stresses of the order of mu; the difference of two strains loses more.
    assert point.equivalent == pytest.approx(expected, abs=1e-11 * material.lame_parameters[1])


def test_below_the_reference_rate_it_does_not_depend_on_the_rate() -> None:
    material = JohnsonCook(**COPPER, heat_share=0.0)
    one, other = (
        Point(material).lead(steps(pulled, 1.0, 1.1, 50), step).equivalent for step in (1.0, 100.0)
    )
    assert one == other


def test_plastic_work_heats_by_its_share() -> None:
    """The rise against the work of the stress, less what is stored: neither is the law's own."""
    material = JohnsonCook(**COPPER)
    point, work = Point(material), 0.0
    before, P = point.F, point.nominal
    for F in steps(sheared, 0.0, 2.0, 1500):
        point.lead([F], 1e-7)
        work += 0.5 * float(np.sum((P + point.nominal) * (F - before)))
        before, P = F, point.nominal
    plastic = work - float(material.stored(point.F, point.history, material.params))
    rise = point[TEMPERATURE] - 293.0
    # A straight line for the stress over a step; it yields within the first of 1500.
    assert rise == pytest.approx(0.9 * plastic / (8960.0 * 383.0), rel=1e-4)
    assert rise > 100.0  # or else nothing is tested
    # Twice the heat from twice the share, but for what softens.
    cold = Point(JohnsonCook(**COPPER, heat_share=0.0)).lead(steps(sheared, 0.0, 2.0, 1500), 1e-7)
    assert cold.equivalent > 1.05 * point.equivalent
    assert cold[TEMPERATURE] == 293.0


def test_molten_metal_flows_without_stress() -> None:
    material = JohnsonCook(**COPPER, temperature=1500.0)
    point = Point(material).lead(steps(sheared, 0.0, 0.5, 20), 1e-6)
    assert point.equivalent < 1e-9 * material.lame_parameters[1]


# --- What a scene may say ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: J2Plasticity(**{**TINY, "yield_stress": 0.0}), "yield_stress must be positive"),
        (lambda: J2Plasticity(**TINY, hardening=-1.0), "must not be negative, got -1"),
        (lambda: J2Plasticity(**TINY, saturation_stress=1.0), "at least the yield stress"),
        (lambda: JohnsonCook(**{**COPPER, "melting_temperature": 20.0}), "above the reference"),
        (lambda: JohnsonCook(**COPPER, heat_share=90.0), "between 0 and 1, got 90"),
        (lambda: JohnsonCook(**{**COPPER, "rate_coefficient": -1.0}), "must not be negative"),
    ],
)
def test_wrong_constants_are_refused_in_one_line(make: Callable[[], object], said: str) -> None:
    with pytest.raises((SceneError, BuildError), match=said):
        make()
