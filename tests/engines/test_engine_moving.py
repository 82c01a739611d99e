"""The compiled path of the updated form: the same pairs, forces and runs as the matrix engine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from solidsph import Simulation
from solidsph.engines.compiled.engine import CompiledEngine, CompiledForces
from solidsph.engines.compiled.moving.body import MovingBody
from solidsph.engines.compiled.moving.neighbourhoods import Neighbourhoods, fill
from solidsph.engines.compiled.moving.pointwise_sums import PointwiseSums
from solidsph.engines.compiled.moving.search import NeighbourSearch
from solidsph.engines.compiled.moving.weighted_sums import WeightedSums
from solidsph.engines.matrix import MatrixEngine
from solidsph.errors import BuildError
from solidsph.interfaces.body import Body
from solidsph.interfaces.divergence import Divergence, PointwiseDivergence
from solidsph.interfaces.gradient import PointwiseGradient
from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.maths.arrays import Array, Scalar
from solidsph.model.neighbours import Pairs, neighbour_pairs
from solidsph.registry import registry
from solidsph.testing import example_part
from tests.engines.test_engines import (
    ARRANGEMENTS,
    JITTERED,
    LATTICE,
    arrangement_name,
    assert_same,
    block,
    compiled,
    in_every_dimension,
    mostly_in_2d,
    parts_of,
    prepared,
    random_displacements,
)
from tests.helpers.examples import examples
from tests.helpers.pairwise import pairwise
from tests.helpers.scenes import REFERENCE_ONLY, SOFT

UPDATED = "updated-lagrangian"
LENGTHS = {1: [2.0], 2: [0.9, 1.2], 3: [0.5, 0.5, 0.8]}  # a quadratic fit needs some thickness


def updated(d: int, arrangement: Mapping[str, Any] = JITTERED, **operators: object) -> Simulation:
    formulation = {"type": UPDATED, **operators}
    return block(d, dict(arrangement), lengths=LENGTHS[d], formulation=formulation).build()


def moving(forces: object) -> MovingBody:
    assert isinstance(forces, CompiledForces)
    (part,) = forces.parts
    assert isinstance(part, MovingBody)
    return part


def found(search: NeighbourSearch, positions: Array) -> Pairs:
    near = search.near(positions)
    rows = Neighbourhoods.with_room(len(positions), near.pair_count)
    fill(near, near.distances, rows)
    return rows.pairs(positions)


def assert_same_pairs(ours: Pairs, theirs: Pairs) -> None:
    """In the same order, and to the last bit."""
    for one, other in zip(attrs.astuple(ours), attrs.astuple(theirs), strict=True):
        assert np.array_equal(one, other)


# Coordinates on a grid of powers of two: particles coincide, stand on lines, and at exactly the
# radius from each other.
on_a_grid = st.integers(-6, 6).map(lambda k: 0.25 * k)


@examples(60)
@given(data=st.data(), d=st.sampled_from([1, 2, 3]), n=st.integers(1, 30))
def test_pairs_are_those_of_the_tree(data: st.DataObject, d: int, n: int) -> None:
    coordinates = data.draw(st.sampled_from([on_a_grid, st.floats(-3.0, 3.0)]))
    X = data.draw(arrays.arrays(np.float64, (n, d), elements=coordinates))
    stretch = data.draw(st.sampled_from([1.0, 1e-9, 64.0, 1e6, 1e100]))
    X[:, 0] *= stretch  # from a line to a body much longer than it is thick
    radius = data.draw(st.sampled_from([0.25, 0.75, 1.0]))
    assert_same_pairs(found(NeighbourSearch(radius), X), neighbour_pairs(X, radius))


@pytest.mark.parametrize("spread", [1.0, 0.02, 300.0], ids=["cloud", "cluster", "dust"])
@in_every_dimension
def test_pairs_of_many_particles(d: int, spread: float) -> None:
    """By cells, all in a few of them, and more cells than are worth having."""
    X = spread * np.random.default_rng(d).normal(size=(400, d)) - 7.0
    pairs = neighbour_pairs(X, 0.3)
    assert_same_pairs(found(NeighbourSearch(0.3), X), pairs)


def test_a_list_with_a_margin_has_no_influence() -> None:
    rng = np.random.default_rng(3)
    X, radius, steps = rng.uniform(size=(300, 2)), 0.15, 80
    search, lists = NeighbourSearch(radius), set()
    for _ in range(steps):
        X = X + 0.02 * radius * rng.uniform(-1.0, 1.0, size=X.shape)
        assert_same_pairs(found(search, X), neighbour_pairs(X, radius))
        lists.add(id(search.list_origin))
        assert np.abs(X - search.list_origin).max() <= 0.05 * radius
    # It did serve many steps: the fastest of a few hundred walkers needs some ten for half of it.
    assert 2 < len(lists) < steps / 3


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_a_particle_that_is_nowhere_has_no_neighbours(value: float) -> None:
    X = np.random.default_rng(0).uniform(size=(50, 2))
    rest = np.delete(X, 7, axis=0)
    X[7, 1] = value
    pairs, expected = found(NeighbourSearch(0.3), X), neighbour_pairs(rest, 0.3)
    real = np.delete(np.arange(50), 7)
    others = pairs.rows != 7
    assert np.array_equal(pairs.columns[~others], [7])
    assert np.array_equal(pairs.rows[others], real[expected.rows])
    assert np.array_equal(pairs.columns[others], real[expected.columns])


GRADIENTS = [name for name in registry.names("gradients") if name not in REFERENCE_ONLY]


@pytest.mark.parametrize(
    ("arrangement", "divergence", "gradient"),
    pairwise(ARRANGEMENTS, registry.names("divergences"), GRADIENTS),
    ids=arrangement_name,
)
@mostly_in_2d
def test_agrees_for_every_operator(
    d: int, arrangement: dict[str, Any], divergence: str, gradient: str
) -> None:
    simulation = updated(d, arrangement, gradient=gradient, divergence=divergence)
    reference, forces = prepared(MatrixEngine(), simulation), compiled(simulation)
    assert forces.pair_count == reference.pair_count
    pointwise = isinstance(moving(forces).body.formulation.gradient, PointwiseGradient)
    assert isinstance(moving(forces).sums, PointwiseSums if pointwise else WeightedSums)
    for seed in range(3):
        assert_same(forces, reference, random_displacements(simulation, seed))


@pytest.mark.parametrize(
    "material",
    [
        # The same function as of the fixed engine, which is put to all of them.
        pytest.param(name, marks=() if name == "j2-plasticity" else pytest.mark.validation)
        for name in registry.names("materials")
    ],
)
@mostly_in_2d
def test_agrees_for_every_material(d: int, material: str) -> None:
    part = example_part("materials", material)
    simulation = block(d, JITTERED, lengths=LENGTHS[d], formulation=UPDATED, material=part).build()
    reference = prepared(MatrixEngine(), simulation)
    assert_same(compiled(simulation), reference, random_displacements(simulation))


@attrs.frozen
class Bare(Kernel):
    """A profile without its slope, which the core finds by a complex step."""

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        return (1.0 - q) ** 4 * (1.0 + 4.0 * q)


@attrs.frozen
class Listed(Kernel):
    """A profile that no compiler understands: it makes up the name of what it calls."""

    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        power = getattr(np, "_".join(["power"]))
        return power(1.0 - q, 4) * (1.0 + 4.0 * q)


@pytest.mark.parametrize(
    "kernel", [*registry.names("kernels"), Bare(), Listed()], ids=lambda one: str(one)
)
def test_agrees_for_every_kernel(kernel: str | Kernel) -> None:
    simulation = updated(2)
    (body,) = simulation.model.bodies
    part = example_part("kernels", kernel) if isinstance(kernel, str) else kernel
    # Exactly two cells of the lattice: pairs at the edge of the support, to rounding.
    own = attrs.evolve(body, smoothing=smoothing_kernel(part, 2, 0.2))
    reference = MatrixEngine().prepare([own], [])
    u = random_displacements(simulation)
    for displacements in (u, 0.0 * u):
        assert_same(CompiledEngine().prepare([own], []), reference, displacements)


def test_agrees_where_particles_coincide() -> None:
    # A law without a logarithm: between two particles at one place the body has turned over.
    material = example_part("materials", "linear-elastic")
    simulation = block(2, lengths=[0.8, 0.7], formulation=UPDATED, material=material).build()
    X, u = simulation.particles.positions, random_displacements(simulation)
    u[10] = X[11] + u[11] - X[10]
    u[10] -= X[10] + u[10] - (X[11] + u[11])  # to the last bit
    assert np.array_equal(X[10] + u[10], X[11] + u[11])
    assert_same(compiled(simulation), prepared(MatrixEngine(), simulation), u)


@attrs.frozen
class ByArrays(Divergence):
    """Something of the paper's divergence and of the variational one, of all pairs at once."""

    conserves_momentum: ClassVar[bool] = False
    adjoint: ClassVar[bool] = False
    uses_ghost_stress: ClassVar[bool] = True

    def weights(self, pairs: Pairs, gradient_weights: Array, volumes: Array) -> Array:
        back = gradient_weights[pairs.reversed_order()]
        own = volumes[pairs.rows, None] * gradient_weights
        return 0.3 * own - 0.7 * volumes[pairs.columns, None] * back


@attrs.frozen
class ByFormula(PointwiseDivergence):
    """The same by formulas of one pair."""

    conserves_momentum: ClassVar[bool] = False
    adjoint: ClassVar[bool] = False
    uses_ghost_stress: ClassVar[bool] = True

    @staticmethod
    def pair_weight(there: Scalar, back: Scalar, volume: Scalar, other: Scalar) -> Scalar:
        return 0.3 * volume * there - 0.7 * other * back

    @staticmethod
    def own_weight(own: Scalar, volume: Scalar) -> Scalar:
        return -0.4 * volume * own


@pytest.mark.parametrize("gradient", ["standard", "corrected"])
def test_agrees_for_any_divergence_with_a_formula_or_without(gradient: str) -> None:
    by_arrays = updated(2, gradient=gradient, divergence=ByArrays())
    by_formula = updated(2, gradient=gradient, divergence=ByFormula())
    reference = prepared(MatrixEngine(), by_arrays)
    for simulation, sums in (by_arrays, WeightedSums), (by_formula, PointwiseSums):
        forces = compiled(simulation)
        assert isinstance(moving(forces).sums, sums)
        assert_same(forces, reference, random_displacements(simulation))
        assert_same(
            prepared(MatrixEngine(), simulation), reference, random_displacements(simulation)
        )


OPERATORS = ["standard", "corrected", "quadratic"]


@pytest.mark.parametrize(
    ("kind", "divergence", "gradient"),
    [
        *pairwise(("ghosts", "symmetry"), registry.names("divergences"), OPERATORS),
        # The builder refuses it with any other divergence.
        *(("approximate-neumann", "plain", gradient) for gradient in OPERATORS),
    ],
)
def test_agrees_with_ghosts_and_imposed_stress(gradient: str, kind: str, divergence: str) -> None:
    builder = block(
        2,
        # Particles on the boundary are half inside: their volumes and cells differ.
        {**LATTICE, "on_boundary": True, "ghosts": 3, "ghost_faces": ["left"]},
        lengths=[0.8, 1.4],
        formulation={"type": UPDATED, "divergence": divergence, "gradient": gradient},
    )
    if kind == "symmetry":
        builder = builder.boundary("symmetry", axis="x", at=0.0)
    else:
        builder = builder.boundary("ghost-extension")
    if kind == "approximate-neumann":
        builder = builder.boundary("approximate-neumann", where="left", traction={"x": 1e4})
    simulation = builder.build()
    bodies, stresses = parts_of(simulation)
    for conditions in ([], stresses):
        reference = MatrixEngine().prepare(bodies, conditions)
        forces = CompiledEngine().prepare(bodies, conditions)
        assert isinstance(forces, CompiledForces)
        assert_same(forces, reference, random_displacements(simulation))


def test_agrees_for_bodies_in_both_forms() -> None:
    simulation = (
        block(2, JITTERED, lengths=[0.8, 0.7], formulation=UPDATED)
        .body(
            "other",
            shape={"type": "box", "lengths": [0.5, 1.0], "origin": [2.0, 0.0]},
            spacing=0.1,
            material={"type": "saint-venant-kirchhoff", **SOFT, "youngs_modulus": 3e6},
        )
        .build()
    )
    one, other = simulation.model.bodies
    total = attrs.evolve(other, formulation=example_part("formulations", "total-lagrangian"))
    reference = MatrixEngine().prepare([one, total], [])
    forces = CompiledEngine().prepare([one, total], [])
    assert isinstance(forces, CompiledForces)
    assert_same(forces, reference, random_displacements(simulation))


def test_what_came_before_has_no_influence() -> None:
    """The same bits from an engine that has followed a long motion and from a new one."""
    simulation = updated(2)
    forces = compiled(simulation)
    rng = np.random.default_rng(5)
    u = np.zeros_like(simulation.particles.positions)
    for _ in range(40):
        u += 0.002 * rng.normal(size=u.shape)
        last = forces.forces(0.0, u)
    assert np.array_equal(last, compiled(simulation).forces(0.0, u))


def test_a_particle_that_flew_away_is_reported_as_the_matrix_engine_does() -> None:
    simulation = updated(2, gradient="corrected")
    u = np.zeros_like(simulation.particles.positions)
    u[17, 1] = 1e9
    said = []
    for engine in (MatrixEngine(), CompiledEngine()):
        with pytest.raises(BuildError, match="the 0 neighbours of particle 17 do not span") as one:
            prepared(engine, simulation).forces(0.0, u)
        said.append(str(one.value))
    assert said[0] == said[1]


@pytest.mark.parametrize("divergence", registry.names("divergences"))
def test_the_force_on_a_particle_that_is_nowhere_is_not_a_number(divergence: str) -> None:
    simulation = updated(2, gradient="difference", divergence=divergence)
    u = np.zeros_like(simulation.particles.positions)
    u[17, 1] = np.nan
    force = compiled(simulation).forces(0.0, u)
    assert np.isnan(force[17]).all()
    assert np.isfinite(np.delete(force, 17, axis=0)).all()


@pytest.mark.parametrize("d", [1, 2])
def test_a_run_is_the_same_by_either_engine(d: int) -> None:
    builder = (
        block(d, lengths=LENGTHS[d], formulation=UPDATED)
        .boundary("clamp", where="left")
        .initial(velocity={"x": "3*X"})
        .energy_tolerance("off")  # the updated form has no energy of its own
        .duration(0.12)
    )
    ends = []
    for name in ("matrix", "compiled"):
        simulation = builder.engine(name).build()
        assert simulation.steps > 60
        ends.append(simulation.run().state.positions)
    start = simulation.particles.positions
    # More than a list of neighbours allows, 0.05 of the support radius.
    assert np.abs(ends[0] - start).max() > 0.02
    # Rounding of a hundred steps, each 1e-16 of the body's size; nothing grows so soon.
    assert np.abs(ends[1] - ends[0]).max() < 1e-12


def test_memory_is_bounded() -> None:
    simulation = updated(3)
    forces = compiled(simulation)
    forces.forces(0.0, random_displacements(simulation))
    # Twelve bytes an ordered pair and twenty-eight a near one, with a third more of room.
    assert forces.bytes < 60 * forces.pair_count


def test_bodies_keep_their_own_arrays() -> None:
    bodies: list[Body] = [*updated(2).model.bodies]
    one, other = (CompiledEngine().prepare(bodies, []) for _ in range(2))
    u = random_displacements(updated(2))
    first = one.forces(0.0, u)
    other.forces(0.0, 2.0 * u)
    assert np.array_equal(one.forces(0.0, u), first)
