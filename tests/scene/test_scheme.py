"""Schemes: what a scene gets that names no parts."""

from __future__ import annotations

import attrs
import pytest

from solidsph import BuildError, Scene, Simulation
from solidsph.registry.construct import construct
from solidsph.scene.scheme import SCHEMES, completed, scheme_of
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


def test_particles_that_a_scene_names_may_be_off_the_surface() -> None:
    """There the sums of `consistent` have no known value."""
    body = bare(discretisation="lattice").model.bodies[0]
    assert type(body.formulation.gradient).__name__ == "Corrected"


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
