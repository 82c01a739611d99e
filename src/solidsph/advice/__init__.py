"""Warnings ahead of a run: one a file, each with what was found, expected, and the remedy."""

from solidsph.advice.advice import Advice
from solidsph.advice.catalogue import ADVICE, advise, unknown

__all__ = ["ADVICE", "Advice", "advise", "unknown"]
