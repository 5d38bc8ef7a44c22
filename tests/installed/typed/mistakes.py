"""Mistakes on the front door that mypy --strict finds; an ignore that is not needed is an error, too."""

import fireworld as fw

fw.run("quick", "chief")  # type: ignore[call-arg]
fw.run("quick", seed="one")  # type: ignore[arg-type]
fw.open_log(7)  # type: ignore[arg-type]
fw.fork("a.mcap")  # type: ignore[call-arg]
points = fw.run("quick").outcome.points  # type: ignore[attr-defined]
nothing = fw.nothing  # type: ignore[attr-defined]


class Silent(fw.Policy):
    """A policy that does not decide."""

    def decide(self, observation: fw.Observation) -> None:  # type: ignore[override]
        """Return nothing."""
