"""Where: which particles a boundary, an effect or an initial value is meant for."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from solidsph.arrays import Array, Indices, Mask
from solidsph.errors import SceneError
from solidsph.expressions import Expression, names_in
from solidsph.particles import Particles

Where: TypeAlias = str | Callable[[Array], Mask]
"""A tag ("left"), a condition on X, Y, Z and tags ("X < 0.1 and not ghosts"; in a condition a tag's
hyphens become underscores), or in Python a function from positions (n, d) to a mask (n,)."""

AXES = ("X", "Y", "Z")

EVERYWHERE = "all"
"""The tag that every particle but the ghosts carries."""


def select(particles: Particles, where: Where) -> Indices:
    """Indices of the particles at `where`, in rising order.

    Raises:
        SceneError: no particle is there, or `where` cannot be understood.
    """
    mask = _mask(particles, where)
    if not mask.any():
        lower, upper = particles.positions.min(axis=0), particles.positions.max(axis=0)
        span = " x ".join(f"[{a:.6g}, {b:.6g}]" for a, b in zip(lower, upper, strict=True))
        raise SceneError(f"{_described(where)} matches no particle; they fill {span} m")
    return np.flatnonzero(mask)


def _mask(particles: Particles, where: Where) -> Mask:
    if callable(where):
        mask = np.asarray(where(particles.positions))
        if mask.shape != (particles.count,) or mask.dtype != np.bool_:
            raise SceneError(
                f"{_described(where)} gave {mask.dtype} of shape {mask.shape}; expected one bool "
                f"for each of {particles.count} particles"
            )
        return mask
    if not isinstance(where, str):
        raise SceneError(f"where = {where!r} must be text: a tag or a condition, such as 'left'")
    if where == EVERYWHERE:
        return ~particles.ghosts
    if where in particles.tags:
        return particles.tags[where]
    if not any(mark in where for mark in "<>=() "):
        known = [EVERYWHERE, *particles.tags]
        near = difflib.get_close_matches(where, known, 1)
        hint = f"did you mean {near[0]!r}?" if near else f"known tags: {', '.join(known)}"
        raise SceneError(f"where = {where!r} is neither a tag nor a condition; {hint}")
    values: dict[str, Array | Mask] = {
        tag.replace("-", "_"): mask for tag, mask in particles.tags.items()
    }
    values |= {
        name: particles.positions[:, k] for k, name in enumerate(AXES[: particles.dimension])
    }
    expression = Expression.parse(where, [*values, "t"])
    if "t" in names_in(where):
        raise SceneError(
            f"where = {where!r} uses t, but particles are chosen once, before the "
            "run: use X, Y, Z and tags here, and t in the formula of what is imposed"
        )
    result = np.asarray(expression(values))
    if result.dtype != np.bool_:
        raise SceneError(f"where = {where!r} is a number, not a condition; compare it: '... < 0.1'")
    return np.broadcast_to(result, (particles.count,))


def _described(where: Where) -> str:
    return f"where = {where!r}" if isinstance(where, str) else f"where = {where}"
