"""Integrators: the conformance kit for every one that is installed."""

from __future__ import annotations

import pytest

from solidsph.registry import registry
from solidsph.testing import Check, checks, example_part


@pytest.mark.parametrize("name", registry.names("integrators"))
@pytest.mark.parametrize("check", checks("integrators"), ids=lambda check: check.__name__)
def test_conformance(name: str, check: Check) -> None:
    result = check(example_part("integrators", name))
    assert result.passed, result
