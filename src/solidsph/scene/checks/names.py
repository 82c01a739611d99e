"""Checks of the names of bodies, tags and faces."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from keyword import iskeyword

from solidsph.model.particles import Particles
from solidsph.model.regions import EVERYWHERE, SYMBOLS, variable


class ParticleSetNames:
    """Names of sets of particles, compared as conditions write them."""

    def __init__(self, names: Iterable[str] = ()) -> None:
        self._by_variable = {variable(name): name for name in (EVERYWHERE, *names)}

    def add(self, name: str) -> None:
        """Add `name` unless a similar one is present."""
        self._by_variable.setdefault(variable(name), name)

    def similar(self, name: str) -> str:
        """The present name that a condition writes like `name`; empty if there is none."""
        return self._by_variable.get(variable(name), "")

    def problem(self, name: str) -> str:
        """Problem of a new body or tag called `name`, with its remedy; empty if there is none."""
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", name):
            return (
                "must begin with a letter and contain only letters, digits, '-' and '_'; change it"
            )
        if variable(name) in SYMBOLS:
            return "is a variable or constant of formulas; choose another"
        if iskeyword(variable(name)):
            return "is a keyword of Python, so no condition could contain it; choose another"
        similar = self.similar(name)
        if similar == name:
            return "names a set of particles already; choose another"
        if similar:
            return (
                f"is the same as {similar!r} in a condition, where both are written "
                f"{variable(name)!r}; choose another"
            )
        return ""


def check_names(bodies: Mapping[str, Particles]) -> Iterator[str]:
    """Yield names of bodies, tags and faces that a condition could not distinguish."""
    names = ParticleSetNames()
    tags = list(dict.fromkeys(tag for b in bodies.values() for tag in (*b.tags, *b.faces)))
    for tag in tags:
        if names.similar(tag) or variable(tag) in SYMBOLS or iskeyword(variable(tag)):
            yield f"the face or tag {tag!r} {names.problem(tag)}"
        names.add(tag)
    for name in bodies:
        problem = names.problem(name)
        if problem:
            yield f"body {name!r}: its name {problem}"
        names.add(name)
        longer = [tag for tag in tags if variable(tag).startswith(f"{variable(name)}.")]
        if longer:
            yield (
                f"body {name!r}: its name is that of a part with the face {longer[0]!r}; choose "
                "another"
            )
