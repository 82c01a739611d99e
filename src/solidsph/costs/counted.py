"""The work of a built scene, counted from what its engine and its conditions hold."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.costs.dissection import dissected
from solidsph.costs.work import Compilation, Loop, Piece, StaticWork, Work
from solidsph.interfaces.body import Body
from solidsph.interfaces.compilable_terms import (
    HourglassLoad,
    PairLoad,
    PointwiseLoad,
)
from solidsph.interfaces.hourglass_energy import HourglassOperator, HourglassProducts
from solidsph.interfaces.operation_count import Tally, Way
from solidsph.interfaces.terms import (
    FieldTerm,
    GhostConstraint,
    Load,
    StressTerm,
)
from solidsph.scene.default_cover import cover_of
from solidsph.scene.scene_data import StaticsScene
from solidsph.simulation import Simulation

_COMPILED = (Way.STENCILS, Way.ROWS)
_MOVING = (Way.FORMULAS, Way.WEIGHTS)

ITERATIONS = 4
"""Of Newton's method in a load step, about: 3 under a small load, 4 where it bends a beam by a
fifth of its length, more near a limit point. A linear law takes one."""


def counted(simulation: Simulation) -> Work:
    """The work of a run of `simulation`, without running it."""
    particles, internal = simulation.particles, simulation.dynamics.internal
    d, n = particles.dimension, particles.count
    compiled = simulation.compiles_steps
    statics = simulation.scene.statics
    tally = (*internal.tally, *_of_loads(simulation, compiled=compiled))
    if statics is not None:
        own = _of_statics(simulation, statics)
        loop, steps, outputs = Loop.NEWTON, own.load_steps, own.load_steps + 1
        evaluations = own.iterations + own.load_steps
    else:
        own = None
        loop = Loop.COMPILED if compiled else Loop.STEPS
        steps, outputs = simulation.steps, len(simulation.output_steps()) + 1
        evaluations = steps + 1
    return Work(
        dimension=d,
        particles=n,
        pairs=internal.pair_count,
        loop=loop,
        steps=steps,
        evaluations=evaluations,
        tally=tally,
        conditions=len(simulation.terms),
        outputs=outputs,
        record_bytes=record_bytes(n, d, outputs, _own_fields(simulation)),
        compilations=frozenset(_compilations(simulation, tally, compiled=compiled)),
        statics=own,
        cover=cover_of(simulation.scene),
        motions=len(simulation.dynamics.constraints),
    )


def record_bytes(particles: int, dimension: int, outputs: int, fields: int = 0) -> int:
    """Of positions, velocities, stresses and volume ratios, and so many numbers more, about.

    Vectors have 3 components and tensors 9 in a record, whatever the dimension.
    """
    evolving = outputs * (3 + 3 + 9 + 1 + fields)
    # Reference data: four vectors, three numbers, two small ones and the grid of single points.
    constant = 3 * 3 + 3 + 1 + 2
    return 8 * particles * (evolving + constant)


def _of_loads(simulation: Simulation, *, compiled: bool) -> Iterator[Tally]:
    d, n = simulation.particles.dimension, simulation.particles.count
    for load in simulation.dynamics.loads:
        match load:
            case PairLoad():
                way = Way.PAIR_LOOPS if compiled else Way.PAIR_ARRAYS
                table = load.pairs
                held = table.starts.nbytes + table.columns.nbytes + table.values.nbytes
                touched = held + 3 * 8 * n * d
                yield Tally(way, len(table.columns), n, touched, held)
            case HourglassLoad():
                for operator in load.operators:
                    yield _of_hourglass(operator, compiled=compiled)
            case _:
                yield _of_any(load, simulation)


def _of_any(load: Load, simulation: Simulation) -> Tally:
    """Of a load on particles; an effect that is not known here says what pairs it visits."""
    d, chosen = simulation.particles.dimension, len(load.particles)
    effect = simulation.effects.get(load.label)
    pairs, held = 0, 8 * chosen * d
    if effect is not None:
        particles, internal = simulation.particles, simulation.dynamics.internal
        pairs = int(effect.pair_work(particles.count, internal.pair_count))
        held = sum(effect.arrays(simulation.model).values())
    return Tally(Way.UNKNOWN, pairs, chosen, held + 3 * 8 * chosen * d, held)


def _of_hourglass(operator: HourglassOperator, *, compiled: bool) -> Tally:
    own = operator.tally
    if not (compiled and isinstance(operator, HourglassProducts)):
        return own
    # The compiled loop makes sweeps of it: H, near pairs, and the stress in return.
    n, d = operator.pairs.body.particles.positions.shape
    pairs = 2 * ((operator.jet.nnz - n) // d) + len(operator.pairs.columns)
    return attrs.evolve(own, way=Way.HOURGLASS_SWEEPS, pairs=pairs)


def _own_fields(simulation: Simulation) -> int:
    """Numbers a particle in fields that conditions record, taken to be two each."""
    return sum(2 for one in simulation.terms if isinstance(one, FieldTerm))


def _compilations(
    simulation: Simulation, tally: Sequence[Tally], *, compiled: bool
) -> Iterator[Compilation]:
    d = simulation.particles.dimension
    ways = {part.way for part in tally}
    fixed, moving = ways.intersection(_COMPILED), ways.intersection(_MOVING)
    threaded = any(part.threaded for part in tally)
    precision = min((part.precision for part in tally), default=8)
    laws = {(type(body.material), type(body.formulation)) for body in simulation.model.bodies}

    def one(piece: Piece, key: object = None) -> Compilation:
        return Compilation(piece, d, threaded, key)

    if fixed:
        yield Compilation(Piece.ENGINE, 0, False)
        staged = any(isinstance(c, StressTerm) for c in simulation.terms) or any(
            not body.formulation.divergence.adjoint for body in simulation.model.bodies
        )
        for law in laws:
            yield one(Piece.STAGED if staged else Piece.FORCES, (law, precision))
        yield one(Piece.FIELDS, precision)
    if moving:
        yield Compilation(Piece.MOVING_ENGINE, d, False)
        for law in laws:
            yield one(Piece.MOVING, law)
    if Way.HOURGLASS_SWEEPS in ways and not compiled:
        yield one(Piece.SWEEPS)
    if compiled:
        kinds = tuple(sorted(type(c).__name__ for c in simulation.terms))
        yield one(Piece.STEPS, (type(simulation.integrator), *laws, precision, kinds))
        for load in simulation.dynamics.loads:
            match load:
                case PairLoad():
                    yield one(Piece.PAIR_LOAD, type(load))
                case HourglassLoad():
                    yield one(Piece.HOURGLASS_LOAD, type(load))
                case PointwiseLoad():
                    yield one(Piece.LOAD, type(load))
                case _:
                    yield one(Piece.LOAD)
        if any(isinstance(one, GhostConstraint) for one in simulation.dynamics.constraints):
            yield one(Piece.EXTENSION)


def _of_statics(simulation: Simulation, wanted: StaticsScene) -> StaticWork:
    particles = simulation.particles
    d = particles.dimension
    held = np.zeros(particles.positions.shape, dtype=np.bool_)
    for motion in simulation.dynamics.constraints:
        held |= motion.held
    free = int((~held & ~particles.ghosts[:, None]).sum())
    linear = all(not body.material.objective for body in simulation.model.bodies)
    iterations = 1 if linear else ITERATIONS
    factors = [
        dissected(_cells(body), 2.0 * body.smoothing.support_radius / _spacing(body), d)
        for body in simulation.model.bodies
    ]
    return StaticWork(
        load_steps=wanted.load_steps,
        iterations=wanted.load_steps * iterations,
        freedoms=free,
        entries=sum(_coupled(body) for body in simulation.model.bodies) * d * d,
        fill=sum(one.fill for one in factors),
        multiplications=sum(one.multiplications for one in factors),
    )


def _coupled(body: Body) -> int:
    """Pairs of particles with a neighbour in common: those up to two supports apart, about."""
    tree = cKDTree(body.particles.positions)
    return int(tree.count_neighbors(tree, 2.0 * body.smoothing.support_radius))


def _spacing(body: Body) -> float:
    return float(body.particles.spacings.max())


def _cells(body: Body) -> tuple[float, ...]:
    """Particles along each axis of a box that is as full as the body is."""
    positions = body.particles.positions
    sides = np.ptp(positions, axis=0) / _spacing(body) + 1.0
    share = min(1.0, len(positions) / float(np.prod(sides)))
    return tuple(float(side) * share ** (1.0 / len(sides)) for side in sides)
