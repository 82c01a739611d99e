"""Watches a run for symptoms of failure, and rolls it back."""

from solidsph.watch.roll_back import run_watched
from solidsph.watch.symptom import Finding, Grade, Symptom
from solidsph.watch.watchdog import SYMPTOMS, Watchdog

__all__ = ["SYMPTOMS", "Finding", "Grade", "Symptom", "Watchdog", "run_watched"]
