"""What a hook is: a callback of one training that has a beginning and an end, and that cannot end the training."""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final, final

from fireworld.errors import FireworldError, OutputError, described

if TYPE_CHECKING:
    from fireworld.training.method import Report
    from fireworld.training.training import Training

DONE: Final = "done"
STOPPED: Final = "stopped"
FAILED: Final = "failed"


class StopTraining(Exception):  # noqa: N818 - not an error
    """Raise it in a callback to stop a training: as Ctrl-C does, after what is under way, with a checkpoint."""


def _warn(line: str) -> None:
    warnings.warn(line, stacklevel=2)


class Hook(ABC):
    """A callback of one training that has a beginning and an end.

    What goes wrong before the first report ends the training, since nothing is lost yet. Of what goes wrong later there
    is one warning, and the training continues without the hook.

    Attributes:
        warn: called with one line if something goes wrong.
        failure: what went wrong, in one line; "" if nothing did.
    """

    warn: Callable[[str], object] = staticmethod(_warn)
    failure: str = ""
    _open: bool = False

    @property
    @abstractmethod
    def name(self) -> str:
        """What warnings call it, with its place: "TensorBoard runs/a"."""

    @property
    def path(self) -> Path | None:
        """The file that it writes, if it writes one."""
        return None

    def check(self, training: Training) -> None:
        """See that it can begin, before there is any work; raise FireworldError if not."""
        del training

    @abstractmethod
    def begin(self, training: Training) -> None:
        """Begin, or continue if `training.continues`: then there have been `training.n_reports` before."""

    @abstractmethod
    def write(self, training: Training, report: Report) -> None:
        """Write a report, the one numbered `training.n_reports - 1`; `training.numbers(report)` are its numbers."""

    def end(self, training: Training) -> None:
        """Write what there is to be written at the end; `training.ending` says which it is."""
        del training

    def close(self) -> None:
        """Close what is open; always called at last, even if something went wrong."""
        self._open = False

    @final
    def start(self, training: Training) -> None:
        """Begin.

        Raises:
            FireworldError: it cannot.
        """
        self.failure, self._open = "", True
        try:
            self.begin(training)
        except Exception as error:  # a tool of others may raise anything
            self.failure = described(error)
            if isinstance(error, FireworldError):
                raise
            raise OutputError(f"{self.name}: cannot begin: {self.failure}") from error

    @final
    def __call__(self, training: Training, report: Report) -> None:
        """Write a report, if nothing has gone wrong so far."""
        self._try("the training continues without it", lambda: self.write(training, report))

    @final
    def finish(self, training: Training) -> None:
        """End, and close what is open."""
        if not self._open:
            return
        self._try("its end is missing", lambda: self.end(training))
        with suppress(Exception):
            self.close()
        self._open = False

    def _try(self, consequence: str, work: Callable[[], None]) -> None:
        if self.failure:
            return
        try:
            work()
        except StopTraining:
            raise
        except Exception as error:  # noqa: BLE001 - a tool of others may raise anything
            self.failure = described(error)
            self.warn(f"{self.name}: {self.failure}; {consequence}")
