"""Regions that nothing has reached yet, or that have come to rest, cost nothing."""

from solidsph.run.sleeping.loop import SleepingLoop, sleeping_loop

__all__ = ["SleepingLoop", "sleeping_loop"]
