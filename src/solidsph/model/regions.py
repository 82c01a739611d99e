"""Regions: the particles to which a boundary, an effect or an initial value applies."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from keyword import iskeyword
from typing import TypeAlias

import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.maths.formulas import Expression, names_in
from solidsph.model.particles import Particles

Where: TypeAlias = str | Callable[[Array], Mask]
"""A tag ("left"), a tag of one body ("two.left"), a condition on X, Y, Z and tags
("X < 0.1 and not ghosts"), or in Python a function from positions (n, d) to a mask (n,)."""

AXES = ("X", "Y", "Z")

SYMBOLS = (*AXES, "t", "pi", "e")
"""What is a number in formulas."""

EVERYWHERE = "all"
"""The tag of every particle except the ghosts."""

# Names that a message lists.
_LISTED = 10

# Tags of every body, even if no particle has them.
_OF_EVERY_BODY = (EVERYWHERE, "surface", "interior", "ghosts")

_HYPHENATED = re.compile(r"(?<![\w.])[A-Za-z]\w*(?:-\w+)+")
# The tag of a body may have a dot itself: two.hole.rim.
_LIKE_OF_A_BODY = re.compile(r"(?<![\w.-])([A-Za-z][\w-]*)\.([A-Za-z][\w-]*(?:\.[A-Za-z][\w-]*)?)")
_OF_A_BODY = re.compile(r"(?<![\w.])([A-Za-z_]\w*)\.([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)?)")


def select(particles: Particles, where: Where) -> Indices:
    """Indices of the particles at `where`, in rising order.

    Raises:
        SceneError: no particle matches, or `where` cannot be understood.
    """
    mask = holds(particles, where, lambda tag: _tagged(particles, tag))
    if not mask.any():
        lower, upper = particles.positions.min(axis=0), particles.positions.max(axis=0)
        span = " x ".join(f"[{a:.6g}, {b:.6g}]" for a, b in zip(lower, upper, strict=True))
        raise SceneError(f"{described(where)} matches no particle; they fill {span} m")
    return np.flatnonzero(mask)


def holds(
    particles: Particles,
    where: Where,
    tagged: Callable[[str], Mask],
    owners: Indices | slice = slice(None),
) -> Mask:
    """Whether `where` holds at each of k places, (k,).

    A place is a particle, or a piece of the surface that a particle owns.

    Args:
        particles: those of all bodies.
        where: the condition.
        tagged: gives the places with a tag, (k,).
        owners: the particle of each place, (k,); by default the particles themselves.

    Raises:
        SceneError: `where` cannot be understood.
    """
    if callable(where):
        mask = np.asarray(where(particles.positions))
        if mask.shape != (particles.count,) or mask.dtype != np.bool_:
            raise SceneError(
                f"{described(where)} gave {mask.dtype} of shape {mask.shape}; expected one bool "
                f"for each of {particles.count} particles"
            )
        return np.asarray(mask[owners])
    if not isinstance(where, str):
        raise SceneError(f"where = {where!r} must be text: a tag or a condition, such as 'left'")
    if where == EVERYWHERE or where in particles.tags:
        return tagged(where)
    tags = _by_variable(_known(particles))
    extents, bodies = particles.bodies, _by_variable(particles.bodies)
    text = as_formula(particles, where)
    values: dict[str, Array | Mask] = {
        f"{body}.{tag}": _mask(particles, extents[bodies[body]])[owners] & tagged(tags[tag])
        for body, tag in _of_bodies(particles, where, text, bodies, tags)
    }
    if text not in tags and text not in values and not any(mark in where for mark in "<>=() "):
        _check_names(particles, where)
    axes = AXES[: particles.dimension]
    try:
        formula = Expression.parse(text, [*tags, *axes, *values, "t"], [*tags, *values])
    except SceneError:
        _check_names(particles, where)
        raise
    used = names_in(text)
    if "t" in used:
        raise SceneError(
            f"where = {where!r} uses t, but particles are chosen once, before the run: use X, Y, "
            "Z and tags here, and t in the formula of what is imposed"
        )
    used |= {f"{part}.{face}" for part, face in _OF_A_BODY.findall(text)}
    values |= {name: tagged(tag) for name, tag in tags.items() if name in used}
    values |= {name: particles.positions[owners, k] for k, name in enumerate(axes)}
    result = np.asarray(formula(values))
    if result.dtype != np.bool_:
        raise SceneError(f"where = {where!r} is a number, not a condition; compare it: '... < 0.1'")
    return np.broadcast_to(result, values[axes[0]].shape)


def _of_bodies(
    particles: Particles,
    where: str,
    text: str,
    bodies: Mapping[str, str],
    tags: Mapping[str, str],
) -> list[tuple[str, str]]:
    """Bodies and their tags that a formula names, as variables; names of no body are skipped."""
    for body, tag in _LIKE_OF_A_BODY.findall(text):
        if body in bodies:
            _check_of_body(particles, where, bodies[body], tags.get(tag, tag))
    return [(body, tag) for body, tag in _OF_A_BODY.findall(text) if body in bodies]


def _mask(particles: Particles, members: Indices | slice) -> Mask:
    mask = np.zeros(particles.count, dtype=np.bool_)
    mask[members] = True
    return mask


def names_used(particles: Particles, where: str) -> frozenset[str]:
    """Names in a valid condition: coordinates, tags, and tags of a body."""
    text = as_formula(particles, where)
    tags = _by_variable(_known(particles))
    found = (f"{body}.{tag}" for body, tag in _OF_A_BODY.findall(text))
    dotted = {tags.get(name, name) for name in found}
    return frozenset(tags.get(name, name) for name in names_in(text)) | dotted


def variable(name: str) -> str:
    """The name of a tag or a body in a condition: with underscores for hyphens."""
    return name.replace("-", "_")


def as_formula(particles: Particles, where: str) -> str:
    """`where` with underscores for the hyphens in names of tags and bodies.

    In "plate-1 and X < 9", plate-1 is a tag and not a difference; in X-1, X is the coordinate.

    Raises:
        SceneError: a word begins like a tag, and is not one.
    """
    words = {*particles.bodies, *(word for tag in _known(particles) for word in tag.split("."))}

    def renamed(found: re.Match[str]) -> str:
        parts = found.group().split("-")
        if parts[0] in SYMBOLS:
            return found.group()
        for count in range(len(parts), 1, -1):
            name = "-".join(parts[:count])
            if name in words:
                return "-".join([variable(name), *parts[count:]])
        if parts[0] in particles.tags:
            raise _no_tag(particles, where, found.group())  # sets have no difference
        return found.group()

    # The part behind the dot of "two.edge-0" is treated by itself.
    return ".".join(_HYPHENATED.sub(renamed, part) for part in where.strip().split("."))


def is_reserved(name: str) -> bool:
    """True if `name` means something else than a face in every condition."""
    word = variable(name)
    return word in (*SYMBOLS, *_OF_EVERY_BODY) or iskeyword(word)


def described(where: Where) -> str:
    """`where` as errors show it."""
    return f"where = {where!r}" if isinstance(where, str) else f"where = {where}"


def _known(particles: Particles) -> list[str]:
    """Names of all sets of particles."""
    return list(dict.fromkeys((EVERYWHERE, *particles.tags, *particles.faces)))


def _by_variable(names: Collection[str]) -> dict[str, str]:
    return {variable(name): name for name in names}


def _tagged(particles: Particles, tag: str) -> Mask:
    if tag == EVERYWHERE:
        return ~particles.ghosts
    if tag in particles.tags:
        return particles.tags[tag]
    return _mask(particles, particles.faces[tag].particles)


def _check_names(particles: Particles, where: str) -> None:
    """Raise SceneError if a condition that cannot be read names an unknown body or tag."""
    tags = _by_variable(_known(particles))
    for body, tag in _LIKE_OF_A_BODY.findall(where):
        if variable(f"{body}.{tag}") not in tags:
            _check_of_body(particles, where, body, tag)
    if not any(mark in where for mark in "<>=() "):
        raise _no_tag(particles, where, where)


def _no_tag(particles: Particles, where: str, name: str) -> SceneError:
    known = _known(particles)
    near = difflib.get_close_matches(name, known, 1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    hint += f"known tags: {some_of(known)}"
    what = "" if name == where else f": {name!r}"
    return SceneError(f"where = {where!r}{what} is neither a tag nor a condition; {hint}")


def _check_of_body(particles: Particles, where: str, body: str, tag: str) -> None:
    """Raise SceneError unless there is such a body and it has such a tag."""
    if body not in particles.bodies:
        near = difflib.get_close_matches(body, particles.bodies, 1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        hint += f"bodies: {some_of(particles.bodies)}"
        raise SceneError(f"where = {where!r}: there is no body {body!r}; {hint}")
    tags = list(_of_body(particles, body))
    if tag not in tags:
        near = difflib.get_close_matches(tag, tags, 1)
        hint = f"did you mean '{body}.{near[0]}'? " if near else ""
        hint += f"it has {some_of(tags)}"
        raise SceneError(f"where = {where!r}: body {body!r} has no {tag!r}; {hint}")


def _of_body(particles: Particles, body: str) -> Iterator[str]:
    extent = particles.bodies[body]
    for tag in _known(particles):
        if tag in _OF_EVERY_BODY or _tagged(particles, tag)[extent].any():
            yield tag


def some_of(names: Collection[str]) -> str:
    """The first of several names for a message, and how many others there are."""
    listed = list(names)
    rest = f" and {len(listed) - _LISTED} more" if len(listed) > _LISTED else ""
    return ", ".join(listed[:_LISTED]) + rest
