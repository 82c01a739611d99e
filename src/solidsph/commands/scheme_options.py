"""Options that describe a scheme: kernel, cover, formulation, operators, material and effects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import attrs
import click

from solidsph.commands.options import Command
from solidsph.commands.target import resolve
from solidsph.errors import SceneError
from solidsph.registry import registry

if TYPE_CHECKING:
    from solidsph.studies.scheme import Scheme


def _option(text: str, **settings: Any) -> Any:
    """A field that becomes an option of its name, with this help."""
    default = () if settings.get("multiple") else None
    return attrs.field(default=default, metadata={"metavar": "NAME", "help": text, **settings})


@attrs.frozen
class SchemeOptions:
    """Values of the options; those not given come from the scene, or are the defaults."""

    scheme: str | None = _option("Take the scheme of a scene or case.", metavar="SCENE|CASE")
    kernel: str | None = _option("Its kernel.")
    cover: float | None = _option("Its support radius.", type=float, metavar="SPACINGS")
    formulation: str | None = _option("Its formulation.")
    gradient: str | None = _option("The formulation's gradient.")
    divergence: str | None = _option("The formulation's divergence.")
    material: str | None = _option("A material, with typical parameters.")
    effect: tuple[str, ...] = _option("Add an effect, with typical parameters.", multiple=True)
    hourglass: float | None = _option("Add hourglass control.", type=float, metavar="STRENGTH")

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
        from solidsph.registry.construct import describe
        from solidsph.scene.default_cover import own_cover
        from solidsph.scene.scene import Scene
        from solidsph.studies.scheme import Scheme
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
            changes["cover"] = own_cover(changes["kernel"])
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


def scheme_options(command: Command) -> Command:
    """Decorator that adds an option for every field of `SchemeOptions`."""
    for field in reversed(attrs.fields(SchemeOptions)):
        command = click.option(f"--{field.name}", **field.metadata)(command)
    return command


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
