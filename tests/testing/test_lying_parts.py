"""Lies that a part may tell its kit, each of which one check is there to find."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import attrs
import numpy as np
import pytest

from solidsph import Particles, Shape
from solidsph.conformance.check import Broken
from solidsph.conformance.derived import overridden
from solidsph.interfaces.compilable_terms import PointwiseLoad
from solidsph.interfaces.shape import Surface
from solidsph.interfaces.terms import FieldTerm, Observation
from solidsph.maths.arrays import Array, Tensor, Vector
from solidsph.testing import checks
from solidsph.testing.terms import field_verdict
from solidsph_builtin.discretisations.lattice import Lattice
from solidsph_builtin.gradients.corrected import Corrected
from solidsph_builtin.integrators.velocity_verlet import VelocityVerlet
from solidsph_builtin.kernels.cubic_spline import CubicSpline
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_builtin.materials.viscoelastic import Viscoelastic, advance_of
from solidsph_builtin.shapes.disc import Disc
from tests.helpers.faulty import Odd
from tests.helpers.scenes import SOFT, box


class KnotOutside(CubicSpline):
    knots: ClassVar[tuple[float, ...]] = (0.5, 1.5)


class KnotForgotten(CubicSpline):
    """Its third derivative jumps where no quadrature looks."""

    knots: ClassVar[tuple[float, ...]] = ()


class StressInPlace(NeoHookean):
    """Scales what it was given, and back: the rounding of it stays."""

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        if isinstance(F, np.ndarray):
            F *= 1.1
        return NeoHookean.first_piola(F, params)


class ShowsNothing(Viscoelastic):
    shown: ClassVar[Sequence[str]] = ("temperature [K]",)


class HistoryInPlace(Viscoelastic):
    @staticmethod
    def advance(F: Tensor, history: Any, step: float, params: tuple[float, ...]) -> Any:
        found = advance_of(len(MEMORY["prony"]))(F, history, step, params)
        if isinstance(history[0], np.ndarray) and history[0].flags.writeable:
            history[0][...] += 1e-3
        return found


class OtherSteps(VelocityVerlet):
    """Steps by its method are half of those by its formulas."""

    def advance(self, state: Any, dynamics: Any, step_size: float) -> Any:
        return super().advance(state, dynamics, 0.5 * step_size)


@attrs.frozen
class VolumesInPlace:
    """A gradient that takes the volumes for its own."""

    exact_degree: int = 1

    def weights(self, pairs: Any, kernel_gradients: Array, volumes: Array) -> Array:
        found: Array = Corrected().weights(pairs, kernel_gradients, volumes)
        volumes *= 2.0
        return found


@attrs.frozen
class HalfTheSurface(Disc):
    """Half of the areas, and a volume that it says nobody knows."""

    def volume(self) -> None:
        return None

    def surface(self, spacing: float) -> Surface:
        made = super().surface(spacing)
        return attrs.evolve(made, area_vectors=0.5 * made.area_vectors)


@attrs.frozen
class FarIsFarther(Disc):
    """Right beside its boundary, twice as much away from it."""

    def signed_distance(self, points: Array) -> Array:
        d = super().signed_distance(points)
        return np.where(np.abs(d) > 0.1 * self.radius, 2.0 * d, d)


@attrs.frozen
class Leaning(Lattice):
    """Volumes that grow to the right, and add up."""

    def particles(self, shape: Shape, spacing: float) -> Particles:
        made = super().particles(shape, spacing)
        x = made.positions[:, 0]
        weights = made.volumes * (1.0 + (x - x.mean()) / np.ptp(x))
        return attrs.evolve(made, volumes=weights * made.volumes.sum() / weights.sum())


@attrs.frozen
class Doubled(Lattice):
    """Sums over neighbours count everybody twice."""

    def particles(self, shape: Shape, spacing: float) -> Particles:
        made = super().particles(shape, spacing)
        return attrs.evolve(made, cells=2.0 * made.cells)


@attrs.frozen
class SaysFiner(Lattice):
    """A spacing of a tenth, by which the step is chosen."""

    def particles(self, shape: Shape, spacing: float) -> Particles:
        made = super().particles(shape, spacing)
        return attrs.evolve(made, spacings=0.1 * made.spacings)


MEMORY = {"prony": [(0.5, 1e-2)], **SOFT}

LIES: Mapping[str, tuple[str, Any, Any, str]] = {
    "a knot outside": ("kernels", KnotOutside(), CubicSpline(), "knots"),
    "a knot forgotten": ("kernels", KnotForgotten(), CubicSpline(), "knots"),
    "F changed": ("materials", StressInPlace(**SOFT), NeoHookean(**SOFT), "leaves_its_input"),
    "a field of nothing": (
        "materials",
        ShowsNothing(**MEMORY),
        Viscoelastic(**MEMORY),
        "shown_variables",
    ),
    "a history changed": (
        "materials",
        HistoryInPlace(**MEMORY),
        Viscoelastic(**MEMORY),
        "leaves_its_history",
    ),
    "steps of two kinds": ("integrators", OtherSteps(), VelocityVerlet(), "derived"),
    "volumes changed": ("gradients", VolumesInPlace(), Corrected(), "leaves_its_input"),
    "half the areas": ("shapes", HalfTheSurface(0.5), Disc(0.5), "volume"),
    "distances too large": ("shapes", FarIsFarther(0.5), Disc(0.5), "distance_elsewhere"),
    "volumes elsewhere": ("discretisations", Leaning(), Lattice(), "middle"),
    "sums of two": ("discretisations", Doubled(), Lattice(), "sums"),
    "a spacing too small": ("discretisations", SaysFiner(), Lattice(), "arrays"),
    "a negative volume": ("discretisations", Odd("volumes", -1e-3), Lattice(), "arrays"),
}


@pytest.mark.parametrize("lie", LIES)
def test_each_lie_is_found_by_its_check(lie: str) -> None:
    kind, part, honest, name = LIES[lie]
    (check,) = [one for one in checks(kind) if one.__name__ == name]  # type: ignore[attr-defined]
    assert check(honest).passed, check(honest)
    assert not check(part).passed, check(part)
    assert "Error" not in check(part).measured


@attrs.frozen(eq=False)
class Shows(FieldTerm):
    name: str
    values: Any
    label: str = "shows"

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}

    def fields(self, observation: Observation) -> Mapping[str, Any]:
        name = self.name.replace("TIME", f"{observation.state.time:.3f}")
        return {name: self.values}


@pytest.mark.parametrize(
    ("name", "values", "told"),
    [
        ("damage [-]", np.zeros(25), None),
        ("damage [-]", np.zeros((25, 2)), None),
        ("damage", np.zeros(25), "field 'damage'"),
        ("damage [-]", np.zeros(24), r"\(24,\) of 25"),
        ("damage [-]", np.zeros(()), r"\(\) of 25"),
        ("damage [-]", np.full(25, np.nan), "not finite"),
        ("damage at TIME [-]", np.zeros(25), "then others"),
    ],
)
def test_fields_are_such_as_a_record_can_hold(name: str, values: Any, told: str | None) -> None:
    simulation = box(2, 5).duration(1e-3).outputs(1).build()
    if told is None:
        assert field_verdict(simulation, [Shows(name, values)]).passed
        return
    with pytest.raises(Broken, match=told):
        field_verdict(simulation, [Shows(name, values)])


@attrs.frozen(eq=False)
class Formula(PointwiseLoad):
    label: str = "formula"
    particles: Any = ()
    values: Any = ()

    @staticmethod
    def force(position: Vector, velocity: Vector, values: Vector) -> Vector:
        return velocity

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}


class OtherForces(Formula):
    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return -velocities


class Remembers(Formula):
    def advance(self, *arguments: Any) -> Any:
        return super().advance(*arguments)


def test_what_a_kind_derives_is_not_overridden() -> None:
    assert overridden(Formula()) == ""
    assert overridden(OtherForces()) == "OtherForces is a PointwiseLoad, and overrides forces"
    assert overridden(Remembers()) == "Remembers is a PointwiseLoad, and overrides advance"
