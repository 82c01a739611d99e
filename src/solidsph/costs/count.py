"""Counts of the work of a built scene."""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from solidsph.costs.factorisation import estimate_factorisation
from solidsph.costs.work import Loop, StaticWork, Work
from solidsph.interfaces.body import Body
from solidsph.interfaces.material import Material
from solidsph.interfaces.terms import FieldTerm
from solidsph.scene.default_cover import cover_of
from solidsph.scene.scene_data import StaticsScene
from solidsph.scene.static_solver import iterates
from solidsph.simulation import Simulation

ITERATIONS = 5
"""Typical number of Newton iterations per load step: 4 under a small load, 5 where a sheet with a
hole is stretched, 7 where a beam bends by a fifth of its length. A linear material needs one."""

# Products with the tangent in an equilibrium over the root of the ratio of the confined modulus to
# the shear modulus: 129 to 168 at nu 0.3, 2700 to 31 000 particles, 537 and 626 at nu 0.49.
_PRODUCTS = 80.0


def count_work(simulation: Simulation) -> Work:
    """Count the work of a run of `simulation` without running it."""
    particles, internal = simulation.particles, simulation.dynamics.internal
    d, n = particles.dimension, particles.count
    plan = simulation.plan
    scene = simulation.scene
    if scene.statics is None:
        statics = None
        loop = Loop.COMPILED if plan.compiles_steps else Loop.STEPS
        steps, outputs = simulation.steps, len(simulation.output_steps()) + 1
        evaluations = steps + 1
    else:
        statics = _static_work(simulation, scene.statics)
        loop, steps, outputs = Loop.NEWTON, statics.load_steps, statics.load_steps + 1
        evaluations = statics.iterations + statics.load_steps
    # Fields of conditions have about two numbers a particle each.
    fields = sum(2 for term in simulation.terms if isinstance(term, FieldTerm))
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
        record_bytes=record_bytes(n, d, outputs, fields),
        compilations=plan.compilations,
        statics=statics,
        cover=cover_of(scene),
        motions=len(simulation.dynamics.constraints),
    )


def record_bytes(particles: int, dimension: int, outputs: int, fields: int = 0) -> int:
    """Approximate size of a record with this many additional numbers a particle [bytes].

    Vectors have 3 components and tensors 9 in a record, whatever the dimension.
    """
    # Positions, velocities, stresses and volume ratios.
    evolving = outputs * (3 + 3 + 9 + 1 + fields)
    # Reference data: four vectors, three numbers, two small ones and the grid of single points.
    constant = 3 * 3 + 3 + 1 + 2
    return 8 * particles * (evolving + constant)


def _static_work(simulation: Simulation, wanted: StaticsScene) -> StaticWork:
    bodies, d = simulation.model.bodies, simulation.particles.dimension
    linear = all(not body.material.objective for body in bodies)
    unknowns = int(simulation.dynamics.free.sum())
    load_steps = simulation.load_steps
    iterations = load_steps * (1 if linear else ITERATIONS)
    if iterates(wanted.solver, d, unknowns):
        products = load_steps * max(map(expected_products, (body.material for body in bodies)))
        return iterated_work(load_steps, iterations, unknowns, products)
    factors = [
        estimate_factorisation(
            _cells(body), 2.0 * body.smoothing.support_radius / _spacing(body), d
        )
        for body in bodies
    ]
    return StaticWork(
        load_steps=load_steps,
        iterations=iterations,
        freedoms=unknowns,
        entries=sum(_coupled(body) for body in bodies) * d * d,
        fill=sum(part.fill for part in factors),
        multiplications=sum(part.multiplications for part in factors),
        banded=all(part.banded for part in factors),
    )


def expected_products(material: Material) -> int:
    """Products with the tangent in a load step by iteration, about."""
    lam, mu = material.lame_parameters
    return round(_PRODUCTS * sqrt(lam / mu + 2.0))


def iterated_work(load_steps: int, iterations: int, unknowns: int, products: int) -> StaticWork:
    """Work of an equilibrium by iteration, which assembles and factorises nothing large."""
    return StaticWork(
        load_steps=load_steps,
        iterations=iterations,
        freedoms=unknowns,
        entries=0,
        fill=0,
        multiplications=0,
        products=products,
    )


def _coupled(body: Body) -> int:
    """Approximate number of pairs with a common neighbour: those up to two supports apart."""
    if body.smoothing.radii is not None:
        return body.pairs(2.0 * body.smoothing.support_radius).count
    tree = cKDTree(body.particles.positions)
    return int(tree.count_neighbors(tree, 2.0 * body.smoothing.support_radius))


def _spacing(body: Body) -> float:
    return float(body.particles.spacings.max())


def _cells(body: Body) -> tuple[float, ...]:
    """Particles along each axis of a full box of the same proportions and number of particles."""
    positions = body.particles.positions
    return full_box(np.ptp(positions, axis=0) / _spacing(body) + 1.0, len(positions))


def full_box(sides: NDArray[np.float64], particles: float) -> tuple[float, ...]:
    """Particles along each axis of a box of `particles` with the proportions of `sides` (d,)."""
    share = min(1.0, particles / float(np.prod(sides)))
    return tuple(float(side) * share ** (1.0 / len(sides)) for side in sides)
