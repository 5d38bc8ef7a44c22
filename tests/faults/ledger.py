"""What a campaign has tried so far: a file to which every finished case is added, and the table of counts."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from tests.docs.pages import ROOT
from tests.faults.outcomes import FAILURES, Failure, Outcome

SOURCES: Final = ("fireworld", "recorder", "viewer", "tests/faults", "tests/fuzz")
COLUMNS: Final = ("cases", "tried", "processes", "refused", "survived")


@dataclass
class Tally:
    """Counts of one kind."""

    counts: Counter[str] = field(default_factory=Counter)
    failures: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0


@dataclass
class Ledger:
    """Outcomes by case, as in "kills:1000017", and how long each took.

    Attributes:
        path: the file, which `add` keeps up to date; a line for each case.
        outcomes: of the finished cases; one that is tried again has its last outcome.
        seconds: that they took, by case.
    """

    path: Path
    outcomes: dict[str, Outcome] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    @classmethod
    def begin(cls, path: Path, *, resume: bool) -> Ledger:
        """Open the file of a campaign: go on with it, or begin anew, as it must if the code is another."""
        ledger, sources = cls(path), digest_of_sources()
        if resume and path.exists():
            first, *lines = path.read_text("utf-8").splitlines() or [""]
            if first == sources:
                for line in lines:
                    ledger._read(line)
                return ledger
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{sources}\n", "utf-8")
        return ledger

    def _read(self, line: str) -> None:
        try:
            found = json.loads(line)
        except ValueError:  # the campaign was killed while it wrote the line
            return
        failures = [Failure(**one) for one in found["outcome"].pop("failures")]
        self.outcomes[found["case"]] = Outcome(**found["outcome"], failures=failures)
        self.seconds[found["case"]] = found["seconds"]

    def add(self, case: str, outcome: Outcome, seconds: float) -> None:
        """Note that a case is finished."""
        self.outcomes[case], self.seconds[case] = outcome, seconds
        line = json.dumps({"case": case, "seconds": round(seconds, 3), "outcome": dataclasses.asdict(outcome)})
        with self.path.open("a", encoding="utf-8") as file:
            file.write(f"{line}\n")

    @property
    def failed(self) -> list[str]:
        """The cases that failed."""
        return [case for case, outcome in self.outcomes.items() if outcome.failures]

    def tallies(self) -> dict[str, Tally]:
        """Return the counts by kind."""
        found: dict[str, Tally] = {}
        for case, outcome in self.outcomes.items():
            tally = found.setdefault(case.partition(":")[0], Tally())
            row = (1, outcome.n_inputs, outcome.n_processes, outcome.refused, outcome.survived)
            tally.counts.update(dict(zip(COLUMNS, row, strict=True)))
            tally.failures.update({failure.kind for failure in outcome.failures})
            tally.seconds += self.seconds[case]
        return found

    def table(self) -> str:
        """Return the counts as a table, and below it every failure with the command that repeats it."""
        tallies = self.tallies()
        total = Tally()
        for tally in tallies.values():
            total.counts.update(tally.counts)
            total.failures.update(tally.failures)
            total.seconds += tally.seconds
        head = ["kind", *COLUMNS, *(f"{name}s" if name == "traceback" else name for name in FAILURES), "seconds"]
        rows = [head]
        for name, tally in [*tallies.items(), ("all", total)]:
            counts = [f"{tally.counts[column]:,}" for column in COLUMNS]
            failures = [f"{tally.failures[kind]:,}" for kind in FAILURES]
            rows.append([name, *counts, *failures, f"{tally.seconds:.0f}"])
        widths = [max(len(row[i]) for row in rows) for i in range(len(head))]
        lines = [
            row[0].ljust(widths[0])
            + "".join("   " + cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))
            for row in rows
        ]
        notes = sorted({note for outcome in self.outcomes.values() for note in outcome.notes})
        return "\n".join([*lines, *([""] if notes else []), *notes, *self._complaints()])

    def _complaints(self) -> list[str]:
        lines = []
        for case in self.failed:
            lines += ["", f"{case}: python -m tests.faults.campaign --case {case!r}"]
            lines += [f"  {failure.kind}: {failure.text}" for failure in self.outcomes[case].failures]
        return lines


def digest_of_sources() -> str:
    """Return a digest of all code that a campaign tries, and of its own."""
    digest = hashlib.sha256()
    for folder in SOURCES:
        for path in sorted((ROOT / folder).rglob("*.py")):
            digest.update(f"{path.relative_to(ROOT)}\n".encode() + path.read_bytes())
    return digest.hexdigest()
