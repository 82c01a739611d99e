"""Estimate of the work of a scene without building it, for scenes larger than the machine.

The number of particles is the volume over that of a cell; pairs are those of full supports, minus
those that surfaces cut off. Ghosts and the rates of effects are neglected. For a lattice many
supports wide, the error is within 1 % for particles and 5 % for pairs. The step is a factor of the
CFL step: the critical one needs the forces. Where it is the shorter, as with 'consistent' and
'quadratic', a run has more steps than estimated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from math import ceil, floor, pi

import attrs
import numpy as np

from solidsph.costs.count import (
    ITERATIONS,
    expected_products,
    full_box,
    iterated_work,
    record_bytes,
)
from solidsph.costs.factorisation import estimate_factorisation
from solidsph.costs.work import Loop, StaticWork, Work
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.engine import Engine
from solidsph.interfaces.formulation import Configuration, Formulation
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.material import Material
from solidsph.interfaces.plan import BodySize, Operations, SumMethod
from solidsph.interfaces.shape import Shape
from solidsph.interfaces.smoothing_kernel import UNIT_SPHERE
from solidsph.registry.construct import construct
from solidsph.scene.default_cover import cover_of
from solidsph.scene.graded_spacing import is_graded, least_spacing, predicted_count, spacing_field
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import BodyScene, PartLike
from solidsph.scene.scheme import SCHEMES, completed
from solidsph.scene.static_solver import iterates, load_steps

# Random points to estimate the volume of a shape that has no formula for it.
_POINTS = 1 << 15

# Samples along the longest side of a shape to estimate its surface area.
_ALONG = 40


@attrs.frozen
class BodyEstimate:
    """Estimate of one body."""

    particles: float
    pairs: float
    wave_time: float  # time of a wave across one spacing [s]
    cells: tuple[float, ...]  # particles along each axis of its box
    lattice: bool  # whether it has the default discretisation
    remembers: bool  # whether its material has internal variables
    products: int  # with the tangent in a load step, if it is iterated
    filters: bool  # whether it filters its dilatation


def estimate_work(scene: Scene) -> Work:
    """Estimate the work of a run of `scene`.

    Raises:
        SceneError: a part is unknown, or its parameters are wrong.
    """
    scene = completed(scene)
    cover = cover_of(scene)
    formulation: Formulation = construct("formulations", scene.formulation)
    bodies = [_body(scene, body, cover, formulation) for body in scene.bodies.values()]
    d = len(bodies[0].cells)
    integrator: Integrator = construct("integrators", scene.integrator)
    effects: list[Effect] = [construct("effects", entry.part) for entry in scene.effects]
    n = round(sum(body.particles for body in bodies))
    pairs = round(sum(body.pairs for body in bodies))
    step = integrator.stability_limit / (2.0 / min(body.wave_time for body in bodies))
    size = scene.time_step or scene.time_step_factor * step
    statics = None if scene.statics is None else _statics(scene, bodies, d, cover)
    steps = max(1, ceil(scene.duration / size)) if statics is None else statics.load_steps
    outputs = (min(scene.outputs, steps) if statics is None else steps) + 1
    moving = formulation.configuration is Configuration.CURRENT
    sizes = [
        BodySize(d, body.particles, body.pairs, moving, body.lattice, body.filters)
        for body in bodies
    ]
    evaluations = steps + 1 if statics is None else statics.iterations + steps
    engine: Engine = construct("engines", scene.engine)
    plan = engine.expected(sizes, evaluations)
    compiled = statics is None and plan.compiles_steps
    loads: tuple[Operations, ...] = ()
    visited = sum(effect.pair_work(n, pairs) for effect in effects)
    if visited:
        way = SumMethod.PAIR_LOOPS if compiled else SumMethod.PAIR_ARRAYS
        kept = round(visited * (4 + 3 * 8))
        loads = (Operations(way, round(visited), n, kept, kept, threaded=compiled),)
    return Work(
        dimension=d,
        particles=n,
        pairs=pairs,
        loop=Loop.NEWTON if statics else Loop.COMPILED if compiled else Loop.STEPS,
        steps=steps,
        evaluations=evaluations,
        operations=(*plan.engine, *loads),
        conditions=len(scene.boundaries) + len(effects),
        outputs=outputs,
        record_bytes=record_bytes(n, d, outputs),
        compilations=plan.compilations,
        statics=statics,
        counted=False,
        cover=cover,
        motions=len(scene.boundaries),
    )


def _body(scene: Scene, body: BodyScene, cover: float, formulation: Formulation) -> BodyEstimate:
    shape: Shape = construct("shapes", body.shape)
    wanted = body.material if body.material is not None else scene.material
    material: Material = construct("materials", wanted if wanted is not None else "")
    d = shape.dimension
    lower, upper = shape.bounds()
    volume = shape.volume()
    volume = _sampled_volume(shape) if volume is None else volume
    if is_graded(body):
        field = spacing_field(body, shape)
        least, h = field.least, (volume / predicted_count(field, shape)) ** (1.0 / d)
    else:
        least = h = least_spacing(body)
    sides = np.maximum(1.0, (upper - lower) / h)
    lattice = _on_a_lattice(body) and not is_graded(body)
    particles = max(1.0, volume / h**d)
    around = lattice_neighbours(cover, d) if lattice else ball(cover, d)
    cut = _surface(shape) / h ** (d - 1) * cut_off(cover, d) * around / ball(cover, d)
    return BodyEstimate(
        particles=particles,
        pairs=max(particles, particles * around - cut),
        wave_time=least / material.wave_speed,
        cells=full_box(sides, particles),
        lattice=lattice,
        remembers=isinstance(material, HistoryMaterial),
        products=expected_products(material),
        filters=formulation.filtered_modulus(material, d) > 0.0,
    )


def _on_a_lattice(body: BodyScene) -> bool:
    """Whether the body has the discretisation of a scheme, with whatever parameters."""
    names = [_name(scheme.discretisation) for scheme in SCHEMES.values()]
    return _name(body.discretisation) in names


def _name(part: PartLike | None) -> object:
    return part.get("type") if isinstance(part, Mapping) else part


def ball(cover: float, dimension: int) -> float:
    """Mean number of particles in a full support: its volume in cells."""
    return UNIT_SPHERE[dimension] / dimension * cover**dimension


def lattice_neighbours(cover: float, dimension: int) -> int:
    """Points of a cubic lattice within `cover` spacings of a point, itself included."""
    reach = floor(cover)
    square = cover**2 * (1.0 + 1e-12)
    steps = range(-reach, reach + 1)
    return sum(sum(k * k for k in point) <= square for point in product(steps, repeat=dimension))


def cut_off(cover: float, dimension: int) -> float:
    """Pairs lost at a flat surface, per spacing^(d-1) of its area.

    The part of the support beyond the surface, integrated over the distance from it: R^2/2,
    2 R^3/3 and pi R^4/4 in 1, 2 and 3 dimensions.
    """
    return {1: cover**2 / 2.0, 2: 2.0 * cover**3 / 3.0, 3: pi * cover**4 / 4.0}[dimension]


def _surface(shape: Shape) -> float:
    """Surface area from coarse samples [m^(d-1)]."""
    lower, upper = shape.bounds()
    vectors = shape.surface(float((upper - lower).max()) / _ALONG).area_vectors
    return float(np.linalg.norm(vectors, axis=1).sum())


def _sampled_volume(shape: Shape) -> float:
    lower, upper = shape.bounds()
    points = np.random.default_rng(0).uniform(lower, upper, (_POINTS, shape.dimension))
    return float(np.prod(upper - lower) * np.mean(shape.signed_distance(points) < 0.0))


def _statics(scene: Scene, bodies: Sequence[BodyEstimate], d: int, cover: float) -> StaticWork:
    assert scene.statics is not None
    unknowns = round(sum(body.particles for body in bodies) * d)
    remembers = any(body.remembers for body in bodies)
    steps = load_steps(scene.statics.load_steps, remembers=remembers)
    if iterates(scene.statics.solver, d, unknowns):
        products = steps * max(body.products for body in bodies)
        return iterated_work(steps, steps * ITERATIONS, unknowns, products)
    reach = 2.0 * cover
    factors = [estimate_factorisation(body.cells, reach, d) for body in bodies]
    return StaticWork(
        load_steps=steps,
        iterations=steps * ITERATIONS,
        freedoms=unknowns,
        entries=round(sum(b.particles for b in bodies) * ball(reach, d) * d * d),
        fill=sum(part.fill for part in factors),
        multiplications=sum(part.multiplications for part in factors),
        banded=all(part.banded for part in factors),
    )
