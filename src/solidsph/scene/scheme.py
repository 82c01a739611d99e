"""Schemes: the parts that a scene gets where it names none, and why these.

A scheme is data. A scene chooses one by its name, `scheme = "paper"`, and may still name each part.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any, TypeVar

import attrs

from solidsph.errors import PluginError, SceneError, SolidsphError
from solidsph.interfaces.discretisation import Discretisation
from solidsph.registry import registry
from solidsph.registry.construct import construct
from solidsph.registry.origin import failure
from solidsph.scene.graded_spacing import least_spacing
from solidsph.scene.scene_data import RECOMMENDED, BodyScene, PartLike, SceneData

S = TypeVar("S", bound=SceneData)


@attrs.frozen
class Scheme:
    """Parts by name, and a sentence for each that says why it was chosen."""

    name: str
    discretisation: PartLike
    kernel: PartLike
    cover: float | None  # [spacings]; derived from the kernel if None
    formulation: Mapping[str, Any]
    elsewhere: str  # the gradient of a scene with a body whose particles end before its surface
    integrator: str
    why: Mapping[str, str]  # by kind of part, and "elsewhere"


# The errors are those of tests/bare, where a scene names shape, spacing, material and loads only.
_RECOMMENDED = Scheme(
    name=RECOMMENDED,
    discretisation="fitted",
    kernel="cubic-spline",
    cover=None,
    formulation={
        "type": "total-lagrangian",
        "gradient": "consistent",
        "divergence": "variational",
        # Poisson's ratio 0.4545, up to which pressures are smooth. With 5 particles of a notched
        # sheet that is stretched to four times its length lose half of their volume.
        "filter_above": 10.0,
    },
    # The sums of `consistent` need particles on the surface. With them half a spacing inside, a
    # twisted bar of 6 across is 76 % too stiff, Cook's plate of 9 across 18 % (2 and 1 % with
    # `corrected`); on it they are 14 and 1 % off, 27 and 22 % with `corrected`.
    elsewhere="corrected",
    integrator="velocity-verlet",
    why={
        "discretisations": "particles on the surface, with volumes that integrate: a hanging beam "
        "of five particles across is off by 0.4 %, by a third with a plain lattice",
        "kernels": "at 2.6 spacings, 2.4 in space, it resists relative motion of neighbours, half "
        "as many as the paper's kernel needs",
        "gradients": "exact for a constant gradient of strain, with forces that integrate by "
        "parts: the peak stress at a hole is within 5 % with 20 particles a side",
        "elsewhere": "exact for a constant strain; particles of a body end before its surface, or "
        "have ghosts beyond it, which 'consistent' does not suit",
        "divergences": "forces are the derivative of the energy",
        "formulations": "neighbours never change, and tension cannot make particles clump",
        "integrators": "of the second order, one evaluation of the forces a step",
    },
)

_CORRECTED = attrs.evolve(
    _RECOMMENDED,
    name="corrected",
    discretisation="lattice",
    kernel="modified-mollifier",
    formulation={"type": "total-lagrangian", "gradient": "corrected", "divergence": "variational"},
    why={
        **_RECOMMENDED.why,
        "discretisations": "particles at the centres of the cells of a lattice",
        "kernels": "the kernel of the paper",
        "gradients": "exact for a constant strain (Bonet & Lok 1999)",
    },
)

_PAPER = attrs.evolve(
    _CORRECTED,
    name="paper",
    discretisation={"type": "lattice", "on_boundary": True},
    cover=5.5,
    formulation={"type": "total-lagrangian", "gradient": "standard", "divergence": "plain"},
    elsewhere="standard",
    integrator="central-difference",
    why={
        "discretisations": "a lattice with particles on the boundary",
        "kernels": "the paper's modified mollifier, of 5.5 spacings",
        "gradients": "uncorrected sums, eqs. 16 and 17",
        "divergences": "uncorrected sums, eqs. 16 and 17",
        "formulations": "the form that the paper recommends",
        "integrators": "eq. 18",
    },
)

SCHEMES: Mapping[str, Scheme] = {
    scheme.name: scheme for scheme in (_RECOMMENDED, _CORRECTED, _PAPER)
}
"""Schemes by name: the recommended one; the usual total Lagrangian form, with a linearly corrected
gradient on a plain lattice; and that of Ismail & Reddy."""


def scheme_of(scene: SceneData) -> Scheme:
    """The scheme that a scene names, or `corrected` in place of the recommended one where an effect
    asks for particles at the centres of cells.

    Raises:
        SceneError: there is none of that name.
    """
    if not isinstance(scene.scheme, str) or scene.scheme not in SCHEMES:
        known = ", ".join(map(repr, SCHEMES))
        raise SceneError(f"unknown scheme {scene.scheme!r}; take one of {known}")
    if scene.scheme == RECOMMENDED and any(_at_cell_centres(e.part) for e in scene.effects):
        return _CORRECTED
    return SCHEMES[scene.scheme]


def _at_cell_centres(effect: PartLike) -> bool:
    """Whether an effect needs particles at the centres of cells; not if it cannot be loaded."""
    kind: object = effect
    if isinstance(effect, (str, Mapping)):
        name = effect if isinstance(effect, str) else effect.get("type")
        kind = None
        with suppress(SolidsphError):
            kind = registry.load("effects", str(name))
    return bool(getattr(kind, "at_cell_centres", False))


def completed(scene: S) -> S:
    """The scene with every part named that its scheme chooses. One that names all is as it was.

    Raises:
        SceneError: there is no scheme of that name.
    """
    scheme = scheme_of(scene)
    cover = scene.cover
    if cover is None and scene.kernel is None:
        cover = scheme.cover
    return attrs.evolve(
        scene,
        bodies={
            name: attrs.evolve(body, discretisation=body.discretisation or scheme.discretisation)
            for name, body in scene.bodies.items()
        },
        kernel=scene.kernel or scheme.kernel,
        cover=cover,
        formulation=_formulation(scene, scheme),
        integrator=scene.integrator or scheme.integrator,
    )


def _formulation(scene: SceneData, scheme: Scheme) -> PartLike:
    given, usual = scene.formulation, dict(scheme.formulation)
    if scene.sleep is not None:  # regions that sleep are cut out of what a filter would read
        usual.pop("filter_above", None)
    table = {"type": given} if isinstance(given, str) else {} if given is None else given
    if not isinstance(table, Mapping) or table.get("type", usual["type"]) != usual["type"]:
        return given
    if "gradient" in table or usual["gradient"] == scheme.elsewhere or ends_on_surface(scene):
        return {**usual, **table}
    return {**usual, "gradient": scheme.elsewhere, **table}


def ends_on_surface(scene: SceneData) -> bool:
    """Whether the particles of all bodies end on the surface; those of a scheme that asks do.

    Raises:
        PluginError: a discretisation breaks when it is asked.
    """
    own = [body for body in scene.bodies.values() if body.discretisation is not None]
    return all(_ends_on_surface(body) for body in own)


def _ends_on_surface(body: BodyScene) -> bool:
    """Whether a body's own discretisation does; not if it is wrong, which the build reports."""
    part: Discretisation | None = None
    try:
        part = construct("discretisations", body.discretisation)
        return bool(part.ends_on_surface(construct("shapes", body.shape), least_spacing(body)))
    except SolidsphError:
        return False
    except Exception as cause:  # a plugin's code may fail in any way
        used = [] if part is None else [registry.entry_of("discretisations", part)]
        raise PluginError(failure(cause, used, "a discretisation")) from cause
