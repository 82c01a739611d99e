"""Conformance kits: what every part of a kind must keep, for plugin authors and `solidsph check`.

`solidsph.testing.strategies` is imported by itself: it needs Hypothesis, nothing here does.
"""

from solidsph.conformance.check import Check, CheckResult
from solidsph.conformance.kernel import MASS_TOLERANCE, smoothed_mass
from solidsph.testing.examples import example_part
from solidsph.testing.kits import checks, conformance, kits

__all__ = [
    "MASS_TOLERANCE",
    "Check",
    "CheckResult",
    "checks",
    "conformance",
    "example_part",
    "kits",
    "smoothed_mass",
]
