"""Whether parts fit each other: each check yields problems, each with its remedy."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from math import ceil, isfinite, sqrt

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.arrays import Mask
from solidsph.body import Body
from solidsph.interfaces.condition import (
    ForceCondition,
    MotionCondition,
    StressCondition,
    SurfaceLoad,
)
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.formulation import Formulation
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.shape import Shape
from solidsph.particles import Particles
from solidsph.scene import OFF, Scene
from solidsph.where import AXES, EVERYWHERE

# Deeper than this inside another body, in spacings, a particle is not merely touching it.
_TOUCHING = 1e-6

# No kernel is of use so wide, and its pairs would fill any memory.
MOST_COVER = 100.0


def numbers(scene: Scene) -> Iterator[str]:
    """Durations, factors and counts."""
    for name, value, unit in (
        ("duration", scene.duration, "s"),
        ("cover", scene.cover, "particle spacings"),
        ("time_step_factor", scene.time_step_factor, "a part of the CFL step"),
        ("time_step", scene.time_step, "s"),
    ):
        if value is not None and not (isfinite(value) and value > 0.0):
            yield f"{name} must be positive and finite, got {value}; give it in {unit}"
    if isfinite(scene.cover) and scene.cover > MOST_COVER:
        yield (
            f"cover must not exceed {MOST_COVER:g}, got {scene.cover:.6g}; it is in particle "
            "spacings, and 3 is usual"
        )
    if scene.time_step_factor > 1.0:
        yield f"time_step_factor must not exceed 1, got {scene.time_step_factor}; 0.5 is usual"
    if scene.outputs < 1:
        yield f"outputs must be at least 1, got {scene.outputs}; the last state is always recorded"
    if not _is_tolerance(scene.energy_tolerance):
        yield (
            f"energy_tolerance must be a positive number or {OFF!r}, got "
            f"{scene.energy_tolerance!r}; it is the energy residual over the energy in play that "
            "is allowed, 0.01 if nothing is said"
        )


def _is_tolerance(value: object) -> bool:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return isfinite(value) and value > 0.0
    return value == OFF


def sleep(scene: Scene) -> Iterator[str]:
    """Numbers of what may sleep."""
    wanted = scene.sleep
    if wanted is None:
        return
    if scene.statics is not None:
        yield "sleep: an equilibrium has no motion to wait for; leave out [sleep], or [statics]"
    if not isinstance(wanted.tolerance, (int, float)) or not 0.0 < wanted.tolerance < 1.0:
        yield f"sleep: tolerance must lie between 0 and 1, got {wanted.tolerance!r}; 1e-9 is usual"
    if isinstance(wanted.slabs, bool) or not isinstance(wanted.slabs, int) or wanted.slabs < 2:
        yield f"sleep: slabs must be a whole number from 2 on, got {wanted.slabs!r}; 160 is usual"


def statics(scene: Scene) -> Iterator[str]:
    """Numbers of the static run, and no word beside it that means a motion."""
    wanted = scene.statics
    if wanted is None:
        return
    for name, value in (
        ("load_steps", wanted.load_steps),
        ("max_iterations", wanted.max_iterations),
    ):
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            yield f"statics: {name} must be a whole number of at least 1, got {value!r}"
    if not isinstance(wanted.tolerance, (int, float)) or not 0.0 < wanted.tolerance < 1.0:
        yield (
            f"statics: tolerance must lie between 0 and 1, got {wanted.tolerance!r}; 1e-9 is usual"
        )
    default = attrs.fields(Scene).time_step_factor.default
    for name, given in (
        ("an integrator", scene.integrator is not None),
        ("a time step", scene.time_step is not None or scene.time_step_factor != default),
        ("an initial state", bool(scene.initial)),
    ):
        if given:
            yield (
                f"statics: {name} is named, but an equilibrium is found without moving in time; "
                "leave it out, or leave out [statics]"
            )


def history(bodies: Sequence[Body], scene: Scene, labels: Collection[str]) -> Iterator[str]:
    """What remembers is moved in time, and its account has its name."""
    for body in bodies:
        if not isinstance(body.material, HistoryMaterial):
            continue
        if scene.statics is not None:
            yield (
                f"body {body.name!r}: {type(body.material).__name__} remembers what has been, and "
                "[statics] finds equilibria without a past; leave out [statics], load slowly and "
                "add 'mass-damping'"
            )
        if "history" in labels:
            yield "the label 'history' is that of what materials remember; choose another"


def effects(named: Mapping[str, Effect]) -> Iterator[str]:
    """Nothing acts across what another effect parts."""
    parting = [label for label, one in named.items() if one.parts_neighbours]
    joining = [label for label, one in named.items() if one.joins_neighbours]
    if parting and joining:
        yield (
            f"{parting[0]!r} parts neighbours, and {joining[0]!r} acts between them whether or not "
            "they are parted; leave one of the two out"
        )


def names(bodies: Mapping[str, Particles]) -> Iterator[str]:
    """No body is called like a tag of its or another's particles, or like a variable."""
    taken = {tag for particles in bodies.values() for tag in particles.tags}
    for name in bodies:
        wrong = name_problem(name, taken)
        if wrong:
            yield f"body {name!r}: its name {wrong}"


def name_problem(name: str, taken: Collection[str]) -> str:
    """What is wrong with `name` for a body or a tag, with the remedy; nothing if it is right."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", name):
        return "must begin with a letter and go on in letters, digits, '-' and '_'; change it"
    if name in taken or name == EVERYWHERE:
        return "names a set of particles already; choose another"
    if name in (*AXES, "t", "pi", "e"):
        return "is a variable or constant of formulas; choose another"
    return ""


def dimensions(shapes: Mapping[str, Shape], cover: float) -> Iterator[str]:
    """One dimension for all bodies, and a cover that reaches far enough in it."""
    each = {name: shape.dimension for name, shape in shapes.items()}
    if len(set(each.values())) > 1:
        listed = ", ".join(f"{name!r} {d}D" for name, d in each.items())
        yield f"bodies of different dimension in one scene: {listed}; use shapes of one dimension"
        return
    d = next(iter(each.values()))
    least = sqrt(d)
    if cover <= least:
        yield (
            f"cover = {cover:.6g} is too small in {d}D: a particle must reach its diagonal "
            f"neighbours, {least:.4g} spacings away; take at least {ceil(10 * least + 5) / 10:g}"
        )


def apart(shapes: Mapping[str, Shape], particles: Particles) -> Iterator[str]:
    """No two bodies in one place."""
    for name, extent in particles.bodies.items():
        X = particles.positions[extent][~particles.ghosts[extent]]
        spacing = particles.spacings[extent].min()
        for other, shape in shapes.items():
            if other == name:
                continue
            inside = int(np.sum(shape.signed_distance(X) < -_TOUCHING * spacing))
            if inside:
                yield (
                    f"bodies {name!r} and {other!r} are in one place: {inside} particles of "
                    f"{name!r} lie inside {other!r}; move one, or cut it out with a 'difference'"
                )


def motions(held_by: Sequence[MotionCondition], particles: Particles) -> Iterator[str]:
    """No degree of freedom determined twice, and no ghost left adrift."""
    seen: dict[str, Mask] = {}
    for motion in held_by:
        own = motion.held
        for other, theirs in seen.items():
            both = own & theirs
            if both.any():
                first, axis = (int(k) for k in np.argwhere(both)[0])
                yield (
                    f"{motion.label!r} and {other!r} both determine the motion of "
                    f"{int(both.any(axis=1).sum())} particles (the first: {first}, along "
                    f"{'xyz'[axis]}); narrow the `where` of one"
                )
        seen[motion.label] = own
    covered = np.zeros(particles.positions.shape, dtype=np.bool_)
    for own in seen.values():
        covered |= own
    adrift = particles.ghosts & ~covered.all(axis=1)
    if adrift.any():
        tags = [
            tag
            for tag, mask in particles.tags.items()
            if tag.endswith("-ghosts") and (mask & adrift).any()
        ]
        yield (
            f"{int(adrift.sum())} ghosts ({', '.join(tags)}) have no motion; add 'symmetry' or "
            "'ghost-extension' for them, or leave them out of the discretisation"
        )


def loads(
    loaded: Sequence[ForceCondition], particles: Particles, formulation: Formulation
) -> Iterator[str]:
    """No surface is loaded through which ghosts carry the stress on."""
    if not (formulation.divergence.uses_ghost_stress and particles.ghosts.any()):
        return
    beyond = particles.positions - particles.images  # along the normal, out of the body
    for load in loaded:
        if not isinstance(load, SurfaceLoad):
            continue
        areas = particles.area_vectors[load.particles]
        near = cKDTree(particles.positions[load.particles])
        distances, nearest = near.query(particles.positions[particles.ghosts])
        facing = np.einsum("gi,gi->g", beyond[particles.ghosts], areas[nearest])
        sizes = np.linalg.norm(beyond[particles.ghosts], axis=1)
        sizes *= np.linalg.norm(areas[nearest], axis=1)
        spacing = particles.spacings[particles.ghosts]
        if np.any((distances < 1.5 * spacing) & (facing > 0.9 * sizes)):
            yield (
                f"{load.label!r} loads a surface through which ghosts carry the stress on "
                f"(divergence {type(formulation.divergence).__name__}), so nothing would balance "
                "it; impose the traction with 'approximate-neumann', or leave these ghosts out"
            )


def stresses(imposed: Sequence[StressCondition], formulation: Formulation) -> Iterator[str]:
    """Stress imposed on ghosts must be of use to the formulation."""
    if formulation.divergence.uses_ghost_stress:
        return
    for condition in imposed:
        if not isinstance(condition, MotionCondition):
            yield (
                f"{condition.label!r} sets the stress of ghosts, which the formulation's "
                f"divergence ({type(formulation.divergence).__name__}) does not use; take "
                "divergence = 'plain', or load the surface with 'traction'"
            )
