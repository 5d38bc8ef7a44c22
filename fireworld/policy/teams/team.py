"""Team: what was learned, of whatever kind. Its file, its policy, how it shows itself; and the registry of kinds."""

from __future__ import annotations

import importlib
import io
import pkgutil
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, ClassVar, Final, Self

from fireworld.errors import PolicyError, TrainingError, expected
from fireworld.files import check_output, written_beside
from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.teams import team_names, team_path
from fireworld.policy.teams.npz import SUFFIX, pack_arrays, parse_arrays, read_bytes
from fireworld.shown import SHOWN_MAX, Block, Shown

FORMAT: Final = "fireworld-team/2"
KIND_OF_OLD_FORMAT: Final = {"fireworld-team/1": "tables", "fireworld-ranking/1": "ranking"}
"""Formats of one kind each, which are still read."""
OLD_METHOD: Final = "paper"
"""The method of teams whose file does not name one."""

MEAN_OF: Final = "mean_of"
"""The key of a provenance under which are those of the networks that a team is the mean of."""
KINDS: Final[dict[str, type[Team]]] = {}
"""Kinds of teams by name; a subclass of `Team` enters itself."""


class Team(Shown):
    """What was learned, and where it comes from. A kind of team is a subclass with a `kind`, in a module of its own.

    Attributes:
        kind: the name of the kind, as in team files.
        what: the kind in words, as in "tables of actions".
        provenance: curriculum, method, seed and version as plain values.
    """

    kind: ClassVar[str] = ""
    what: ClassVar[str]
    provenance: Mapping[str, Any]

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "kind" in vars(cls):
            KINDS[cls.kind] = cls

    @property
    @abstractmethod
    def digest(self) -> str:
        """SHA-256 of what the brigades follow."""

    @property
    @abstractmethod
    def summary(self) -> str:
        """What the team consists of, in a few words."""

    @abstractmethod
    def policy(self) -> KernelPolicy:
        """Return the policy of the team."""

    @abstractmethod
    def arrays(self) -> dict[str, Array]:
        """Return what the file holds, by name."""

    def header(self) -> dict[str, Any]:
        """Return what the file's header holds besides kind and provenance, as plain values."""
        return {}

    @classmethod
    @abstractmethod
    def from_file(
        cls, header: dict[str, Any], arrays: dict[str, Array], *, provenance: Mapping[str, Any], source: str
    ) -> Self:
        """Make a team of what its file holds.

        Args:
            header: the file's; the keys of the team are taken out.
            arrays: by name; those of the team are taken out, too.
            provenance: where it comes from.
            source: what errors call the file.

        Raises:
            TrainingError: it makes no sense.
        """

    @abstractmethod
    def describe(self, *, states: Sequence[str] = (), limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield what the team is and does.

        Args:
            states: numbers or features of states to explain, where the kind has states.
            limit: entries of a list at most.

        Raises:
            PolicyError: no such state, or the kind has none.
        """

    @abstractmethod
    def as_dict(self, *, states: Sequence[str] = (), limit: int = SHOWN_MAX) -> dict[str, Any]:
        """Return what `describe` shows as plain values; arguments and errors are the same."""

    @abstractmethod
    def difference(self, other: Self) -> TeamDifference:
        """Compare another team of this kind with this one; see `compare_teams`."""

    @property
    def choices(self) -> str:
        """The scenario's `choices` that the brigades were trained with; empty if unknown."""
        found = self._method.get("choices")
        return str(found) if found in ("in-turn", "simultaneous") else ""

    @property
    def origin(self) -> list[str]:
        """Where the team comes from, in lines, as far as it is known."""
        return _origin(self.provenance)

    @property
    def short_provenance(self) -> dict[str, Any]:
        """Where the team comes from, curricula by their names and digests alone."""
        return _short(self.provenance)

    def save(self, path: Path | str, *, force: bool = False) -> None:
        """Write the team file, beside its place and renamed; equal teams give equal bytes.

        Raises:
            OutputError: the file exists and `force` does not replace it, or it cannot be written.
        """
        write_team(self, Path(path), force=force)

    def to_bytes(self) -> bytes:
        """Return the content of the team file."""
        stream = io.BytesIO()
        pack_arrays(stream, _header(self), self.arrays())
        return stream.getvalue()

    def __repr__(self) -> str:
        origin = self.origin[:1] if isinstance(self.provenance.get("curriculum"), dict) else []
        return f"<{type(self).__name__}: {', '.join([self.summary, *origin])}, digest {self.digest[:12]}>"

    @property
    def _method(self) -> Mapping[str, Any]:
        method = self.provenance.get("method")
        return method if isinstance(method, Mapping) else {}


class TeamDifference(Shown):
    """How two teams of one kind differ."""

    what: ClassVar[str] = "teams of another kind"

    @property
    @abstractmethod
    def same(self) -> bool:
        """Whether they are the same."""

    @property
    def same_actions(self) -> bool:
        """Whether they do the same; TrainingError where the kind has no actions beside values."""
        raise TrainingError(expected("--actions-only", "", "two teams with tables of actions", self.what))

    @abstractmethod
    def as_dict(self, *, limit: int = SHOWN_MAX) -> dict[str, Any]:
        """Return what `describe` shows as plain values."""


def compare_teams(a: Team, b: Team, *, names: tuple[str, str] = ("A", "B")) -> TeamDifference:
    """Compare team B with team A, which errors call by these names; TrainingError if they cannot be compared."""
    if a.kind != b.kind:
        raise TrainingError(expected(names[1], "", f"{a.what}, as in {names[0]}", b.what))
    return a.difference(b)


def no_states(what: str, states: Sequence[str]) -> None:
    """Raise PolicyError if states are asked for, of a kind of team that has none."""
    if states:
        raise PolicyError(expected("STATE", "", f"none: {what} has no states", states[0]))


def load_team(name_or_path: str | Path) -> Team:
    """Load a team that comes with fireworld by its name, or a team file of any kind.

    Args:
        name_or_path: as in "paper-cooperative" or "team.npz".

    Raises:
        TrainingError: no such team, or not a team file, or one that makes no sense.
    """
    name, names = str(name_or_path), team_names()
    if name in names:
        return read_team(team_path(name))[0]
    if not Path(name).suffix and not Path(name).exists():
        near = get_close_matches(name, names, n=1)
        wanted = f"a team file ({SUFFIX}) or one of " + ", ".join(names)
        raise TrainingError(expected("TEAM", "", wanted, name, f"try {near[0]}" if near else ""))
    return read_team(Path(name))[0]


def parse_team(content: bytes, *, source: str) -> Team:
    """Read the content of a team file of any kind; TrainingError, which names the source, if it makes no sense."""
    return _parse(content, source=source)[0]


def read_team(path: Path) -> tuple[Team, dict[str, Array]]:
    """Read a team file, and the arrays that it holds besides the team's, as a checkpoint does; errors as there."""
    return _parse(read_bytes(path), source=str(path))


def write_team(team: Team, path: Path, *, force: bool = False, extra: Mapping[str, Array] | None = None) -> None:
    """Write a team file as `Team.save` does, with `extra` arrays by name, as a checkpoint has."""
    check_output(path, force=force)
    with written_beside(path) as partial:
        pack_arrays(partial, _header(team), {**team.arrays(), **(extra or {})})


def kinds() -> Mapping[str, type[Team]]:
    """Return all kinds of teams by name: those of this folder, and those that were defined elsewhere."""
    package = __name__.rpartition(".")[0]
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        if module.name.endswith("_team"):
            importlib.import_module(f"{package}.{module.name}")
    return KINDS


def _header(team: Team) -> dict[str, Any]:
    return {"format": FORMAT, "kind": team.kind, "provenance": team.provenance, **team.header()}


def _parse(content: bytes, *, source: str) -> tuple[Team, dict[str, Array]]:
    header, arrays = parse_arrays(content, source=source)
    form = header.pop("format", None)
    known = kinds()
    if form == FORMAT:
        kind, provenance = header.pop("kind", None), header.pop("provenance", None)
        if not isinstance(kind, str) or kind not in known:
            hint = "made by a later fireworld?"
            raise TrainingError(expected(source, "kind", "one of " + ", ".join(sorted(known)), kind, hint))
        if not isinstance(provenance, dict):
            raise TrainingError(expected(source, "provenance", "keys and values", provenance))
    elif isinstance(form, str) and form in KIND_OF_OLD_FORMAT:
        kind, provenance = KIND_OF_OLD_FORMAT[form], header
        if kind == "tables" and isinstance(provenance.get("method"), dict):
            provenance["method"] = {"name": OLD_METHOD, **provenance["method"]}
    else:
        is_later = isinstance(form, str) and form.startswith(("fireworld-team/", "fireworld-ranking/"))
        raise TrainingError(expected(source, "format", FORMAT, form, "made by a later fireworld?" if is_later else ""))
    return known[kind].from_file(header, arrays, provenance=provenance, source=source), arrays


def _origin(provenance: Mapping[str, Any]) -> list[str]:
    """Return where a team comes from, in lines, as far as it is known."""
    lines, curriculum, method = list[str](), provenance.get("curriculum"), provenance.get("method")
    if isinstance(curriculum, dict):
        done = [f"{n} {key.removesuffix('_done')}" for key, n in provenance.items() if key.endswith("_done")]
        lines.append(", ".join([f"trained in {curriculum.get('name')}", *done, f"seed {provenance.get('seed')}"]))
    if isinstance(method, Mapping) and method:
        lines.append("method " + ", ".join(f"{key} {value}" for key, value in method.items()))
    for one in _meant(provenance):
        lines += [f"mean of {str(one.get('digest'))[:12]}", *(f"  {line}" for line in _origin(one))]
    return lines


def _short(provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Return where a team comes from, curricula by their names and digests alone."""
    short = dict(provenance)
    curriculum = short.get("curriculum")
    if isinstance(curriculum, dict):
        short["curriculum"] = {key: curriculum.get(key) for key in ("name", "digest")}
    if meant := _meant(provenance):
        short[MEAN_OF] = [_short(one) for one in meant]
    return short


def _meant(provenance: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return where the networks come from that a team is the mean of; nothing if it is none."""
    found = provenance.get(MEAN_OF)
    return found if isinstance(found, list) and all(isinstance(one, dict) for one in found) else []
