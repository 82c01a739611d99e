"""The work of a built scene, counted from what its engine and its conditions hold."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from solidsph.costs.dissection import dissected
from solidsph.costs.work import Loop, StaticWork, Work
from solidsph.interfaces.body import Body
from solidsph.interfaces.plan import SumMethod
from solidsph.interfaces.terms import (
    FieldTerm,
)
from solidsph.scene.default_cover import cover_of
from solidsph.scene.scene_data import StaticsScene
from solidsph.simulation import Simulation

_COMPILED = (SumMethod.STENCILS, SumMethod.ROWS)
_MOVING = (SumMethod.FORMULAS, SumMethod.WEIGHTS)

ITERATIONS = 4
"""Of Newton's method in a load step, about: 3 under a small load, 4 where it bends a beam by a
fifth of its length, more near a limit point. A linear law takes one."""


def counted(simulation: Simulation) -> Work:
    """The work of a run of `simulation`, without running it."""
    particles, internal = simulation.particles, simulation.dynamics.internal
    d, n = particles.dimension, particles.count
    plan = internal.plan(simulation.dynamics, simulation.integrator)
    statics = simulation.scene.statics
    if statics is not None:
        own = _of_statics(simulation, statics)
        loop, steps, outputs = Loop.NEWTON, own.load_steps, own.load_steps + 1
        evaluations = own.iterations + own.load_steps
    else:
        own = None
        loop = Loop.COMPILED if plan.compiles_steps else Loop.STEPS
        steps, outputs = simulation.steps, len(simulation.output_steps()) + 1
        evaluations = steps + 1
    return Work(
        dimension=d,
        particles=n,
        pairs=internal.pair_count,
        loop=loop,
        steps=steps,
        evaluations=evaluations,
        operations=(*plan.engine, *plan.loads),
        conditions=len(simulation.terms),
        outputs=outputs,
        record_bytes=record_bytes(n, d, outputs, _own_fields(simulation)),
        compilations=plan.compilations,
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


def _own_fields(simulation: Simulation) -> int:
    """Numbers a particle in fields that conditions record, taken to be two each."""
    return sum(2 for one in simulation.terms if isinstance(one, FieldTerm))


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
