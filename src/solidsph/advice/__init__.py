"""Warnings ahead of a run: one a file, each with a finding, what is expected, and the remedy."""

from solidsph.advice.advice import Advice
from solidsph.advice.catalogue import ADVICE, advise, unknown_names

__all__ = ["ADVICE", "Advice", "advise", "unknown_names"]
