"""Engines: the compiled one agrees with the matrix engine, the reference, for every part."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
import pytest

from solidsph import Simulation
from solidsph.engines.automatic import AutomaticEngine
from solidsph.engines.compiled.engine import CompiledEngine, CompiledForces
from solidsph.engines.compiled.fixed import partition
from solidsph.engines.matrix import MatrixEngine, MatrixForces
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import Engine, InternalForces
from solidsph.interfaces.material import Material
from solidsph.interfaces.terms import StressTerm
from solidsph.maths.arrays import Array, Mask, Scalar, Tensor
from solidsph.registry import registry
from solidsph.registry.construct import construct
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.testing import example_part
from tests.helpers.pairwise import pairwise
from tests.helpers.scenes import REFERENCE_ONLY, SOFT

SPACING = 0.1
LENGTHS = {1: [4.0], 2: [1.6, 3.9], 3: [0.5, 0.4, 1.3]}
LATTICE = {"type": "lattice"}
JITTERED = {"type": "jittered-lattice", "amplitude": 0.2, "seed": 1}
ARRANGEMENTS = [LATTICE, JITTERED]

# Relative to the largest force or stress. The second: sums of some 80 numbers rounded to 6e-8,
# in which those of neighbours cancel.
ROUNDING = 1e-12
SINGLE = 1e-5

in_every_dimension = pytest.mark.parametrize("d", [1, 2, 3])
on_every_arrangement = pytest.mark.parametrize(
    "arrangement", ARRANGEMENTS, ids=lambda one: one["type"]
)


def arrangement_name(value: object) -> str | None:
    return value["type"] if isinstance(value, dict) else None


def shape(lengths: Sequence[float]) -> dict[str, Any]:
    if len(lengths) == 1:
        return {"type": "interval", "length": lengths[0]}
    return {"type": "box", "lengths": list(lengths)}


def block(
    d: int,
    arrangement: dict[str, Any] = LATTICE,
    *,
    lengths: Sequence[float] | None = None,
    formulation: object = "total-lagrangian",
    material: object = None,
) -> SceneBuilder:
    return (
        Simulation.builder()
        .body(
            "block",
            shape=shape(lengths or LENGTHS[d]),
            spacing=SPACING,
            discretisation=arrangement,
        )
        .kernel("cubic-spline", cover=2.6)
        .material(material or {"type": "neo-hookean", **SOFT})
        .formulation(formulation)
        .engine("matrix")
        .duration(1e-3)
    )


def parts_of(simulation: Simulation) -> tuple[Sequence[Body], list[StressTerm]]:
    stresses = [c for c in simulation.terms if isinstance(c, StressTerm)]
    return simulation.model.bodies, stresses


def prepared(engine: Engine, simulation: Simulation) -> InternalForces:
    return engine.prepare(*parts_of(simulation))


def random_displacements(simulation: Simulation, seed: int = 0) -> Array:
    """Rough enough that an error anywhere shows, and J > 0 everywhere."""
    rng = np.random.default_rng(seed)
    return 0.03 * SPACING * rng.normal(size=simulation.particles.positions.shape)


def assert_same(
    one: InternalForces, other: InternalForces, displacements: Array, tolerance: float = ROUNDING
) -> None:
    pairs = [(one.forces(0.0, displacements), other.forces(0.0, displacements))]
    ours, theirs = one.fields(displacements), other.fields(displacements)
    pairs += zip(
        attrs.astuple(ours, recurse=False), attrs.astuple(theirs, recurse=False), strict=True
    )
    for found, expected in pairs:
        if found is None and expected is None:  # nothing dissipates
            continue
        assert np.abs(found - expected).max() <= tolerance * np.abs(expected).max()


def compiled(simulation: Simulation, precision: str = "float64") -> CompiledForces:
    forces = prepared(CompiledEngine(precision), simulation)
    assert isinstance(forces, CompiledForces)
    return forces


@pytest.mark.parametrize(
    ("d", "arrangement", "divergence", "gradient"),
    pairwise((1, 2, 3), ARRANGEMENTS, registry.names("divergences"), registry.names("gradients")),
    ids=arrangement_name,
)
def test_compiled_agrees_for_every_operator(
    d: int, arrangement: dict[str, Any], divergence: str, gradient: str
) -> None:
    # A quadratic fit needs a thicker body.
    lengths = [0.5, 0.5, 0.8] if gradient == "quadratic" and d == 3 else LENGTHS[d]
    if gradient in REFERENCE_ONLY and arrangement is LATTICE:
        arrangement = {**LATTICE, "on_boundary": True}  # its sums need particles on the surface
    operators = {"gradient": gradient, "divergence": divergence}
    formulation = {"type": "total-lagrangian", **operators}
    simulation = block(d, arrangement, lengths=lengths, formulation=formulation).build()
    reference, forces = prepared(MatrixEngine(), simulation), compiled(simulation)
    for seed in range(3):
        assert_same(forces, reference, random_displacements(simulation, seed))


# A law takes seconds to compile, in every dimension anew: here in the plane, where it takes a
# third of what it takes in space; in all by `make validate`.
mostly_in_2d = pytest.mark.parametrize(
    "d", [pytest.param(d, marks=() if d == 2 else pytest.mark.validation) for d in (1, 2, 3)]
)


# Laws with a history go through one loop, here with that of j2-plasticity.
ALIKE = ("johnson-cook", "viscoelastic")


@pytest.mark.parametrize(
    "material",
    [
        pytest.param(name, marks=pytest.mark.validation if name in ALIKE else ())
        for name in registry.names("materials")
    ],
)
@mostly_in_2d
def test_compiled_agrees_for_every_material(d: int, material: str) -> None:
    simulation = block(d, material=example_part("materials", material)).build()
    reference = prepared(MatrixEngine(), simulation)
    assert_same(compiled(simulation), reference, random_displacements(simulation))


@pytest.mark.parametrize(
    ("formulation", "gradient"),
    [
        pytest.param(
            formulation,
            gradient,
            # Neighbours that move are the subject of test_engine_moving.py.
            marks=pytest.mark.validation if formulation == "updated-lagrangian" else (),
        )
        for formulation in registry.names("formulations")
        for gradient in registry.names("gradients")
        if not (formulation == "updated-lagrangian" and gradient in REFERENCE_ONLY)
    ],
)
@pytest.mark.parametrize("divergence", registry.names("divergences"))
def test_every_formulation_agrees(formulation: str, gradient: str, divergence: str) -> None:
    part = {"type": formulation, "gradient": gradient, "divergence": divergence}
    simulation = block(2, JITTERED, lengths=[0.8, 0.7], formulation=part).build()
    reference = prepared(MatrixEngine(), simulation)
    forces = prepared(CompiledEngine(), simulation)
    assert isinstance(forces, CompiledForces)
    assert_same(forces, reference, random_displacements(simulation))


@pytest.mark.parametrize(
    ("kind", "divergence"),
    [
        *(
            (kind, name)
            for kind in ("ghosts", "symmetry")
            for name in registry.names("divergences")
        ),
        ("approximate-neumann", "plain"),  # the builder refuses it with any other
    ],
)
def test_compiled_agrees_with_ghosts_and_imposed_stress(kind: str, divergence: str) -> None:
    builder = block(
        2,
        {"type": "lattice", "ghosts": 3, "ghost_faces": ["left"]},
        lengths=[0.8, 2.4],
        formulation={"type": "total-lagrangian", "divergence": divergence},
    )
    if kind == "symmetry":
        builder = builder.boundary("symmetry", axis="x", at=0.0)
    elif kind == "approximate-neumann":
        builder = builder.boundary("ghost-extension")
        builder = builder.boundary("approximate-neumann", where="left", traction={"x": 1e4})
    else:
        builder = builder.boundary("ghost-extension")
    simulation = builder.build()
    bodies, stresses = parts_of(simulation)
    for conditions in ([], stresses):
        reference = MatrixEngine().prepare(bodies, conditions)
        forces = CompiledEngine().prepare(bodies, conditions)
        assert isinstance(forces, CompiledForces)
        assert_same(forces, reference, random_displacements(simulation))


@pytest.mark.parametrize(
    "precision", ["float64", pytest.param("float32", marks=pytest.mark.validation)]
)
def test_compiled_agrees_for_bodies_of_different_materials(precision: str) -> None:
    builder = block(2, JITTERED, lengths=[0.8, 0.7]).body(
        "other",
        shape={"type": "box", "lengths": [0.5, 2.0], "origin": [2.0, 0.0]},
        spacing=SPACING,
        material={"type": "saint-venant-kirchhoff", **SOFT, "youngs_modulus": 3e6},
    )
    simulation = builder.build()
    reference = prepared(MatrixEngine(), simulation)
    tolerance = ROUNDING if precision == "float64" else SINGLE
    forces = compiled(simulation, precision)
    assert_same(forces, reference, random_displacements(simulation), tolerance)


@on_every_arrangement
@mostly_in_2d
def test_single_precision_is_precision_of_strain(d: int, arrangement: dict[str, Any]) -> None:
    simulation = block(d, arrangement).build()
    reference = prepared(MatrixEngine(), simulation)
    forces = compiled(simulation, "float32")
    # However small the displacements are.
    for size in (1.0, 1e-6):
        u = size * random_displacements(simulation)
        expected = reference.forces(0.0, u)
        missed = np.abs(forces.forces(0.0, u) - expected).max()
        assert missed <= SINGLE * np.abs(expected).max()


@pytest.mark.parametrize(
    ("d", "arrangement", "divergence"),
    [
        pytest.param(
            d, arrangement, name, marks=pytest.mark.validation if (d, name) != (1, "plain") else ()
        )
        for d in (1, 2)
        for arrangement in ARRANGEMENTS
        for name in registry.names("divergences")
    ],
    ids=arrangement_name,
)
def test_compiled_by_several_threads(
    d: int, arrangement: dict[str, Any], divergence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same forces as the reference's, and the same bits at every call."""
    monkeypatch.setattr(partition, "WORTH_A_THREAD", 1)
    formulation = {"type": "total-lagrangian", "divergence": divergence}
    lengths = [400.0] if d == 1 else [4.0, 6.0]
    simulation = block(d, arrangement, lengths=lengths, formulation=formulation).build()
    reference = prepared(MatrixEngine(), simulation)
    forces = compiled(simulation)
    assert forces.parts[0].gradient_partition.threaded
    u = random_displacements(simulation)
    assert_same(forces, reference, u)
    assert np.array_equal(forces.forces(0.0, u), forces.forces(0.0, u))


def test_runs_share_their_stencils() -> None:
    simulation = block(3, lengths=[0.8, 0.8, 2.0]).build()
    part = compiled(simulation).parts[0]
    lines, along = 8 * 8, 20
    # Two at either end of each line have neighbours missing.
    assert part.gradient.run_particles == lines * (along - 4)
    # A stencil for every line's place beside the four edges at most.
    assert len(part.gradient.members) - 1 <= lines
    disordered = compiled(block(3, JITTERED, lengths=[0.5, 0.5, 0.9]).build()).parts[0]
    assert disordered.gradient.run_particles == 0


def test_rows_beside_a_surface_are_kept_once() -> None:
    across = 8
    rows = compiled(block(3, lengths=[0.8, 0.8, 2.0]).build()).parts[0].gradient
    assert len(rows.spans) == across * across * 4
    # Two places within reach of each of the six faces, and all that are in no reach are alike.
    assert len(np.unique(rows.spans[:, 0])) == 5 * 5 * 4
    assert len(rows.row_offsets) == np.diff(np.unique(rows.spans, axis=0), axis=1).sum()
    disordered = compiled(block(3, JITTERED, lengths=[0.5, 0.5, 0.9]).build()).parts[0].gradient
    assert len(np.unique(disordered.spans[:, 0])) == 5 * 5 * 9


def test_memory_of_a_lattice_is_bounded() -> None:
    """Long lines need little more than the fields: 800 bytes a particle is the promise."""
    simulation = block(3, lengths=[0.6, 0.6, 6.4]).build()
    forces = compiled(simulation)
    # 40 are displacements and factors, 55 the buffers of two threads; the other 77 are stencils and
    # rows, of which a larger body has no more. With a row for each particle there it was 198.
    assert forces.bytes <= 180 * simulation.particles.count
    # Compared with 28 bytes for each of some 60 pairs.
    assert forces.pair_count > 50 * simulation.particles.count


@attrs.frozen
class Lookup(Material):
    """A law that no compiler understands: it makes up the name of what it calls."""

    density: float = 1000.0

    @property
    def params(self) -> tuple[float, ...]:
        return (1e6,)

    @property
    def lame_parameters(self) -> tuple[float, float]:
        return 0.0, 0.5e6

    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        return {"energy": 0.0 * F[0][0]}["energy"]

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        multiply = getattr(np, "_".join(["multiply"]))
        axes = range(len(F))
        return [[multiply(params[0], F[i][k] - float(i == k)) for k in axes] for i in axes]

    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        return [[params[0] * component for component in row] for row in dF]


@pytest.mark.filterwarnings("ignore::solidsph.errors.PartWarning")  # its stress is a table
def test_a_part_that_cannot_be_compiled_runs_on_the_matrix_engine() -> None:
    simulation = block(2, lengths=[0.8, 0.7], material=Lookup()).build()
    forces = prepared(CompiledEngine(), simulation)
    assert isinstance(forces, MatrixForces)
    assert_same(forces, prepared(MatrixEngine(), simulation), random_displacements(simulation))


def test_scattered_ghosts_are_left_out_of_the_rows() -> None:
    """Rows are wanted of real particles, wherever the ghosts stand among them."""
    simulation = block(2, lengths=[0.8, 0.7]).build()
    body = simulation.model.bodies[0]
    ghosts: Mask = np.arange(body.particles.count) % 5 == 2
    mixed = attrs.evolve(body, particles=attrs.evolve(body.particles, ghosts=ghosts))
    u = random_displacements(simulation)
    assert_same(CompiledEngine().prepare([mixed], []), MatrixEngine().prepare([mixed], []), u)


def test_a_run_is_the_same_by_either_engine() -> None:
    builder = block(2, lengths=[0.8, 0.7]).initial(velocity={"x": "10*X"})
    ends = [builder.engine(name).build().run().state.positions for name in ("matrix", "compiled")]
    assert np.allclose(*ends, rtol=0.0, atol=1e-13)


def test_auto_compiles_where_there_is_much_to_do() -> None:
    assert isinstance(construct("engines", "auto"), AutomaticEngine)
    bodies, stresses = parts_of(block(2, lengths=[0.8, 0.7]).build())

    def chosen(bodies: Sequence[Body], evaluations: int) -> InternalForces:
        return AutomaticEngine().prepare(bodies, stresses, evaluations)

    # By itself each step of a small body takes 0.3 ms, and compiling pays from 3 s of them.
    assert isinstance(chosen(bodies, 5_000), MatrixForces)
    assert isinstance(chosen(bodies, 1_000_000), CompiledForces)
    larger, _ = parts_of(block(2, lengths=[6.0, 6.0]).build())
    assert isinstance(chosen(larger, 100), MatrixForces)
    assert isinstance(chosen(larger, 10_000), CompiledForces)
    # The updated form costs the matrix engine a search at every step, so it pays much earlier.
    moving, _ = parts_of(block(2, lengths=[0.8, 0.7], formulation="updated-lagrangian").build())
    assert isinstance(chosen(moving, 1_000), MatrixForces)
    assert isinstance(chosen(moving, 10_000), CompiledForces)


def test_small_problems_do_not_bring_the_compiler() -> None:
    script = (
        "import sys\n"
        "from solidsph import Simulation\n"
        "(Simulation.builder()\n"
        " .body('bar', shape={'type': 'interval', 'length': 1.0}, spacing=0.1)\n"
        " .kernel('cubic-spline', cover=2.6)\n"
        f" .material({{'type': 'neo-hookean', **{SOFT!r}}})\n"
        " .duration(1e-4).build().run())\n"
        "assert 'numba' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
