"""Schemes: what a scene gets that names no parts."""

from __future__ import annotations

from math import inf
from typing import Any

import attrs
import numpy as np
import pytest

from solidsph import BuildError, Scene, Simulation
from solidsph.advice import advise
from solidsph.errors import PluginError
from solidsph.registry.construct import construct
from solidsph.scene.scheme import SCHEMES, completed, scheme_of
from solidsph.testing import example_part
from solidsph_builtin.discretisations.fitted import Fitted
from solidsph_builtin.discretisations.lattice import Lattice
from tests.helpers.scenes import SOFT

BOX = {"type": "box", "lengths": [1.0, 0.5]}


def bare(**body: object) -> Simulation:
    builder = Simulation.builder().body("b", shape=BOX, spacing=0.1, **body)  # type: ignore[arg-type]
    return builder.material("neo-hookean", **SOFT).duration(1e-3).build()


def test_every_scheme_names_parts_that_exist_and_says_why() -> None:
    for name, scheme in SCHEMES.items():
        for kind, part in (
            ("discretisations", scheme.discretisation),
            ("kernels", scheme.kernel),
            ("formulations", scheme.formulation),
            ("gradients", scheme.elsewhere),
            ("integrators", scheme.integrator),
        ):
            construct(kind, part)
            assert scheme.why[kind], (name, kind)


def test_a_bare_scene_has_the_recommended_parts() -> None:
    simulation = bare()
    assert simulation.scene.kernel is None
    fitted = construct("discretisations", "fitted").particles(construct("shapes", BOX), 0.1)
    assert (simulation.particles.positions == fitted.positions).all()
    body = simulation.model.bodies[0]
    assert type(body.smoothing.kernel).__name__ == "CubicSpline"
    assert body.smoothing.support_radius == pytest.approx(0.26)
    assert body.formulation.gradient.exact_degree == 2
    assert isinstance(construct("discretisations", SCHEMES["recommended"].discretisation), Fitted)


ON_BOUNDARY = {"type": "lattice", "on_boundary": True}
JITTERED = {"amplitude": 0.1, "seed": 1}


def points(depth: float) -> dict[str, object]:
    """Even points in the box, the outermost at a depth [m]."""
    x, y = (np.linspace(depth, length - depth, round(10 * length) + 1) for length in (1.0, 0.5))
    return {"type": "points", "positions": [[float(a), float(b)] for a in x for b in y]}


@pytest.mark.parametrize(
    ("discretisation", "gradient"),
    [
        ("lattice", "corrected"),
        ({"type": "jittered-lattice", **JITTERED}, "corrected"),
        ({"type": "fitted-moments", "of": "lattice"}, "corrected"),
        (points(0.05), "corrected"),
        ({"type": "lattice", "ghosts": 3}, "corrected"),
        ({**ON_BOUNDARY, "ghosts": 3}, "corrected"),
        (ON_BOUNDARY, "consistent"),
        ("fitted", "consistent"),
        ("conforming-lattice", "consistent"),
        ({"type": "jittered", "of": "fitted", **JITTERED}, "consistent"),
        ({"type": "fitted-moments", "of": "conforming-lattice"}, "consistent"),
        ({"type": "mapped", "of": ON_BOUNDARY, "before": BOX, "to": {"x": "X"}}, "consistent"),
        (points(0.0), "consistent"),
        (Lattice(on_boundary=True), "consistent"),
    ],
)
def test_the_gradient_suits_where_the_particles_end(discretisation: Any, gradient: str) -> None:
    """Half a spacing inside, the sums of `consistent` have no known value, nor with ghosts."""
    builder = Simulation.builder().body("b", shape=BOX, spacing=0.1, discretisation=discretisation)
    builder = builder.material("neo-hookean", **SOFT).duration(1e-3)
    if isinstance(discretisation, dict) and "ghosts" in discretisation:
        builder = builder.boundary("ghost-extension")
    simulation = builder.build()
    assert completed(simulation.scene).formulation["gradient"] == gradient  # type: ignore[index]
    assert "surface-rows" not in {one.name for one in advise(simulation)}


def test_the_gradient_suits_every_body() -> None:
    builder = Simulation.builder().material("neo-hookean", **SOFT).duration(1e-3)
    for name, own in (("on", ON_BOUNDARY), ("inside", "lattice"), ("bare", None)):
        builder.body(name, shape=BOX, spacing=0.1, discretisation=own)
    assert completed(builder.scene()).formulation["gradient"] == "corrected"  # type: ignore[index]


def test_a_gradient_that_the_scene_names_stays() -> None:
    builder = Simulation.builder().body("b", shape=BOX, spacing=0.1, discretisation="lattice")
    builder = builder.material("neo-hookean", **SOFT).duration(1e-3)
    scene = builder.formulation("total-lagrangian", gradient="consistent").scene()
    assert completed(scene).formulation["gradient"] == "consistent"  # type: ignore[index]
    scene = builder.formulation("total-lagrangian", divergence="plain").scene()
    assert completed(scene).formulation == {
        "type": "total-lagrangian",
        "gradient": "corrected",
        "divergence": "plain",
        "filter_above": 10.0,
    }


def test_the_filter_of_the_dilatation_can_be_left_out() -> None:
    builder = Simulation.builder().body("b", shape=BOX, spacing=0.1)
    builder = builder.material("neo-hookean", **{**SOFT, "poissons_ratio": 0.49}).duration(1e-3)
    assert builder.build().model.filters
    without = builder.formulation("total-lagrangian", filter_above=inf).scene()
    assert not builder.build().model.filters
    assert Scene.from_toml(without.to_toml()) == without


@pytest.mark.parametrize("reason", ["sleep", "bond-failure", "scheme"])
def test_no_filter_where_it_does_not_fit(reason: str) -> None:
    builder = Simulation.builder().body("b", shape=BOX, spacing=0.1)
    builder = builder.material("neo-hookean", **{**SOFT, "poissons_ratio": 0.49}).duration(1e-3)
    if reason == "sleep":
        builder = builder.sleep()
    elif reason == "scheme":
        builder = builder.scheme("corrected")
    else:
        builder = builder.effect(example_part("effects", reason))
    assert not builder.build().model.filters


@pytest.mark.parametrize(
    ("wrong", "problem"),
    [
        ("lattise", "did you mean"),
        ({"type": "points", "file": "none.csv"}, "cannot read positions"),
        ({"type": "points", "positions": [[2.0, 2.0]]}, "outside the shape"),
    ],
)
def test_a_wrong_discretisation_is_told_once(wrong: Any, problem: str) -> None:
    with pytest.raises(BuildError, match=problem) as found:
        bare(discretisation=wrong)
    assert len(found.value.problems) == 1


class Breaks(Lattice):
    def ends_on_surface(self, shape: Any, spacing: float) -> bool:
        raise KeyError("surface")


def test_a_discretisation_that_breaks_when_asked_is_named() -> None:
    with pytest.raises(PluginError, match=r"Breaks.* failed: KeyError: 'surface'"):
        bare(discretisation=Breaks())


@pytest.mark.parametrize("effect", ["bond-failure", "heat"])
def test_effects_that_suit_cell_centres_get_them(effect: str) -> None:
    builder = Simulation.builder().body("b", shape=BOX, spacing=0.1).material("neo-hookean", **SOFT)
    scene = builder.effect(effect).duration(1.0).scene()
    assert scheme_of(scene) is SCHEMES["corrected"]
    assert scheme_of(attrs.evolve(scene, scheme="paper")) is SCHEMES["paper"]


def test_a_part_that_the_scene_names_stays() -> None:
    scene = Scene.from_toml(
        """
        duration = 1.0
        [body.b]
        shape = {type = "box", lengths = [1.0, 0.5]}
        spacing = 0.1
        [material]
        type = "neo-hookean"
        youngs_modulus = 1e6
        poissons_ratio = 0.3
        density = 1000.0
        [formulation]
        type = "total-lagrangian"
        gradient = "quadratic"
        [kernel]
        cover = 3.0
        """
    )
    found = completed(scene)
    assert found.formulation == {
        "type": "total-lagrangian",
        "gradient": "quadratic",
        "divergence": "variational",
        "filter_above": 10.0,
    }
    assert (found.kernel, found.cover) == ("cubic-spline", 3.0)
    assert completed(found) == found
    assert Scene.from_toml(scene.to_toml()) == scene


def test_the_scheme_of_the_paper() -> None:
    builder = Simulation.builder().body("b", shape={"type": "interval", "length": 1.0}, spacing=0.1)
    builder = builder.material("neo-hookean", **SOFT).duration(1e-3).scheme("paper")
    assert Scene.from_toml(builder.scene().to_toml()) == builder.scene()
    body = builder.build().model.bodies[0]
    assert isinstance(construct("discretisations", SCHEMES["paper"].discretisation), Lattice)
    assert body.particles.positions[0, 0] == 0.0
    assert body.smoothing.support_radius == pytest.approx(0.55)
    assert not body.formulation.divergence.adjoint


def test_an_unknown_scheme_is_refused_with_all_other_mistakes() -> None:
    builder = (
        Simulation.builder()
        .body("b", shape=BOX, spacing=0.1)
        .material("neo-hookean", **SOFT)
        .duration(1.0)
    )
    with pytest.raises(BuildError, match="unknown scheme 'papre'; take one of 'recommended'"):
        builder.scheme("papre").build()
    with pytest.raises(BuildError) as found:
        builder.scheme("papre").kernel("gauss").build()
    assert len(found.value.problems) == 2
