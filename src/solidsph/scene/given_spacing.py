"""The spacing of a body whose particles come with it: `spacing = "given"`."""

from __future__ import annotations

from solidsph.errors import SceneError
from solidsph.interfaces.graded_discretisation import GradedDiscretisation
from solidsph.interfaces.shape import Shape
from solidsph.model.spacing import SpacingField
from solidsph.registry.construct import construct
from solidsph.scene.scene_data import BodyScene

GIVEN = "given"
"""What such a body says instead of a spacing."""


def check_given(body: BodyScene) -> None:
    """Raise SceneError if such a body is also to be refined."""
    if body.refine:
        raise SceneError(
            f"refine makes a spacing finer, and spacing = {GIVEN!r} is that of particles that are "
            "there already; leave refine out"
        )


def given_field(body: BodyScene, shape: Shape) -> SpacingField:
    """The spacing that the body's particles come with.

    Raises:
        SceneError: they come without, or it cannot be read or does not suit a body.
    """
    check_given(body)
    part = construct("discretisations", body.discretisation) if body.discretisation else None
    own = part.own_spacing(shape) if isinstance(part, GradedDiscretisation) else None
    if own is None:
        raise SceneError(
            f"spacing = {GIVEN!r} needs particles that come with spacings, such as 'points' with a "
            "column 'spacing'; add it, or give a spacing in m"
        )
    return own


def given_scaled(body: BodyScene, factor: float) -> BodyScene:
    """The body itself, if its spacing is not to change.

    Raises:
        SceneError: it is.
    """
    if factor == 1.0:
        return body
    raise SceneError(
        f"spacing = {GIVEN!r} is that of particles that are there already, and cannot be "
        f"{factor:g} times as large; give a spacing in m, and a discretisation that follows it"
    )
