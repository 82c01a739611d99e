"""Shared by all tests."""

from __future__ import annotations

import os

import pytest
from hypothesis import HealthCheck, settings

# Machines that run the tests are shared: a slow moment is not a failure.
settings.register_profile(
    "shared", deadline=None, suppress_health_check=[HealthCheck.too_slow], print_blob=True
)
settings.load_profile("shared")


@pytest.fixture(autouse=True)
def _plain_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """No test sees a restriction of plugins that the caller's shell may hold."""
    for name in [name for name in os.environ if name.startswith("SOLIDSPH_")]:
        monkeypatch.delenv(name)
