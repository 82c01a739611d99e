"""Sleeping regions: those that no wave has reached, or that have come to rest, are not stepped."""

from solidsph.run.sleeping.loop import SleepingLoop, sleeping_loop

__all__ = ["SleepingLoop", "sleeping_loop"]
