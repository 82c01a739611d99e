"""Shared by all tests."""

from hypothesis import HealthCheck, settings

# A machine that is slow or busy is not a failure.
settings.register_profile("shared", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("shared")
