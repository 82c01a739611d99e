"""How many examples a property is tried on."""

from __future__ import annotations

from hypothesis import settings

# A share of each test's count, in per cent; `make test` takes the first, `make validate` the other.
QUICK, THOROUGH = 25, 100


def examples(count: int) -> settings:
    """Settings with the profile's share of so many examples."""
    return settings(max_examples=max(5, count * settings().max_examples // THOROUGH))
