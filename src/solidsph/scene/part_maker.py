"""PartMaker: construction of the parts that a scene names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import attrs
import numpy as np

from solidsph.errors import SceneError, SolidsphError
from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.engine import Engine
from solidsph.interfaces.formulation import Formulation
from solidsph.interfaces.graded_discretisation import GradedDiscretisation
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
from solidsph.scene.checks.numbers import check_numbers
from solidsph.scene.checks.returned import check_particles
from solidsph.scene.checks.terms import check_effects
from solidsph.scene.default_cover import cover_of
from solidsph.scene.graded_spacing import (
    check_words,
    is_graded,
    predicted_count,
    spacing_field,
)
from solidsph.scene.scene_data import (
    RECOMMENDED,
    BodyScene,
    ImposedScene,
    PartLike,
    SceneData,
)
from solidsph.scene.scheme import completed
from solidsph.system.build_log import BUILD

# Up to this number, particles of a scene with mistakes are made to check its places too.
_FEW = 1e6

# Names of columns begin with labels, and HDF5 stores all of them in one header of 64 kB.
_LONGEST_LABEL = 200


@attrs.frozen(eq=False)
class Parts:
    """Parts of a scene; None, or missing in a mapping, where a part could not be made."""

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
    probes: Sequence[Any] = ()


class PartMaker:
    """Makes the parts of one scene and collects their mistakes in `problems`."""

    def __init__(self, scene: SceneData) -> None:
        self._scene = scene
        self.labels: set[str] = set()  # of the accounts of boundaries and effects
        self._repeated: dict[str, int] = {}  # number of parts with a label
        self.used: dict[registry.Entry, None] = {}  # plugins in the order of their first use
        self.foreign: list[tuple[str, Any]] = []  # kind and part of third parties
        self.problems = Problems(self.used.keys())

    def parts(self) -> Parts:
        """All parts of the scene."""
        problems = self.problems
        problems.add(check_numbers(self._scene))
        scene = problems.attempt(completed, self._scene)
        if scene is None:  # with any scheme its own parts are checked
            scene = completed(attrs.evolve(self._scene, scheme=RECOMMENDED))
        self._scene = scene
        kernel = self._make("kernels", scene.kernel)
        cover = None if kernel is None else problems.attempt(cover_of, scene)
        formulation = self._make("formulations", scene.formulation)
        integrator = self._integrator()
        engine = self._engine()
        handlers = self._labelled("boundaries", scene.boundaries)
        effects = self._labelled("effects", scene.effects)
        problems.add(check_effects(effects, scene))
        bodies, probes = self._body_parts(), self._probes()
        return Parts(
            kernel, cover, formulation, integrator, engine, handlers, effects, *bodies, probes
        )

    def _make(self, kind: str, wanted: PartLike) -> Any:
        part = self.problems.attempt(construct, kind, wanted)
        if part is not None:
            self._note(kind, part)
        return part

    def _integrator(self) -> Any:
        """The integrator, or the default, which does not count as used in statics."""
        if self._scene.statics is None:
            return self._make("integrators", self._scene.integrator)
        return self.problems.attempt(construct, "integrators", self._scene.integrator)

    def _engine(self) -> Any:
        """The engine. Built-in ones do not count as used, since they change no result."""
        engine = self.problems.attempt(construct, "engines", self._scene.engine)
        if engine is not None and is_foreign(registry.entry_of("engines", engine)):
            self._note("engines", engine)
        return engine

    def _note(self, kind: str, part: Any) -> None:
        """Note the plugins of a part and of the parts nested in it."""
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
                for inner in value if isinstance(value, (list, tuple)) else [value]:
                    self._note(nested, inner)

    def _labelled(self, kind: str, entries: Sequence[ImposedScene]) -> dict[str, Any]:
        """Parts by the label of their account: the given one, or their name and place."""
        parts: dict[str, Any] = {}
        for entry in entries:
            part = self._make(kind, entry.part)
            if part is not None:
                self.problems.add(self._label_problems(entry.label))
                label = entry.label or _default_label(kind, part)[:_LONGEST_LABEL]
                if not label.isprintable():
                    self.problems.add([f"label {label!r} has unprintable characters; remove them"])
                label = self._unused(label)
                self.labels.add(label)
                parts[label] = part
        return parts

    def _label_problems(self, label: str | None) -> Iterator[str]:
        if label is None:
            return
        if not label.strip():
            yield "a label is empty; leave it out, or describe the part"
        if len(label) > _LONGEST_LABEL:
            yield f"a label has {len(label)} characters; at most {_LONGEST_LABEL} are allowed"
        if label in self.labels and label:
            yield f"two accounts are labelled {label!r}; give each its own label"

    def _unused(self, label: str) -> str:
        """The label, with a prime or a number from 3 on if it is taken."""
        if label not in self.labels:
            return label
        count = self._repeated[label] = self._repeated.get(label, 1) + 1
        candidate = f"{label}'" if count == 2 else f"{label} {count}"
        return candidate if candidate not in self.labels else self._unused(label)

    def _probes(self) -> Sequence[Any]:
        """Probes, not yet bound to bodies."""
        if not self._scene.probes:
            return ()
        from solidsph.probes.words import probe_of  # loaded only for [[probe]]

        labels: set[str] = set()
        probes = []
        for entry in self._scene.probes:
            label = entry.label
            if not isinstance(label, str) or not label.strip() or not label.isprintable():
                self.problems.add(
                    [f"a probe has no label; add label = ..., its columns' name, got {label!r}"]
                )
                continue
            if len(label) > _LONGEST_LABEL:
                self.problems.add([f"a probe's label has over {_LONGEST_LABEL} characters"])
            if label in labels:
                self.problems.add([f"two probes are labelled {label!r}; give each its own label"])
            labels.add(label)
            words = attrs.asdict(entry, recurse=False)
            del words["label"]
            probes.append(self.problems.attempt(probe_of, label, words))
        return [probe for probe in probes if probe is not None]

    def _body_parts(
        self,
    ) -> tuple[dict[str, Shape], dict[str, Material], dict[str, Particles]]:
        """Shapes, materials and particles of all bodies, by name."""
        shapes: dict[str, Shape] = {}
        materials: dict[str, Material] = {}
        discretisations: dict[str, Discretisation] = {}
        bodies = self._scene.bodies
        for name, body in bodies.items():
            readable = self.problems.attempt(_readable, name, body)
            shape = self._make("shapes", body.shape)
            discretisation = self._make("discretisations", body.discretisation)
            material = self._material(name, body)
            if material is not None:
                materials[name] = material
            if shape is not None:
                shapes[name] = shape
                if discretisation is not None and readable:
                    discretisations[name] = discretisation
        if not bodies and self._scene.material is not None:
            self._make("materials", self._scene.material)  # unused, but it may have mistakes too
        if self.problems.found and not all(_is_few(shapes[name], bodies[name]) for name in shapes):
            return shapes, materials, {}
        sets: dict[str, Particles] = {}
        for name, discretisation in discretisations.items():
            shape = shapes[name]
            own = self.problems.attempt(_particles_of, name, bodies[name], discretisation, shape)
            if own is not None:
                wrong = list(check_particles(discretisation, own, shape.dimension))
                self.problems.add(wrong)
                if not wrong:
                    sets[name] = own
        return shapes, materials, sets

    def _material(self, name: str, body: BodyScene) -> Any:
        wanted = body.material if body.material is not None else self._scene.material
        if wanted is not None:
            return self._make("materials", wanted)
        self.problems.add([f"body {name!r} has no material; add one to it, or to the scene"])
        return None


def _readable(name: str, body: BodyScene) -> bool:
    """True; raises SceneError if the spacing of a body has mistakes."""
    try:
        check_words(body)
    except SceneError as cause:
        raise SceneError(f"body {name!r}: {cause}") from None
    return True


def _particles_of(
    name: str, body: BodyScene, discretisation: Discretisation, shape: Shape
) -> Particles:
    BUILD.info("body %r: particles", name)
    if not is_graded(body):
        return discretisation.particles(shape, body.spacing)  # type: ignore[arg-type]
    if not isinstance(discretisation, GradedDiscretisation):
        raise SceneError(
            f"body {name!r}: its spacing varies, which the discretisation "
            f"{registry.entry_of('discretisations', discretisation).name!r} does not follow; use "
            f"{' or '.join(map(repr, _graded_names()))}, or one number"
        )
    try:
        return discretisation.graded_particles(shape, spacing_field(body, shape))
    except SceneError as cause:
        raise SceneError(f"body {name!r}: {cause}") from None


def _graded_names() -> list[str]:
    """Names of the discretisations that follow a spacing that varies."""
    names = []
    for name in registry.names("discretisations"):
        with suppress(SolidsphError):
            if issubclass(registry.load("discretisations", name), GradedDiscretisation):
                names.append(name)
    return names


def _is_few(shape: Shape, body: BodyScene) -> bool:
    if is_graded(body):
        with suppress(SolidsphError):
            return predicted_count(spacing_field(body, shape), shape) < _FEW
        return True  # it is refused at once
    spacing = body.spacing
    if not isinstance(spacing, (int, float)) or not spacing > 0.0:
        return True  # the discretisation refuses it at once
    lower, upper = shape.bounds()
    with np.errstate(all="ignore"):
        return bool(np.prod((upper - lower) / spacing) < _FEW)


def _default_label(kind: str, part: object) -> str:
    name = registry.entry_of(kind, part).name or type(part).__name__
    where = getattr(part, "where", None)
    if isinstance(where, str) and where not in (EVERYWHERE, "ghosts"):
        return f"{name} {where}"
    return name
