"""What formulas of scenes are worth: truth in arithmetic, times up to the end, large numbers."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from solidsph import Simulation
from solidsph.errors import BuildError, SceneError
from solidsph.maths.arrays import Array
from solidsph.maths.formulas import Expression
from solidsph.model.fields import VectorField
from solidsph.resumption import resume
from solidsph.scene.scene_builder import SceneBuilder
from tests.helpers.scenes import box

X = np.array([0.1, 0.5, 0.9])
A, B = (X > 0.3).astype(float), (X > 0.6).astype(float)  # what the comparisons are as numbers


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("(X > 0.3) + (X > 0.6)", A + B),
        ("(X > 0.3) - (X > 0.6)", A - B),
        ("(X > 0.3) * (X > 0.6)", A * B),
        ("(X > 0.3) / 2", A / 2.0),
        ("(X > 0.3) ** 2 % 2", A),
        ("2 ** (X > 0.3)", 2.0**A),
        ("-(X > 0.3)", -A),
        ("+(X > 0.3) + (X > 0.6)", A + B),
        ("1e3*((0.3 < X < 0.7) + (X > 0.6))", 1e3 * ((A - B) + B)),
        ("((X > 0.3) + (X > 0.6)) > 1", A + B > 1.0),
        ("(X > 0.3) == (X > 0.6)", A == B),
        ("((X > 0.3) > (X > 0.6)) + 1", (A > B) + 1.0),
        ("not (X > 0.3)", A == 0.0),
        ("2*(not X > 0.3) + (X > 0.3 and X > 0.6)", 2.0 * (1.0 - A) + A * B),
        ("exp(X > 0.3)", np.exp(A)),
        ("sqrt(X > 0.3) + sin(X > 0.6)", np.sqrt(A) + np.sin(B)),
        ("hypot(X > 0.3, X > 0.6)", np.hypot(A, B)),
        ("max(X > 0.3, 0.5) + min(X > 0.3, 0.5)", np.maximum(A, 0.5) + np.minimum(A, 0.5)),
        ("clip(X > 0.3, 0.25, 0.75)", np.clip(A, 0.25, 0.75)),
        ("where(X > 0.3, X > 0.6, 0) + (X > 0.6)", 2.0 * B),
        ("abs(-(X > 0.3))", A),
        ("(2 > 1) + (3 > 2) - (1 > 2) + 0*X", np.full(3, 2.0)),
    ],
)
def test_a_comparison_in_arithmetic_is_one_or_zero_in_double_precision(
    text: str, expected: Array
) -> None:
    found = Expression.parse(text, ("X",))({"X": X})
    assert np.array_equal(found, expected)
    assert np.asarray(found).dtype == expected.dtype
    # And the same for one number at a time.
    alone = [Expression.parse(text, ("X",))({"X": float(x)}) for x in X]
    assert np.array_equal(alone, expected)


def test_steps_in_time_add_up_in_every_load_and_motion() -> None:
    times = np.array([0.0, 1.5, 2.5])
    field = VectorField.of({"x": "1e3*((t > 1) + (t > 2))"}, "load")
    assert np.array_equal(field.schedule(0, np.zeros((1, 1)), times)[:, 0], [0.0, 1e3, 2e3])


def test_initial_values_and_places_count_comparisons() -> None:
    scene = box(1, 10).initial(velocity={"x": "(X > 0.3) + (X > 0.6)"})
    state = scene.build().initial
    assert state.velocities[:, 0].tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2, 2]  # at 0.05, 0.15 ...
    chosen = box(1, 10).build().model.select("(0.3 < X) + (X < 0.6) > 1")
    assert chosen.tolist() == [3, 4, 5]


@pytest.mark.parametrize("text", ["9" * 310, "X < " + "7" * 400, "1e400", "2*X + 1e309"])
def test_a_number_beyond_a_double_is_told(text: str) -> None:
    with pytest.raises(SceneError, match="is too large; at most about"):
        Expression.parse(text, ("X",))


@pytest.mark.parametrize("text", ["1or X", "2if X else 1", "1 is 1", "X is not 2", "0xfor X"])
def test_no_warning_of_python_gets_out(text: str) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with pytest.raises(SceneError, match="formula"):
            Expression.parse(text, ("X",))
    assert caught == []


# Times

END = 0.2


@pytest.mark.parametrize("count", [1, 2, 3, 4, 7, 50, 333])
@pytest.mark.parametrize("end", [0.2, 0.25, 1e-5 / 3.0])
def test_no_formula_is_asked_outside_of_the_run(count: int, end: float) -> None:
    asked: list[float] = []

    def note(X: Array, t: float) -> Array:
        asked.append(t)
        return np.full(len(X), t)

    field = VectorField.of({"x": note}, "motion", end=end)
    times = np.cumsum([0.0, *[end / count] * count])  # with the rounding of a time loop
    for order in range(3):
        field.derivative_schedule(0, np.zeros((1, 1)), times, order, end / count)
    assert 0.0 <= min(asked) <= max(asked) <= end


def test_differences_are_of_second_order_up_to_both_ends() -> None:
    # Of sin(w t): halving the step divides the largest error by four, at the ends too.
    w, errors = 10.0, []
    for count in (200, 400):
        step = END / count
        field = VectorField.of({"x": f"sin({w}*t)"}, "motion", end=END)
        times = np.linspace(0.0, END, count + 1)
        velocity, acceleration = (
            field.derivative_schedule(0, np.zeros((1, 1)), times, k, step)[:, 0] for k in (1, 2)
        )
        errors.append(
            (
                np.abs(velocity - w * np.cos(w * times)).max(),
                np.abs(acceleration + w**2 * np.sin(w * times)).max(),
            )
        )
    # Not four exactly: the next term of the series is of the order of w step = 0.01.
    assert np.array(errors[0]) / np.array(errors[1]) == pytest.approx([4.0, 4.0], rel=0.05)


def test_a_parabola_is_differentiated_exactly_at_the_end() -> None:
    field = VectorField.of({"x": "3*t**2"}, "motion", end=END)
    for order, right in ((1, 6.0 * END), (2, 6.0)):
        found = field.derivative(0, np.zeros((1, 1)), END, order, END / 100)
        # Rounding of 3 t^2, over the square of a step of 2e-3.
        assert found[0] == pytest.approx(right, abs=1e-9)


def slowing(duration: float = END, **motion: Any) -> SceneBuilder:
    return (
        box(1, 6)
        .material("neo-hookean", youngs_modulus=1e4, poissons_ratio=0.0, density=1000.0)
        .boundary("prescribed-motion", where="left", displacement=motion)
        .duration(duration)
        .outputs(4)
    )


FORMULAS = [
    "1e-3*(1 - (1 - t/0.2)**1.5)",
    "1e-3*sqrt(0.2 - t)",
    "1e-3*acos(1 - t/0.1)",
    "1e-3*(0.2 - t)*log(1 + sqrt(0.2 - t))",
]


@pytest.mark.parametrize("text", FORMULAS)
def test_a_motion_that_ends_with_the_run_is_carried_out(text: str) -> None:
    # Roots have no bounded velocity at their ends, so in no number of steps do energies add up.
    simulation = slowing(x=text).energy_tolerance("off").build()
    assert simulation.run().state.step == simulation.steps


def test_a_wall_and_loads_that_end_with_the_run_are_carried_out() -> None:
    text = "1e-3*(1 - (1 - t/0.2)**1.5)"
    wall: dict[str, Any] = {"point": {"x": -0.001}, "normal": {"x": 1.0}, "friction": 0.3}
    scene = slowing(x=0.0).effect("rigid-wall", displacement={"x": text}, **wall)
    scene.boundary("traction", where="right", traction={"x": "sqrt(0.2 - t)"})
    scene.effect("body-force", acceleration={"x": "(0.2 - t)**0.5"})
    assert scene.build().run().state.time == pytest.approx(END)


def test_a_formula_without_a_value_inside_the_run_names_itself_time_and_place(
    tmp_path: Path,
) -> None:
    simulation = slowing(x="1e-3*sqrt(0.1 - t)").build()
    with pytest.raises(SceneError, match=r"displacement: '1e-3\*sqrt\(0.1 - t\)' is nan at X = "):
        simulation.run(record=tmp_path / "run.h5")
    assert (tmp_path / "run.h5").exists()  # what was recorded until then is kept


def test_an_extended_run_keeps_what_it_was_and_asks_nothing_ahead(tmp_path: Path) -> None:
    asked: list[float] = []

    def motion(X: Array, t: float) -> Array:
        asked.append(t)
        return np.full(len(X), 1e-3 * t**2)

    simulation = slowing(x=motion).build()
    simulation.run(record=tmp_path / "run.h5")
    assert max(asked) == pytest.approx(END)
    # It is carried out again from the start, and every output must come out the same to the bit.
    result = resume(tmp_path / "run.h5", simulation=simulation, until=1.5 * END)
    assert max(asked) == result.state.time
    # A parabola has no error of second order differences, ahead or back.
    assert result.state.velocities[0, 0] == pytest.approx(2e-3 * result.state.time, rel=1e-9)
    assert result.state.accelerations[0, 0] == pytest.approx(2e-3, rel=1e-9)


# Formulas without time, or without place


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda b: b.initial(velocity={"x": "X*t"}), "uses t, but it is the state at t = 0"),
        (lambda b: b.initial(displacement={"x": "sin(t)"}), "uses t, but it is the state"),
        (lambda b: b.initial(where="X > t", velocity={"x": 1.0}), "particles are chosen once"),
        (lambda b: b.boundary("clamp", where="X < 0.1*t"), "particles are chosen once"),
        (
            lambda b: b.effect(
                "heat", conductivity=1.0, heat_capacity=1.0, initial="300*t", largest=1.0
            ),
            "the temperature at the start is asked once",
        ),
        (
            lambda b: b.effect(
                "rigid-wall",
                point={"x": -1.0},
                normal={"x": 1.0},
                displacement={"x": "X*t"},
            ),
            "uses X, but a wall moves as a whole",
        ),
    ],
)
def test_a_variable_that_means_nothing_there_is_refused(
    change: Callable[[SceneBuilder], SceneBuilder], expected: str
) -> None:
    with pytest.raises(BuildError) as caught:
        change(box(1, 6)).build()
    assert expected in str(caught.value)


def test_a_tag_and_a_map_that_depend_on_time_are_refused() -> None:
    tagged = box(1, 6, tags={"late": "X > t"})
    mapped = Simulation.builder().body(
        "block",
        shape={"type": "box", "lengths": [1.0, 1.0]},
        spacing=0.2,
        discretisation={
            "type": "mapped",
            "of": "lattice",
            "before": {"type": "box", "lengths": [1.0, 1.0]},
            "to": {"x": "X + t"},
        },
    )
    mapped.material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1e3)
    for scene, expected in ((tagged, "chosen once"), (mapped.duration(1.0), "placed once")):
        with pytest.raises(BuildError) as caught:
            scene.build()
        assert expected in str(caught.value)
