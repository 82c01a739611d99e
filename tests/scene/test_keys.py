"""Keys of a scene file: one value changed, and nothing else."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from solidsph import Scene, SceneError
from solidsph.scene.keys import value_at, with_key
from tests.helpers.scenes import SCENE_TOML

FURTHER = """
[[effect]]
type = "artificial-viscosity"
linear = 0.5

[[effect]]
type = "body-force"
label = "gravity"
acceleration = {y = -9.81}

[[effect]]
type = "body-force"
label = "wind"
acceleration = {x = 1.0}

[[probe]]
label = "end"
quantity = "displacement"
point = [1.0, 0.25]

[[initial]]
velocity = {x = -1.0}

[[reference]]
quantity = "end displacement x"
value = 0.1
"""
SCENE = Scene.from_toml(SCENE_TOML + FURTHER)


def differences(one: Any, other: Any, at: str = "") -> dict[str, Any]:
    """Values of `other` that differ from those of `one`, by place."""
    if isinstance(one, dict) and isinstance(other, dict):
        return {
            place: value
            for name in one.keys() | other.keys()
            for place, value in differences(
                one.get(name), other.get(name), f"{at}.{name}".strip(".")
            ).items()
        }
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        return {
            place: value
            for number, (a, b) in enumerate(zip(one, other, strict=True))
            for place, value in differences(a, b, f"{at}.{number}").items()
        }
    return {} if one == other else {at: other}


@pytest.mark.parametrize(
    ("key", "value", "place"),
    [
        ("body.block.spacing", 0.25, "body.block.spacing"),
        ("body.block.shape.lengths", [2.0, 0.5], "body.block.shape.lengths.0"),
        ("material.poissons_ratio", 0.49, "material.poissons_ratio"),
        ("kernel.cover", 2.6, "kernel.cover"),
        ("integrator.time_step_factor", 0.5, "integrator.time_step_factor"),
        ("effect.artificial-viscosity.linear", 1.0, "effect.0.linear"),
        ("effect.gravity.acceleration.y", -1.0, "effect.1.acceleration.y"),
        ("boundary.traction.traction.x", 5.0, "boundary.1.traction.x"),
        ("probe.end.point", [0.5, 0.25], "probe.0.point.0"),
        ("initial.all.velocity.x", -2.0, "initial.0.velocity.x"),
        ("reference.end displacement x.tolerance", 0.2, "reference.0.tolerance"),
        ("energy_tolerance", 0.02, "energy_tolerance"),
        ("title", "another", "title"),
    ],
)
def test_one_value_is_changed(key: str, value: Any, place: str) -> None:
    before, after = (
        tomllib.loads(scene.to_toml()) for scene in (SCENE, with_key(SCENE, key, value))
    )
    found = differences(before, after)
    assert set(found) == {place}
    assert found[place] == (value[0] if isinstance(value, list) else value)
    assert value_at(with_key(SCENE, key, value), key) == value


def test_a_section_that_is_missing_is_added() -> None:
    scene = with_key(Scene.from_toml(SCENE_TOML), "statics.load_steps", 4)
    assert scene.statics is not None
    assert scene.statics.load_steps == 4


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("body.blokc.spacing", 0.1, "did you mean 'block'"),
        ("body.block.spacing.x", 0.1, "has no keys"),
        ("body.block.spacign", 0.1, "did you mean 'spacing'"),
        ("effect.viscosity.linear", 0.1, "no \\[\\[effect\\]\\] has the label or type"),
        ("initial.0.velocity", {"x": 0.1}, "has the where '0'; there are: all"),
        ("effect.body-force.acceleration", {"x": 0.1}, "2 entries"),
        ("integrator.time_step_factor", "fast", "must be a number"),
        ("material.density", object(), "cannot stand in a scene file"),
    ],
)
def test_what_is_not_there_is_told(key: str, value: Any, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        with_key(SCENE, key, value)


def test_a_value_that_no_key_has_is_told() -> None:
    with pytest.raises(SceneError, match=r"says nothing of 'material\.friction'"):
        value_at(SCENE, "material.friction")
