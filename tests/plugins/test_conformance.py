"""Every part that is installed keeps the promises of its kind."""

from __future__ import annotations

import pytest

from solidsph.registry import registry
from solidsph.testing import conformance, example_part, kits


@pytest.mark.parametrize(
    ("kind", "name"),
    # Materials are put to their checks one by one, in materials/test_materials.py.
    [
        # To compile takes half a minute each; tests/engines hold them to the same.
        pytest.param(kind, name, marks=pytest.mark.validation if "compiled" in name else ())
        for kind in kits()
        if kind != "materials"
        for name in registry.names(kind)
    ],
    ids=lambda value: value,
)
def test_every_installed_part_conforms(kind: str, name: str) -> None:
    results = conformance(kind, example_part(kind, name))
    assert [result for result in results if not result.passed] == []
