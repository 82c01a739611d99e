"""PartMaker: the parts that the names of a scene stand for, as far as they can be understood."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.engine import Engine
from solidsph.interfaces.formulation import Formulation
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.material import Material
from solidsph.interfaces.shape import Shape
from solidsph.model.particles import Particles
from solidsph.model.regions import EVERYWHERE
from solidsph.registry import registry
from solidsph.registry.construct import construct
from solidsph.registry.origin import is_foreign
from solidsph.registry.problems import Problems
from solidsph.scene import compatibility, returned_values
from solidsph.scene.default_cover import cover_of
from solidsph.scene.scene_data import (
    DEFAULT_INTEGRATOR,
    BodyScene,
    ImposedScene,
    PartLike,
    SceneData,
)

# Particles that are soon made, to see what is wrong with places in a scene that is wrong anyway.
_SOON_MADE = 1e6

# Names of columns begin with labels, and HDF5 keeps all of them in one header of 64 kB.
_LONGEST_LABEL = 200


@attrs.frozen(eq=False)
class Parts:
    """What the names of a scene stand for; None where a name could not be understood."""

    kernel: Kernel | None
    cover: float | None  # support radius [spacings]
    formulation: Formulation | None
    integrator: Integrator | None
    engine: Engine | None
    handlers: Mapping[str, Any]
    effects: Mapping[str, Effect]
    shapes: Mapping[str, Shape]
    materials: Mapping[str, Material]
    sets: Mapping[str, Particles]


class PartMaker:
    """Makes the parts of one scene, and notes what is wrong with them among its `problems`."""

    def __init__(self, scene: SceneData) -> None:
        self._scene = scene
        self.labels: set[str] = set()  # of the accounts of boundaries and effects
        self._repeated: dict[str, int] = {}  # how often a label was wanted
        self.used: dict[registry.Entry, None] = {}  # plugins in the order of their use, each once
        self.foreign: list[tuple[str, Any]] = []  # kind and part, of those that are not our own
        self.problems = Problems(self.used.keys())

    def parts(self) -> Parts:
        """All of them."""
        scene, problems = self._scene, self.problems
        problems.add(compatibility.numbers(scene))
        problems.add(compatibility.statics(scene))
        problems.add(compatibility.sleep(scene))
        kernel: Kernel | None = self._make("kernels", scene.kernel)
        cover = None if kernel is None else problems.attempt(cover_of, scene)
        formulation: Formulation | None = self._make("formulations", scene.formulation)
        integrator = self._integrator()
        engine: Engine | None = self._engine()
        handlers = self._labelled("boundaries", scene.boundaries)
        effects: dict[str, Effect] = self._labelled("effects", scene.effects)
        problems.add(compatibility.effects(effects))
        shapes, materials, sets = self._body_parts()
        return Parts(
            kernel,
            cover,
            formulation,
            integrator,
            engine,
            handlers,
            effects,
            shapes,
            materials,
            sets,
        )

    def _make(self, kind: str, wanted: PartLike) -> Any:
        part = self.problems.attempt(construct, kind, wanted)
        if part is not None:
            self._note(kind, part)
        return part

    def _integrator(self) -> Integrator | None:
        """The scene's, or the default, which is not noted where nothing will move by it."""
        made: Integrator | None = (
            self._make("integrators", self._scene.integrator or DEFAULT_INTEGRATOR)
            if self._scene.statics is None
            else self.problems.attempt(construct, "integrators", DEFAULT_INTEGRATOR)
        )
        return made

    def _engine(self) -> Engine | None:
        """The scene's; the built-in ones change no result, and are not noted."""
        engine: Engine | None = self.problems.attempt(construct, "engines", self._scene.engine)
        if engine is not None and is_foreign(registry.entry_of("engines", engine)):
            self._note("engines", engine)
        return engine

    def _note(self, kind: str, part: Any) -> None:
        """Remember which plugins a part, and the parts inside it, came from."""
        entry = registry.entry_of(kind, part)
        self.used[entry] = None
        if is_foreign(entry):
            self.foreign.append((kind, part))
        if not attrs.has(type(part)):
            return
        for field in attrs.fields(type(part)):
            nested = field.metadata.get("part")
            if nested is not None:
                value = getattr(part, field.name)
                for one in value if isinstance(value, (list, tuple)) else [value]:
                    self._note(nested, one)

    def _labelled(self, kind: str, entries: Sequence[ImposedScene]) -> dict[str, Any]:
        """Parts by the label of their account: the one given, or one made of name and place."""
        made: dict[str, Any] = {}
        for entry in entries:
            part = self._make(kind, entry.part)
            if part is None:
                continue
            if entry.label is not None and not entry.label.strip():
                self.problems.add(["a label is empty; leave it out, or say what it is of"])
            if len(entry.label or "") > _LONGEST_LABEL:
                self.problems.add(
                    [f"a label has {len(entry.label or '')} signs, at most {_LONGEST_LABEL} fit"]
                )
            label = entry.label or _label(kind, part)[:_LONGEST_LABEL]
            if not label.isprintable():
                self.problems.add([f"label {label!r} has signs that cannot be shown; use others"])
            if label in self.labels and entry.label:
                self.problems.add(
                    [f"two accounts are labelled {label!r}; give each a label of its own"]
                )
            label = self._free(label)
            self.labels.add(label)
            made[label] = part
        return made

    def _free(self, label: str) -> str:
        """The label, with a prime if it is taken, or with the first number from 3 on."""
        if label not in self.labels:
            return label
        count = self._repeated[label] = self._repeated.get(label, 1) + 1
        candidate = f"{label}'" if count == 2 else f"{label} {count}"
        return candidate if candidate not in self.labels else self._free(label)

    def _body_parts(
        self,
    ) -> tuple[dict[str, Shape], dict[str, Material], dict[str, Particles]]:
        """Shape, material and particles of every body, by its name."""
        shapes: dict[str, Shape] = {}
        materials: dict[str, Material] = {}
        made: dict[str, Discretisation] = {}
        bodies = self._scene.bodies
        for name, body in bodies.items():
            shape: Shape | None = self._make("shapes", body.shape)
            discretisation: Discretisation | None = self._make(
                "discretisations", body.discretisation
            )
            material = self._material(name, body)
            if material is not None:
                materials[name] = material
            if shape is not None:
                shapes[name] = shape
                if discretisation is not None:
                    made[name] = discretisation
        if not bodies and self._scene.material is not None:
            self._make("materials", self._scene.material)  # of no use, but it may be wrong too
        if self.problems.found and not all(
            _soon_made(shape, bodies[name].spacing) for name, shape in shapes.items()
        ):
            return shapes, materials, {}
        sets: dict[str, Particles] = {}
        for name, one in made.items():
            shape = shapes[name]
            own = self.problems.attempt(one.particles, shape, bodies[name].spacing)
            if own is None:
                continue
            wrong = list(returned_values.particles(one, own, shape.dimension))
            self.problems.add(wrong)
            if not wrong:
                sets[name] = own
        return shapes, materials, sets

    def _material(self, name: str, body: BodyScene) -> Material | None:
        wanted = body.material if body.material is not None else self._scene.material
        if wanted is None:
            self.problems.add(
                [f"body {name!r} has no material; give it one, or one to the whole scene"]
            )
            return None
        material: Material | None = self._make("materials", wanted)
        return material


def _soon_made(shape: Shape, spacing: object) -> bool:
    if not isinstance(spacing, (int, float)) or not spacing > 0.0:
        return True  # it is refused at once
    lower, upper = shape.bounds()
    with np.errstate(all="ignore"):
        return bool(np.prod((upper - lower) / spacing) < _SOON_MADE)


def _label(kind: str, part: object) -> str:
    name = registry.entry_of(kind, part).name or type(part).__name__
    where = getattr(part, "where", None)
    if isinstance(where, str) and where not in (EVERYWHERE, "ghosts"):
        return f"{name} {where}"
    return name
