"""Ctrl-C that lets what is under way be finished first."""

from __future__ import annotations

import atexit
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event
from types import FrameType
from typing import Final

AGAIN_SECONDS: Final = 0.01
_lost: Final = Event()


class Interrupted(KeyboardInterrupt):
    """Ctrl-C that ended some work; the text says what is left of it."""


def end_like_ctrl_c() -> None:
    """Let SIGTERM, by which CI systems and `timeout` end a process, do what Ctrl-C does."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        _lost.clear()


def once_more() -> None:
    """Send Ctrl-C again, in a moment: it came where Python lets nothing raise, in a finalizer."""
    _lost.set()
    timer = threading.Timer(AGAIN_SECONDS, _send)
    timer.daemon = True
    timer.start()


def no_more() -> None:
    """Send no Ctrl-C again, and end with an exit code: the program is at its end."""
    _lost.clear()
    atexit.unregister(_ignore)
    atexit.register(_ignore)
    # Python ends by a signal of its own after a Ctrl-C that came while it executed text, as dataclasses do, caught or
    # not; to execute a text again makes it forget that.
    exec("")  # noqa: S102


def _ignore() -> None:
    """Let nothing end a program whose work is done, while Python puts itself away."""
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):  # ignored: what is masked here goes to another thread
            signal.signal(number, signal.SIG_IGN)


def _send() -> None:
    if _lost.is_set():
        _lost.clear()
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)  # a real one ends a wait, too


def was_interrupted(error: BaseException) -> bool:
    """Return whether an error is what others made of Ctrl-C: compiled code, or a library under import, say."""
    seen: set[int] = set()
    cause: BaseException | None = error
    while cause is not None and id(cause) not in seen:
        if isinstance(cause, KeyboardInterrupt):
            return True
        seen.add(id(cause))
        cause = cause.__cause__ or cause.__context__
    return False


@contextmanager
def gentle_interrupt(asked: Event | None = None) -> Iterator[Event]:
    """Let the first Ctrl-C only set an event, so that what is under way is done and kept; a second one stops it.

    Args:
        asked: the event; None: a new one.
    """
    asked = asked or Event()
    previous = signal.getsignal(signal.SIGINT)
    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or previous is not signal.default_int_handler:  # ignored, as below nohup, or handled by others
        yield asked
        return

    # SIGTERM too, where it ends a process as Ctrl-C does.
    numbers = [number for number in (signal.SIGINT, signal.SIGTERM) if signal.getsignal(number) is previous]

    def note(number: int, frame: object) -> None:
        del number, frame
        asked.set()
        for one in numbers:
            signal.signal(one, previous)

    for one in numbers:
        signal.signal(one, note)
    try:
        yield asked
    finally:
        for one in numbers:
            signal.signal(one, previous)


class Postponed:
    """Ctrl-C that has to wait: foreign code is under way that would swallow it, or fail in other ways."""

    def __init__(self) -> None:
        self._previous: dict[int, Callable[[int, FrameType | None], object]] = {}
        self._asked: list[int] = []

    @contextmanager
    def __call__(self) -> Iterator[None]:
        """Keep signals back until the end, or until `let_through` is called."""
        if self._previous or threading.current_thread() is not threading.main_thread():
            yield  # within another such stretch; or in a thread, which gets no signals
            return
        for number in (signal.SIGINT, signal.SIGTERM):
            handler = signal.getsignal(number)
            if callable(handler):
                self._previous[number] = handler
                signal.signal(number, self._note)
        try:
            yield
        finally:
            for kept, handler in self._previous.items():
                signal.signal(kept, handler)
            self._previous = {}
            self._deliver({})

    def let_through(self) -> None:
        """Do what the signals that came meanwhile ask for; may raise KeyboardInterrupt."""
        if self._asked and threading.current_thread() is threading.main_thread():
            self._deliver(self._previous)

    def _deliver(self, handlers: dict[int, Callable[[int, FrameType | None], object]]) -> None:
        asked, self._asked = self._asked, []
        for number in asked:
            handler = handlers.get(number) or signal.getsignal(number)
            if callable(handler):
                handler(number, None)

    def _note(self, number: int, frame: FrameType | None) -> None:
        del frame
        self._asked.append(number)


postponed = Postponed()
"""The one of this process."""
