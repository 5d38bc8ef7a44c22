"""Searches that write files: a team file at the end, a checkpoint after every generation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import Final

import numpy as np

from fireworld.errors import OutputError, TrainingError, expected
from fireworld.files import check_output
from fireworld.kernels.ranking import N_WEIGHTS
from fireworld.policy.npz import check_arrays, check_finite, read_bytes
from fireworld.policy.ranking import Ranking, parse_ranking, save_ranking
from fireworld.training.checkpoint import check_no_checkpoint, check_same, checkpoint_path
from fireworld.training.search import Generation, Searcher, State

IDENTITY: Final = ("method", "seed", "curriculum")
"""What a search must have begun with to be gone on with."""


@dataclass
class SearchRun:
    """One search and its files."""

    searcher: Searcher
    path: Path
    force: bool = False
    ranking: Ranking | None = None
    """What was found, once its file is written."""

    @property
    def checkpoint(self) -> Path:
        """Where an unfinished search is kept."""
        return checkpoint_path(self.path)

    def begin(self) -> None:
        """See that nothing is in the way.

        Raises:
            OutputError: something is.
        """
        check_output(self.path, force=self.force)
        check_no_checkpoint(self.checkpoint, force=self.force)

    def resume(self) -> bool:
        """Go on where an earlier call stopped; tell whether there was something to go on from.

        Raises:
            TrainingError: a file of another search, or a damaged one.
            OutputError: a file is in the way.
        """
        if self.path.exists():
            self.ranking, _ = parse_ranking(read_bytes(self.path), source=str(self.path))
            self._check_identity(self.ranking, self.path)
            return True
        if not self.checkpoint.exists():
            self.begin()
            return False
        source = str(self.checkpoint)
        found, arrays = parse_ranking(read_bytes(self.checkpoint), source=source)
        self._check_identity(found, self.checkpoint)
        check_arrays(arrays, "spread", "generation", source=source)
        spread, generation = arrays["spread"], arrays["generation"]
        if spread.shape != (N_WEIGHTS,) or spread.dtype != np.float64 or (spread < 0).any():
            wanted = f"{N_WEIGHTS} numbers >= 0"
            raise TrainingError(expected(source, "spread", wanted, f"{spread.dtype} {spread.shape}"))
        check_finite(spread, "spread", source=source)
        n = self.searcher.search.n_generations
        if generation.shape != (1,) or generation.dtype != np.int64 or not 0 <= generation[0] <= n:
            raise TrainingError(expected(source, "generation", f"a whole number up to {n}", str(generation.tolist())))
        self.searcher.state = State(int(generation[0]), found.weights[0].copy(), spread.copy())
        return True

    def run(self, stop: Event, *, n_threads: int, report: Callable[[SearchRun, Generation], None]) -> None:
        """Search until done, or until asked to stop.

        Args:
            stop: set it, and the search stops before the next fight; the generation under way begins again later.
            n_threads: fights at a time.
            report: called after every generation.

        Raises:
            OutputError: a file cannot be written; the last checkpoint stays.
        """
        if self.ranking is not None:
            return
        for generation in self.searcher.run(n_threads=n_threads, stop=stop):
            self._keep()
            report(self, generation)
        if not self.searcher.done:
            self._keep()
            return
        ranking = self.searcher.ranking()
        try:
            save_ranking(ranking, self.path, force=self.force)
        except OutputError as error:
            raise OutputError(f"{error}; {self.checkpoint} is kept: go on with --resume") from None
        self.checkpoint.unlink(missing_ok=True)
        self.ranking = ranking

    def _keep(self) -> None:
        state = self.searcher.state
        extra = {"spread": state.spread, "generation": np.array([state.generation], dtype=np.int64)}
        save_ranking(self.searcher.ranking(), self.checkpoint, force=True, extra=extra)

    def _check_identity(self, found: Ranking, path: Path) -> None:
        wanted = self.searcher.ranking().provenance
        check_same(found.provenance, {key: wanted[key] for key in IDENTITY}, path)
