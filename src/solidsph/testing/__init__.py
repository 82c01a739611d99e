"""Conformance kits: what every part of a kind must keep, for plugin authors and `solidsph check`.

`solidsph.testing.strategies` is imported by itself: it needs Hypothesis, nothing here does.
"""

from solidsph.testing.check import Check, CheckResult
from solidsph.testing.examples import example_part
from solidsph.testing.kits import checks, conformance, kits

__all__ = ["Check", "CheckResult", "checks", "conformance", "example_part", "kits"]
