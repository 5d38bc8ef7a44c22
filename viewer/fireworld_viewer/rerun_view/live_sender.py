"""Send what happens to Rerun's viewer without ever waiting for it: a thread, a bounded queue, a pipe to a process."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Sequence
from threading import Condition, Thread
from typing import Final, Generic, TypeVar

from fireworld.errors import ViewError
from fireworld_viewer.rerun_view.app import viewer_environment

Item = TypeVar("Item")

BATCH_SECONDS: Final = 0.2
"""Time between batches: a viewer redraws some times a second, and fewer, larger batches cost the run less."""
BATCH_MAX: Final = 200
PATIENCE_SECONDS: Final = 5.0  # how long the end waits for a viewer that takes nothing
_PIECE_BYTES: Final = 1 << 16


class ViewerProcess:
    """A process of Rerun's program that reads its standard input: the viewer itself, or a relay to one that runs.

    It may stay when the input ends, as a window does that somebody still looks at. ViewError if it cannot be started.
    """

    def __init__(self, command: Sequence[str], *, stays: bool) -> None:
        self._stays = stays
        try:
            self._process = subprocess.Popen(  # noqa: S603 - our own command
                command,
                env=viewer_environment(os.environ),
                bufsize=0,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C is for the run
            )
        except OSError as error:
            raise ViewError(f"--view: Rerun's viewer cannot be started: {error.strerror or error}") from None
        assert self._process.stdin is not None  # noqa: S101 - asked for above
        self._input = self._process.stdin

    def write(self, content: bytes) -> int:
        """Write some or all, waiting while the viewer is busy; return how many bytes. OSError if it is closed."""
        return self._input.write(content[:_PIECE_BYTES]) or 0

    def close(self, *, finished: bool) -> bool:
        """End the input, and abandon the rest unless all was written (`finished`); return whether all has been sent.

        A relay is given the time to send it.
        """
        if finished:
            self._input.close()
        if self._stays:
            self._process.returncode = 0  # it is the user's from now on: no warning that it still runs
            return finished
        try:
            self._process.wait(PATIENCE_SECONDS if finished else 0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._input.close()  # again where all was written; else the process is dead, and the writing thread fails
        return finished and self._process.returncode == 0


class BackgroundSender(Generic[Item]):
    """Sends items in batches. `put` never waits; if too many items wait, every second of them is left out.

    `encode` makes the bytes of a batch, in the sender's thread. `n_waiting_max` bounds the memory. `warn` is called at
    most once, with a line on what the viewer does not show and why.
    """

    def __init__(
        self,
        encode: Callable[[Sequence[Item]], bytes],
        process: ViewerProcess,
        *,
        n_waiting_max: int,
        warn: Callable[[str], None],
    ) -> None:
        self.n_left_out = 0
        self._encode, self._process, self._warn = encode, process, warn
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
        """Send the rest, as long as the viewer takes it."""
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
        finished = self._process.close(finished=finished)
        if failed:
            return
        if not finished:
            self._warn("view: the viewer did not take the last of it")
        elif self.n_left_out:
            self._warn(f"view: the viewer is slower than the run; {self.n_left_out} steps are left out in it")

    def _work(self) -> None:
        try:
            while batch := self._next_batch():
                content = self._encode(batch)
                while content:
                    content = content[self._process.write(content) :]
                    self._n_pieces += 1
        except OSError:
            self._give_up("the viewer is closed")
        except Exception as error:  # noqa: BLE001 - whatever is wrong with the view, the run continues
            self._give_up(f"{type(error).__name__}: {error}")

    def _next_batch(self) -> list[Item]:
        """Wait for items, and a little longer for more; return an empty batch at the end."""
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
        self._warn(f"view: {reason}; the run continues without it")
