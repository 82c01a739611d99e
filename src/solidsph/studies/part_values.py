"""Whether the parts that a scene names can be made, before anything is built or run."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.errors import SceneError
from solidsph.registry.construct import construct
from solidsph.scene.checks.numbers import check_numbers
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import PartLike


def check_parts(scene: Scene, what: str) -> None:
    """Make every part that a scene names, without bodies and neighbours.

    Args:
        scene: of a sweep, for example.
        what: how it came about, for the message.

    Raises:
        SceneError: a part is unknown or has wrong parameters, or a number is wrong.
    """
    try:
        for kind, part in named_parts(scene):
            construct(kind, part)
    except SceneError as cause:
        raise SceneError(f"{what}: {cause}") from None
    for problem in check_numbers(scene):
        raise SceneError(f"{what}: {problem}")


def named_parts(scene: Scene) -> Iterator[tuple[str, PartLike]]:
    """Kind and description of every part that a scene names, without those inside them."""
    several = [("boundaries", scene.boundaries), ("effects", scene.effects)]
    parts: list[tuple[str, PartLike | None]] = [
        ("kernels", scene.kernel),
        ("materials", scene.material),
        ("formulations", scene.formulation),
        ("integrators", scene.integrator),
        ("engines", scene.engine),
        *((kind, entry.part) for kind, entries in several for entry in entries),
    ]
    for body in scene.bodies.values():
        parts += [("shapes", body.shape), ("discretisations", body.discretisation)]
        parts += [("materials", body.material)]
    yield from ((kind, part) for kind, part in parts if part is not None)
