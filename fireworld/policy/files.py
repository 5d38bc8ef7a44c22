"""Team files of either kind: tables of values, and rankings of targets."""

from __future__ import annotations

from pathlib import Path

from fireworld.policy import ranking
from fireworld.policy.npz import parse_arrays, read_bytes
from fireworld.policy.ranking import Ranking, ranking_of
from fireworld.policy.team import Team, team_of


def parse_team_file(content: bytes, *, source: str) -> Team | Ranking:
    """Read the content of a team file of either kind.

    Args:
        content: of the file.
        source: what errors call it.

    Raises:
        TrainingError: it is not a team file, of another format, or makes no sense.
    """
    header, arrays = parse_arrays(content, source=source)
    if str(header.get("format")).startswith(ranking.FORMAT.partition("/")[0]):
        return ranking_of(header, arrays, source=source)[0]
    return team_of(header, arrays, source=source)[0]


def load_team_file(path: Path) -> Team | Ranking:
    """Read a team file of either kind.

    Raises:
        TrainingError: as for `parse_team_file`.
    """
    return parse_team_file(read_bytes(path), source=str(path))
