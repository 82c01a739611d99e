"""Checks whether effects, boundaries and materials can be combined."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np
from scipy.spatial import cKDTree

from solidsph.interfaces.body import Body
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.formulation import Formulation
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.terms import Constraint, Load, StressTerm, SurfaceLoad
from solidsph.model.particles import Particles
from solidsph.scene.scene_data import SceneData


def check_effects(effects: Mapping[str, Effect], scene: SceneData) -> Iterator[str]:
    """Yield effects that break bonds, beside others on initial pairs or in [statics]."""
    breaking = [label for label, effect in effects.items() if effect.breaks_bonds]
    if breaking and scene.statics is not None:
        yield (
            f"{breaking[0]!r} breaks bonds one after the other, but [statics] finds equilibria "
            "between which none breaks; leave out [statics], load slowly and add 'mass-damping'"
        )
    bound = [label for label, effect in effects.items() if effect.uses_initial_pairs]
    if breaking and bound:
        yield (
            f"{breaking[0]!r} breaks bonds between neighbours, but {bound[0]!r} acts on the "
            "initial pairs even where they are broken; leave out one of the two"
        )


def check_history(bodies: Sequence[Body], labels: Collection[str]) -> Iterator[str]:
    """Yield labels that hide the account of history materials."""
    if "history" in labels and any(isinstance(b.material, HistoryMaterial) for b in bodies):
        yield "the label 'history' is used for history materials; choose another"


def check_constraints(constraints: Sequence[Constraint], particles: Particles) -> Iterator[str]:
    """Yield degrees of freedom that are determined twice, and ghosts without a motion."""
    # By degree of freedom: index of the first constraint that determines it, or -1.
    first = np.full(particles.positions.shape, -1)
    for index, constraint in enumerate(constraints):
        entries = np.nonzero(constraint.held)
        owners = first[entries]
        for other in np.unique(owners[owners >= 0]).tolist():
            shared, axes = (numbers[owners == other] for numbers in entries)
            yield (
                f"{constraint.label!r} and {constraints[other].label!r} both determine the motion "
                f"of {len(np.unique(shared))} particles (the first: {shared[0]}, along "
                f"{'xyz'[axes[0]]}); narrow the `where` of one"
            )
        free = owners < 0
        first[tuple(numbers[free] for numbers in entries)] = index
    adrift = particles.ghosts & (first < 0).any(axis=1)
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


def check_loads(
    loads: Sequence[Load], particles: Particles, formulation: Formulation
) -> Iterator[str]:
    """Yield loads on a surface through which ghosts carry stress."""
    if not (formulation.divergence.uses_ghost_stress and particles.ghosts.any()):
        return
    beyond = particles.positions - particles.images  # along the outward normal
    for load in loads:
        if not isinstance(load, SurfaceLoad):
            continue
        areas = particles.area_vectors[load.particles]
        tree = cKDTree(particles.positions[load.particles])
        distances, nearest = tree.query(particles.positions[particles.ghosts])
        facing = np.einsum("gi,gi->g", beyond[particles.ghosts], areas[nearest])
        sizes = np.linalg.norm(beyond[particles.ghosts], axis=1)
        sizes *= np.linalg.norm(areas[nearest], axis=1)
        spacing = particles.spacings[particles.ghosts]
        if np.any((distances < 1.5 * spacing) & (facing > 0.9 * sizes)):
            yield (
                f"{load.label!r} loads a surface through which ghosts carry the stress "
                f"(divergence {type(formulation.divergence).__name__}), so nothing would balance "
                "it; impose the traction with 'approximate-neumann', or leave these ghosts out"
            )


def check_stresses(stresses: Sequence[StressTerm], formulation: Formulation) -> Iterator[str]:
    """Yield stresses imposed on ghosts that the formulation does not use."""
    if formulation.divergence.uses_ghost_stress:
        return
    for term in stresses:
        if not isinstance(term, Constraint):
            yield (
                f"{term.label!r} sets the stress of ghosts, which the formulation's "
                f"divergence ({type(formulation.divergence).__name__}) does not use; take "
                "divergence = 'plain', or load the surface with 'traction'"
            )
