"""Bring what happens to Rerun's viewer, which never makes it wait: a thread, a bounded queue, a pipe to a process."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping, Sequence
from threading import Condition, Thread
from typing import Final, Generic, TypeVar

from fireworld.errors import ViewError

Item = TypeVar("Item")

BATCH_SECONDS: Final = 0.2
"""Time between batches: a viewer redraws some times a second, and fewer, larger batches cost the run less."""
BATCH_MAX: Final = 200
PATIENCE_SECONDS: Final = 5.0
"""How long the end waits for a viewer that takes nothing."""
_PIECE_BYTES: Final = 1 << 16


class ViewerPipe:
    """A process of Rerun's program that reads its standard input: the viewer itself, or a bringer to one that runs.

    Args:
        command: the program and its arguments.
        environment: of the process.
        stays: it goes on when the input ends, as a window does that somebody still looks at.

    Raises:
        ViewError: it cannot be started.
    """

    def __init__(self, command: Sequence[str], environment: Mapping[str, str], *, stays: bool) -> None:
        self._stays = stays
        try:
            self._process = subprocess.Popen(  # noqa: S603 - our own command
                command,
                env=environment,
                bufsize=0,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C is for the run
            )
        except OSError as error:
            raise ViewError(f"--view: Rerun's viewer cannot be started: {error.strerror or error}") from None

    def write(self, content: bytes) -> int:
        """Write a piece; wait while the viewer is busy. Returns the bytes written, some or all.

        Raises:
            OSError: the viewer is closed.
        """
        assert self._process.stdin is not None  # noqa: S101 - asked for above
        return self._process.stdin.write(content[:_PIECE_BYTES]) or 0

    def close(self, *, finished: bool) -> bool:
        """End the input; a bringer is given the time to bring the rest. Returns whether it has.

        Args:
            finished: all was written; else what is under way is given up.
        """
        assert self._process.stdin is not None  # noqa: S101 - as above
        if finished:
            self._process.stdin.close()
        if self._stays:
            self._process.returncode = 0  # it is the user's from now on: no warning that it still runs
            return finished
        try:
            self._process.wait(PATIENCE_SECONDS if finished else 0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdin.close()  # once more where all was written; else nobody writes to a dead process for long
        return finished and self._process.returncode == 0


class Courier(Generic[Item]):
    """Brings items in batches. Who puts one never waits; if too many wait, every second of them is left out.

    Args:
        encode: makes the bytes of a batch, in the courier's thread.
        pipe: where they go.
        n_waiting_max: items that may wait, which bounds the memory.
        tell: told, once, why nothing is brought any more.
    """

    def __init__(
        self,
        encode: Callable[[Sequence[Item]], bytes],
        pipe: ViewerPipe,
        *,
        n_waiting_max: int,
        tell: Callable[[str], None],
    ) -> None:
        self.n_left_out = 0
        self._encode, self._pipe, self._tell = encode, pipe, tell
        self._n_waiting_max = n_waiting_max
        self._waiting: list[Item] = []
        self._changed = Condition()
        self._closing = self._failed = False
        self._n_pieces = 0
        self._thread = Thread(target=self._work, name="live view", daemon=True)  # may hang in a viewer that does
        self._thread.start()

    def put(self, item: Item) -> None:
        """Hand over an item."""
        with self._changed:
            if self._failed:
                return
            if len(self._waiting) >= self._n_waiting_max:
                n_before = len(self._waiting)
                del self._waiting[1::2]
                self.n_left_out += n_before - len(self._waiting)
            self._waiting.append(item)
            self._changed.notify()

    def close(self) -> None:
        """Bring the rest, as long as the viewer takes it."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        n_before = -1
        while self._thread.is_alive() and n_before != self._n_pieces:
            n_before = self._n_pieces
            self._thread.join(PATIENCE_SECONDS)
        with self._changed:
            failed, finished = self._failed, not self._thread.is_alive()
            self._failed = True
        finished = self._pipe.close(finished=finished)
        if failed:
            return
        if not finished:
            self._tell("view: the viewer has not taken the end of it")
        elif self.n_left_out:
            self._tell(f"view: it is slower than the run; {self.n_left_out} steps are left out in it")

    def _work(self) -> None:
        try:
            while batch := self._next_batch():
                content = self._encode(batch)
                while content:
                    content = content[self._pipe.write(content) :]
                    self._n_pieces += 1
        except OSError:
            self._give_up("the viewer is closed")
        except Exception as error:  # noqa: BLE001 - whatever is wrong with the view, the run goes on
            self._give_up(f"{type(error).__name__}: {error}")

    def _next_batch(self) -> list[Item]:
        """Wait for items, and a little longer for more; an empty batch at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closing)
            if not self._closing:
                self._changed.wait_for(lambda: self._closing, BATCH_SECONDS)
            batch = self._waiting[:BATCH_MAX]
            del self._waiting[:BATCH_MAX]
            return batch

    def _give_up(self, reason: str) -> None:
        with self._changed:
            if self._failed:
                return
            self._failed = True
            self._waiting.clear()
        self._tell(f"view: {reason}; the run goes on without it")
