"""Options that describe a scheme: kernel, cover, formulation, operators, material and effects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs

from solidsph.commands.options import option
from solidsph.commands.target import resolve
from solidsph.errors import SceneError
from solidsph.registry import registry
from solidsph.registry.construct import describe
from solidsph.scene.default_cover import kernel_cover
from solidsph.scene.scene import Scene
from solidsph.studies.scheme import Scheme


@attrs.frozen
class SchemeOptions:
    """Values of the options; those not given come from the scene, or are the defaults."""

    scheme: str | None = option("Take the scheme of a scene or case.", metavar="SCENE|CASE")
    kernel: str | None = option("Kernel of the scheme.", metavar="NAME")
    cover: float | None = option("Support radius of the scheme.", type=float, metavar="SPACINGS")
    formulation: str | None = option("Formulation of the scheme.", metavar="NAME")
    gradient: str | None = option("Gradient of its formulation.", metavar="NAME")
    divergence: str | None = option("Divergence of its formulation.", metavar="NAME")
    material: str | None = option(
        "Material of the scheme, with typical parameters.", metavar="NAME"
    )
    effect: tuple[str, ...] = option(
        "Add an effect, with typical parameters.", multiple=True, metavar="NAME"
    )
    hourglass: float | None = option("Add hourglass control.", type=float, metavar="STRENGTH")

    @property
    def given(self) -> bool:
        """Whether any option is given."""
        return self != SchemeOptions()

    def build(self, settings: Sequence[str] = ()) -> Scheme:
        """The scheme.

        Args:
            settings: parameters of the case that it is taken from, as "name=value".

        Raises:
            SceneError: there is no such scene, case or part.
        """
        from solidsph.testing import example_part

        scheme = Scheme()
        if self.scheme is not None:
            target = resolve(self.scheme, settings)
            scene = target if isinstance(target, Scene) else next(iter(target.scenes().values()))
            scheme = Scheme.of(scene)
        elif settings:
            raise SceneError("--set changes the parameters of a part or of a case; name one")
        changes: dict[str, Any] = {}
        if self.kernel is not None:
            changes["kernel"] = example_part("kernels", self.kernel)
            changes["cover"] = kernel_cover(changes["kernel"])
        if self.cover is not None:
            changes["cover"] = self.cover
        if self.material is not None:
            changes["material"] = example_part("materials", self.material)
        operators = {"gradient": self.gradient, "divergence": self.divergence}
        operators = {kind: name for kind, name in operators.items() if name is not None}
        if self.formulation is not None:
            changes["formulation"] = {"type": self.formulation, **operators}
        elif operators:
            changes["formulation"] = {**describe("formulations", scheme.formulation), **operators}
        effects = [example_part("effects", name) for name in self.effect]
        if self.hourglass is not None:
            effects.append({"type": "hourglass-control", "strength": self.hourglass})
        return attrs.evolve(scheme, effects=(*scheme.effects, *effects), **changes)


def part_name(kind: str, part: object) -> str:
    """Registered name of a part, or its class where it has none."""
    if isinstance(part, str):
        return part
    return registry.entry_of(kind, part).name or type(part).__name__


def scheme_name(scheme: Scheme) -> str:
    """Parts of a scheme in one line, without its cover, formulation and effects."""
    formulation = scheme.formulation
    return (
        f"{part_name('kernels', scheme.kernel)}, "
        f"{part_name('gradients', formulation.gradient)} gradient, "
        f"{part_name('divergences', formulation.divergence)} divergence, "
        f"{part_name('materials', scheme.material)}"
    )
