"""Whether parts fit each other: each check yields problems, each with its remedy."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from keyword import iskeyword
from math import ceil, isfinite, sqrt

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.body import Body
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.formulation import Formulation
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.shape import Shape
from solidsph.interfaces.terms import (
    Constraint,
    Load,
    StressTerm,
    SurfaceLoad,
)
from solidsph.model.particles import Particles
from solidsph.model.regions import AXES, EVERYWHERE, variable
from solidsph.registry.problems import MOST_OF_A_KIND
from solidsph.scene.overlap import overlap
from solidsph.scene.scene_data import OFF, SceneData

# Bodies that overlap by less, in spacings, merely touch: their shapes are drawn no more exactly.
_TOUCHING = 0.05

# No kernel is of use so wide, and its pairs would fill any memory.
MOST_COVER = 100.0


def numbers(scene: SceneData) -> Iterator[str]:
    """Durations, factors and counts."""
    for name, value, unit in (
        ("duration", scene.duration, "s"),
        ("cover", scene.cover, "particle spacings"),
        ("time_step_factor", scene.time_step_factor, "a part of the CFL step"),
        ("time_step", scene.time_step, "s"),
    ):
        if value is not None and not (isfinite(value) and value > 0.0):
            yield f"{name} must be positive and finite, got {value}; give it in {unit}"
    if scene.cover is not None and isfinite(scene.cover) and scene.cover > MOST_COVER:
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


def sleep(scene: SceneData) -> Iterator[str]:
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


def statics(scene: SceneData) -> Iterator[str]:
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
    default = attrs.fields(SceneData).time_step_factor.default
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


def history(bodies: Sequence[Body], scene: SceneData, labels: Collection[str]) -> Iterator[str]:
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
    parting = [label for label, one in named.items() if one.breaks_bonds]
    joining = [label for label, one in named.items() if one.uses_initial_pairs]
    if parting and joining:
        yield (
            f"{parting[0]!r} parts neighbours, and {joining[0]!r} acts between them whether or not "
            "they are parted; leave one of the two out"
        )


def names(bodies: Mapping[str, Particles]) -> Iterator[str]:
    """No two names of bodies, tags and faces that a condition could not tell apart."""
    taken = Names(())
    for tag in dict.fromkeys(tag for one in bodies.values() for tag in (*one.tags, *one.faces)):
        if taken.like(tag):
            yield f"the face or tag {tag!r} {taken.problem(tag)}"
        taken.add(tag)
    for name in bodies:
        wrong = taken.problem(name)
        if wrong:
            yield f"body {name!r}: its name {wrong}"
        taken.add(name)


class Names:
    """Names of sets of particles, as conditions write them."""

    def __init__(self, names: Iterable[str]) -> None:
        self._by_variable = {variable(name): name for name in (EVERYWHERE, *names)}

    def add(self, name: str) -> None:
        """Take `name`, if it is free."""
        self._by_variable.setdefault(variable(name), name)

    def like(self, name: str) -> str:
        """The name taken that a condition writes like this one; empty if there is none."""
        return self._by_variable.get(variable(name), "")

    def problem(self, name: str) -> str:
        """What is wrong with `name` for a body or a tag, with the remedy; empty if it is right."""
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", name):
            return "must begin with a letter and go on in letters, digits, '-' and '_'; change it"
        if variable(name) in (*AXES, "t", "pi", "e"):
            return "is a variable or constant of formulas; choose another"
        if iskeyword(variable(name)):
            return "is a word of Python, so no condition could name it; choose another"
        like = self.like(name)
        if like == name:
            return "names a set of particles already; choose another"
        if like:
            return (
                f"cannot be told from {like!r} in a condition, where both are written "
                f"{variable(name)!r}; choose another"
            )
        return ""


def dimensions(shapes: Mapping[str, Shape], cover: float | None) -> Iterator[str]:
    """One dimension for all bodies, and a cover that reaches far enough in it."""
    each = {name: shape.dimension for name, shape in shapes.items()}
    if not each:
        return
    if len(set(each.values())) > 1:
        listed = ", ".join(f"{name!r} {d}D" for name, d in each.items())
        yield f"bodies of different dimension in one scene: {listed}; use shapes of one dimension"
        return
    d = next(iter(each.values()))
    least = sqrt(d)
    if cover is not None and 0.0 < cover <= least:
        yield (
            f"cover = {cover:.6g} is too small in {d}D: a particle must reach its diagonal "
            f"neighbours, {least:.4g} spacings away; take at least {ceil(10 * least + 5) / 10:g}"
        )


def apart(shapes: Mapping[str, Shape], sets: Mapping[str, Particles]) -> Iterator[str]:
    """No two bodies in one place; beyond the first pairs that are, no others are looked at."""
    names = list(shapes)
    boxes = np.array([shape.bounds() for shape in shapes.values()])  # (b, 2, d)
    spacings = np.array([float(sets[name].spacings.min()) for name in names])
    told, passed_over = 0, 0
    for k, name in enumerate(names[:-1]):
        rest = boxes[k + 1 :]
        common = np.minimum(rest[:, 1], boxes[k, 1]) - np.maximum(rest[:, 0], boxes[k, 0])
        near = k + 1 + np.flatnonzero(np.all(common > 0.0, axis=1))
        if told == MOST_OF_A_KIND:
            passed_over += len(near)
            continue
        for number, other in enumerate(near, 1):
            spacing = min(spacings[k], spacings[other])
            found = overlap(shapes[name], shapes[names[other]], _TOUCHING * spacing)
            if found is not None:
                place = ", ".join(f"{x:.4g}" for x in found.place)
                told += 1
                yield (
                    f"bodies {name!r} and {names[other]!r} are in one place: they overlap by "
                    f"{found.depth:.3g} m ({found.depth / spacing:.2g} spacings) around "
                    f"({place}); move one, or cut it out with a 'difference'. To press bodies "
                    "together, let them touch, and move one by an initial displacement"
                )
            if told == MOST_OF_A_KIND:
                passed_over += len(near) - number
                break
    if passed_over:
        yield f"{passed_over} more pairs of bodies, whose boxes overlap, were not looked at"


def motions(held_by: Sequence[Constraint], particles: Particles) -> Iterator[str]:
    """No degree of freedom determined twice, and no ghost left adrift."""
    # By freedom: the number of the first motion that determines it, or -1.
    first_of = np.full(particles.positions.shape, -1)
    for number, motion in enumerate(held_by):
        entries = np.nonzero(motion.held)
        owners = first_of[entries]
        for other in np.unique(owners[owners >= 0]).tolist():
            both, axes = (one[owners == other] for one in entries)
            yield (
                f"{motion.label!r} and {held_by[other].label!r} both determine the motion of "
                f"{len(np.unique(both))} particles (the first: {both[0]}, along {'xyz'[axes[0]]}); "
                "narrow the `where` of one"
            )
        free = owners < 0
        first_of[tuple(one[free] for one in entries)] = number
    adrift = particles.ghosts & (first_of < 0).any(axis=1)
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


def loads(loaded: Sequence[Load], particles: Particles, formulation: Formulation) -> Iterator[str]:
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


def stresses(imposed: Sequence[StressTerm], formulation: Formulation) -> Iterator[str]:
    """Stress imposed on ghosts must be of use to the formulation."""
    if formulation.divergence.uses_ghost_stress:
        return
    for condition in imposed:
        if not isinstance(condition, Constraint):
            yield (
                f"{condition.label!r} sets the stress of ghosts, which the formulation's "
                f"divergence ({type(formulation.divergence).__name__}) does not use; take "
                "divergence = 'plain', or load the surface with 'traction'"
            )
