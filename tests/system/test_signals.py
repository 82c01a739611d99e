"""Signals wait for the end of a block."""

from __future__ import annotations

import signal
import threading

import pytest

from solidsph.system.signals import uninterrupted


def test_an_interruption_is_heard_after_the_block() -> None:
    done = []

    def write() -> None:
        with uninterrupted():
            signal.raise_signal(signal.SIGINT)
            done.append("all of it")
        done.append("never")

    with pytest.raises(KeyboardInterrupt):
        write()
    assert done == ["all of it"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_error_in_the_block_gives_the_handlers_back() -> None:
    def fail() -> None:
        with uninterrupted():
            raise ValueError("a mistake")

    with pytest.raises(ValueError, match="a mistake"):
        fail()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_other_threads_hear_no_signals() -> None:
    done = []

    def write() -> None:
        with uninterrupted():
            done.append(threading.current_thread() is threading.main_thread())

    thread = threading.Thread(target=write)
    thread.start()
    thread.join()
    assert done == [False]
