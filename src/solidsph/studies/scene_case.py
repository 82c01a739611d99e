"""SceneCase: a scene of a user as a case, whose parameter is its spacing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import sqrt
from pathlib import Path
from typing import Any, final

import attrs

from solidsph.errors import SceneError, SolidsphError
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement
from solidsph.studies.quantity import Quantity, columns_of, one_quantity, quantities
from solidsph.studies.reference import Reference
from solidsph.studies.scene_words import changed, smallest_spacing

SPACING = "spacing"
"""The parameter that refines a scene."""

_NAME = "scene"

COARSER = (2.0, sqrt(2.0), 1.0)
"""Spacings of a sweep over that of a scene [-]."""

ABOUT = (sqrt(2.0), 1.0, sqrt(0.5))
"""Those for a scene whose own is as coarse as it should be [-]."""


@final
@attrs.frozen
class SceneCase(Case):
    """A scene, the quantities that matter in it, and what some of them should be.

    Without a reference its measurements have no error: `solidsph.studies.refinement` estimates it.
    """

    scene: Scene
    quantities: Sequence[Quantity]
    references: Sequence[Reference] = ()
    spacing: float = attrs.field()  # the smallest of its bodies; others keep their ratio to it [m]

    levels: Sequence[float] = COARSER  # spacings of its sweep over its own [-]

    @spacing.default
    def _own_spacing(self) -> float:
        return smallest_spacing(self.scene)

    @classmethod
    def of(
        cls,
        scene: Scene,
        wanted: Sequence[str] = (),
        references: Sequence[str] = (),
        *,
        folder: Path | None = None,
        levels: Sequence[float] = COARSER,
    ) -> SceneCase:
        """The case of a scene.

        Args:
            scene: it is built once, to know the columns of its history.
            wanted: columns or probes, as `quantities` reads them; by default all probes, or what
                the references are of.
            references: each "COLUMN=VALUE", where the value is a number, a formula or the name of a
                file; or the value alone if there is one quantity. They come before those of the
                scene.
            folder: where names of files begin.
            levels: spacings of its sweep over its own, from coarse to fine [-].

        Raises:
            SceneError: there is no such column or file, or a reference is ambiguous.
            BuildError: the scene cannot be built.
        """
        columns = _columns(scene)
        pairs = [_split(text) for text in references]
        asked = quantities(scene, columns, wanted) if wanted or not pairs else []
        known: list[Reference] = []
        for name, value in pairs:
            which = quantities(scene, columns, [name] if name else wanted)
            if len({quantity.column for quantity in which}) > 1:
                names = ", ".join(quantity.column for quantity in which)
                raise SceneError(
                    f"--reference {value!r} may be that of several columns: {names}; write which, "
                    "as COLUMN=VALUE"
                )
            known.append(_in_time(Reference.of(which[0], value, folder=folder), scene))
        if not pairs:
            known += references_of(scene, columns, folder=folder)
        if known and not wanted:
            asked = []
        wanted_ones = list(dict.fromkeys([*asked, *(r.quantity for r in known)]))
        return cls(scene, wanted_ones, known, levels=tuple(levels))

    @property
    def title(self) -> str:  # type: ignore[override]  # of the scene
        return self.scene.title or "the scene"

    @property
    def source(self) -> str:  # type: ignore[override]
        sources = dict.fromkeys(reference.source for reference in self.references)
        return ", ".join(sources) or "estimated by refinement"

    @property
    def sweep(self) -> Mapping[str, Sequence[Any]]:  # type: ignore[override]
        own = smallest_spacing(self.scene)
        return {SPACING: tuple(own if x == 1.0 else float(f"{own * x:.4g}") for x in self.levels)}

    @property
    def resolution(self) -> float:
        return self.spacing

    def scenes(self) -> Mapping[str, Scene]:
        return {_NAME: changed(self.scene, SPACING, self.spacing)}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records[_NAME]
        known = {reference.quantity for reference in self.references}
        return [
            *(reference.measurement(record) for reference in self.references),
            *(
                _without_reference(quantity, record)
                for quantity in self.quantities
                if quantity not in known
            ),
        ]

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        """The measurement with the largest error; the first if none has a reference."""
        errors = [m for m in measurements if m.error is not None]
        return max(errors, key=lambda m: abs(m.error or 0.0)) if errors else measurements[0]


def _without_reference(quantity: Quantity, record: Record) -> Measurement:
    return Measurement(
        quantity=quantity.name,
        value=quantity.value(record),
        unit=quantity.unit,
        scale=quantity.scale(record),
    )


def references_of(
    scene: Scene, columns: Sequence[str], *, folder: Path | None = None
) -> Sequence[Reference]:
    """What a scene itself says of the columns of its history, in its [[reference]] entries.

    Raises:
        SceneError: there is no such column or file, or an entry may be that of several columns.
    """
    known = []
    for entry in scene.references:
        quantity = one_quantity(scene, columns, str(entry.quantity))
        given = entry.value if entry.file is None else entry.file
        reference = Reference.of(
            quantity,
            "" if given is None else given,
            folder=folder,
            source=entry.source,
            tolerance=entry.tolerance,
        )
        known.append(_in_time(reference, scene))
    return known


def _in_time(reference: Reference, scene: Scene) -> Reference:
    """That reference, unless its curve begins after the scene has ended."""
    curve = reference.curve
    if curve is not None and not (curve.times[0] <= scene.duration and curve.times[-1] >= 0.0):
        raise SceneError(
            f"the reference {reference.source!r} is from t = {curve.times[0]:g} to "
            f"{curve.times[-1]:g} s, and the scene from 0 to {scene.duration:g} s; give times in "
            "seconds"
        )
    return reference


def _columns(scene: Scene) -> Sequence[str]:
    """Columns of the history of a scene, from a coarser one where that can be built."""
    try:
        coarse = changed(scene, SPACING, COARSER[0] * smallest_spacing(scene))
        return columns_of(Simulation.builder(coarse).build())
    except SolidsphError:
        return columns_of(Simulation.builder(scene).build())


def _split(text: str) -> tuple[str, str]:
    """Name, maybe empty, and value of "COLUMN=VALUE"; comparisons in a formula are no names."""
    name, equals, value = text.partition("=")
    return (name.strip(), value.strip()) if equals and value[:1] != "=" else ("", text.strip())
