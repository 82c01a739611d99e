"""Particles held at their reference positions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

import attrs

from solidsph.errors import SceneError
from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.terms import Term
from solidsph.model.fields import VectorField
from solidsph.model.regions import Where
from solidsph_builtin.boundaries._imposed import imposed_motion
from solidsph_builtin.boundaries._reports import COMPONENTS


@final
@attrs.frozen
class Clamp(BoundaryHandler):
    """u = 0 on the particles at `where`, along `axes` (all by default)."""

    where: Where
    axes: Sequence[str] | None = None  # such as ["x", "y"]

    example: ClassVar[Mapping[str, Any]] = {"where": "left"}

    def bind(self, model: DiscreteModel, label: str) -> Sequence[Term]:
        names = COMPONENTS[: model.particles.dimension]
        wanted = names if self.axes is None else self.axes
        if isinstance(wanted, str) or not isinstance(wanted, Sequence) or not wanted:
            raise SceneError(
                f'clamp: axes must be a list such as ["x"], got {wanted!r}; leave it out for all'
            )
        axes = tuple(wanted)
        for name in axes:
            if name not in names:
                raise SceneError(f"clamp: unknown axis {name!r}; this scene has {', '.join(names)}")
        field = VectorField({names.index(name): 0.0 for name in axes})
        indices = model.select(self.where)
        return [imposed_motion(model, label, indices, field, self.where)]
