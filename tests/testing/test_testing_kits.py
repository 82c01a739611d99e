"""The conformance kits: a part that breaks a promise is caught, and so is every promise once."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from importlib.metadata import EntryPoint
from typing import Any, ClassVar

import attrs
import pytest

from solidsph import SceneError, cli
from solidsph.conformance.check import Check
from solidsph.maths.arrays import Scalar
from solidsph.registry import registry
from solidsph.testing import checks, conformance, example_part, kits
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_builtin.shapes.box import Box
from tests.helpers.broken_parts import (
    boundaries,
    discretisations,
    divergences,
    effects,
    engines,
    formulations,
    gradients,
    integrators,
    kernels,
    materials,
    shapes,
)
from tests.helpers.waiting import HANG
from tests.testing.test_lying_parts import LIES

# (part, names of the checks that it fails) of every kind
WRONG = {
    "boundaries": boundaries.BOUNDARIES,
    "discretisations": discretisations.DISCRETISATIONS,
    "divergences": divergences.DIVERGENCES,
    "effects": effects.EFFECTS,
    "engines": engines.ENGINES,
    "formulations": formulations.FORMULATIONS,
    "gradients": gradients.GRADIENTS,
    "integrators": integrators.INTEGRATORS,
    "kernels": kernels.KERNELS,
    "materials": materials.MATERIALS,
    "shapes": shapes.SHAPES,
}
GOOD = {
    "boundaries": boundaries.GoodHandler,
    "discretisations": discretisations.GoodDiscretisation,
    "divergences": divergences.GoodDivergence,
    "effects": effects.GoodEffect,
    "engines": engines.GoodEngine,
    "formulations": formulations.GoodFormulation,
    "gradients": gradients.GoodGradient,
    "integrators": integrators.GoodIntegrator,
    "kernels": kernels.GoodKernel,
    "materials": materials.GoodMaterial,
    "shapes": shapes.GoodShape,
}


@pytest.fixture(autouse=True)
def _mended(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever is done to the class is undone."""
    monkeypatch.setattr(NeoHookean, "first_piola", staticmethod(effects.neo_hookean_stress))


def failed(kind: str, part: object) -> set[str]:
    return {result.name for result in conformance(kind, part) if not result.passed}


def named(kind: str) -> Mapping[str, Check]:
    return {check.__name__.replace("_", " "): check for check in checks(kind)}


@pytest.mark.parametrize("kind", kits())
def test_the_part_that_the_wrong_ones_differ_from_passes(kind: str) -> None:
    assert failed(kind, GOOD[kind]()) == set()


def test_the_memory_that_the_wrong_ones_differ_from_passes() -> None:
    assert failed("materials", materials.GoodMemory()) == set()


@pytest.mark.parametrize(
    ("kind", "make", "broken"),
    [(kind, make, broken) for kind in kits() for make, broken in WRONG[kind]],
    ids=lambda value: getattr(value, "__name__", None),
)
# What a broken part does with the numbers on the way is its own affair.
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_broken_promise_is_found(kind: str, make: type[object], broken: set[str]) -> None:
    part = make()
    assert [name for name in broken if named(kind)[name](part).passed] == []


@pytest.mark.parametrize("kind", kits())
def test_every_check_is_shown_to_fail_above(kind: str) -> None:
    shown = set().union(*(broken for _, broken in WRONG[kind]))
    shown |= {check.replace("_", " ") for own, _, _, check in LIES.values() if own == kind}
    assert set(named(kind)) == shown


class Broken(kernels.GoodKernel):
    @staticmethod
    def profile(q: Scalar, params: tuple[float, ...]) -> Scalar:
        raise ZeroDivisionError("out of order")


def test_an_exception_is_a_failed_result_with_its_message() -> None:
    results = conformance("kernels", Broken())
    assert len(results) == len(checks("kernels"))
    spoken = [result for result in results if "ZeroDivisionError: out of order" in result.measured]
    assert {"mass", "slope", "falling"} <= {result.name for result in spoken}
    assert not any(result.passed for result in spoken)


def test_a_result_says_what_was_measured_and_what_is_required() -> None:
    results = {one.name: one for one in conformance("kernels", kernels.Rising())}
    assert not results["falling"].passed
    assert "at most 1e-15" in results["falling"].measured
    assert results["falling"].required.startswith("The profile does not rise")


def test_a_kit_takes_a_name_or_an_object_of_its_kind_only() -> None:
    assert conformance("kernels", "cubic-spline")[0].passed
    with pytest.raises(SceneError, match="expected a name"):
        conformance("kernels", gradients.GoodGradient())
    with pytest.raises(SceneError, match="no conformance kit for 'cases'"):
        conformance("cases", "tensile-instability")


def test_example_parts_take_the_values_of_their_example_where_none_are_given() -> None:
    typical = example_part("materials", "neo-hookean")
    other = example_part("materials", "neo-hookean", poissons_ratio=0.1)
    assert typical.density == other.density
    assert (typical.poissons_ratio, other.poissons_ratio) == (0.3, 0.1)
    for name, typical_of in (("union", 2), ("difference", 1)):
        of = example_part("shapes", name).of
        assert len(of if isinstance(of, tuple) else [of]) == typical_of


def test_example_parts_say_which_value_is_not_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Box, "example", {})
    with pytest.raises(SceneError, match=r"'lengths'; add it to `example` in .*box:Box, or give"):
        example_part("shapes", "box")


@attrs.frozen
class Sharp(kernels.GoodKernel):
    """A part of a third party, with required parameters of names of its own."""

    sharpness: float
    edge: float = attrs.field(alias="rim")

    example: ClassVar[Mapping[str, Any]] = {"sharpness": 70.0, "rim": 2.5}


@attrs.frozen
class SharpWithoutExample(kernels.GoodKernel):
    sharpness: float


@pytest.fixture
def foreign_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two kernels, registered as those of another distribution are."""
    points = [
        EntryPoint(name, f"{__name__}:{cls.__name__}", "solidsph.kernels")
        for name, cls in {"sharp": Sharp, "bare": SharpWithoutExample}.items()
    ]
    monkeypatch.setattr(
        registry, "entry_points", lambda group: points if group == "solidsph.kernels" else []
    )


@pytest.mark.usefixtures("foreign_kernels")
def test_a_third_partys_part_is_checked_with_its_own_example(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert example_part("kernels", "sharp") == Sharp(70.0, 2.5)
    assert example_part("kernels", "sharp", rim=3.0) == Sharp(70.0, 3.0)
    cli.cli.main(["check", "sharp", "--json"], standalone_mode=False)
    assert json.loads(capsys.readouterr().out)["passed"]


@pytest.mark.usefixtures("foreign_kernels")
def test_a_third_partys_part_without_an_example_needs_its_value() -> None:
    expected = r"'sharpness'; add it to `example` in .*:SharpWithoutExample.*--set sharpness="
    with pytest.raises(SceneError, match=expected):
        cli.cli.main(["check", "bare"], standalone_mode=False)
    assert example_part("kernels", "bare", sharpness=60.0) == SharpWithoutExample(60.0)


@pytest.mark.parametrize("kind", kits())
def test_every_built_in_part_has_an_example_of_each_required_parameter(kind: str) -> None:
    for name in registry.names(kind):
        assert isinstance(example_part(kind, name), registry.interface(kind))


def test_every_kind_of_part_but_a_case_has_a_kit() -> None:
    assert set(kits()) == set(registry.INTERFACES) - {"cases"}


def test_checks_need_no_hypothesis() -> None:
    script = (
        "import sys; sys.modules['hypothesis'] = None\n"
        "from solidsph.testing import conformance\n"
        "assert all(result.passed for result in conformance('kernels', 'cubic-spline'))\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True, timeout=HANG)
