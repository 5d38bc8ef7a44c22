"""A method of one's own: one module, and everything that trains knows it; and a kind of team of its own."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pytest

from fireworld.draws import WEIGHT, below
from fireworld.errors import TrainingError, expected
from fireworld.policy.kernel import always
from fireworld.policy.teams.team import KINDS, Team, TeamDifference, compare_teams, load_team, no_states
from fireworld.records import ACTIONS
from fireworld.shown import SHOWN_MAX, TextTable
from fireworld.simulation.built import CityCache
from fireworld.training import methods
from fireworld.training.method import Count, Method, Report, Trainer
from fireworld.training.methods import METHODS, method_names
from fireworld.training.train import train
from fireworld.training.training import StopTraining


@dataclass(frozen=True, eq=False, repr=False)
class FixedTeam(Team):
    """All brigades take one action."""

    kind: ClassVar[str] = "fixed"
    what: ClassVar[str] = "a fixed action"

    action: int
    provenance: dict = field(default_factory=dict)

    @property
    def digest(self):
        return self.policy().digest

    @property
    def summary(self):
        return f"always {ACTIONS[self.action]}"

    def policy(self):
        return always(self.action)

    def arrays(self):
        return {"action": np.array([self.action])}

    @classmethod
    def from_file(cls, header, arrays, *, provenance, source):
        del header
        action = int(arrays.pop("action")[0])
        if action not in range(len(ACTIONS)):
            raise TrainingError(expected(source, "action", "one of the four", action))
        return cls(action, provenance)

    def describe(self, *, states=(), limit=SHOWN_MAX):
        no_states(self.what, states)
        yield self.summary
        yield TextTable(["action", "number"], [[ACTIONS[self.action], str(self.action)]])

    def as_dict(self, *, states=(), limit=SHOWN_MAX):
        no_states(self.what, states)
        return {"action": self.action}

    def difference(self, other):
        return FixedDifference(self.action, other.action)


KINDS.pop(FixedTeam.kind)  # only the tests below are to know it


@dataclass(frozen=True)
class FixedDifference(TeamDifference):
    """Whether the actions are the same."""

    a: int
    b: int

    @property
    def same(self):
        return self.a == self.b

    def describe(self, *, limit=SHOWN_MAX):
        yield f"{ACTIONS[self.a]} / {ACTIONS[self.b]}"

    def as_dict(self, *, limit=SHOWN_MAX):
        return {"actions": [self.a, self.b]}


@dataclass(frozen=True, kw_only=True)
class Guess(Method):
    """Draws actions and takes the last."""

    name: ClassVar[str] = "guess"
    curriculum: ClassVar[str] = "paper"

    n_guesses: Count = 4

    def trainer(self, curriculum, *, seed, cities=None):
        return GuessTrainer(curriculum, self, seed=seed, cities=cities)


@dataclass(frozen=True, kw_only=True)
class GuessReport(Report):
    guess: int
    action: int

    @property
    def text(self):
        return f"guess {self.guess + 1}: {ACTIONS[self.action]}"


class GuessTrainer(Trainer[Guess, GuessReport]):
    report_type = GuessReport
    unit = "guess"
    plots: ClassVar = {"action": "Action"}

    def __init__(self, curriculum, method, *, seed, cities=None):
        super().__init__(curriculum, method, seed=seed)
        self.n_done = 0
        self.action = 0
        assert cities is None or isinstance(cities, CityCache)

    @property
    def share_done(self):
        return self.n_done / self.method.n_guesses

    def run(self, workers):
        while not self.done:
            self.action = below(self.seed, WEIGHT, self.n_done, 0, bound=len(ACTIONS))
            self.n_done += 1
            yield GuessReport(milestone=True, guess=self.n_done - 1, action=self.action)

    def team(self):
        return FixedTeam(self.action, {**self.identity, "guesses_done": self.n_done})

    def state(self):
        return {"n_done": np.array([self.n_done])}

    def restore(self, team, state, *, source):
        if "n_done" not in state or not isinstance(team, FixedTeam):
            raise TrainingError(expected(source, "", "a checkpoint of guesses", "none"))
        self.n_done, self.action = int(state["n_done"][0]), team.action

    def points(self, report):
        return {"action": {"": float(report.action)}}


@pytest.fixture
def guessing(here, monkeypatch):
    """The method is registered, as its module would be found."""
    monkeypatch.setitem(METHODS, "guess", Guess())
    monkeypatch.setitem(KINDS, "fixed", FixedTeam)
    return ("train", "tiny.yaml", "--method", "guess")


def test_from_the_command_line(here, fireworld, guessing):
    done = fireworld(*guessing, "-o", "a.npz", "--log", "a.csv", "--seed", 5)
    team = load_team("a.npz")
    assert (done.code, done.out) == (0, f"a.npz: seed 5, {team.summary}, digest {team.digest}\n")
    assert [line.split(":")[1] for line in done.err.splitlines()] == [f" guess {k}" for k in (1, 2, 3, 4)]
    lines = (here / "a.csv").read_text().splitlines()
    assert (lines[0], len(lines)) == ("guess,action", 5)
    assert done.err.splitlines()[-1].endswith(ACTIONS[team.action])
    assert fireworld("run", "quick", "--policy", "a.npz", "--steps", 3).code == 0
    assert fireworld(*guessing, "-o", "b.npz", "--set", "n_guesses=0").err == (
        "fireworld: method: n_guesses: expected a whole number from 1 to 1000000, got 0\n"
    )
    assert fireworld("train", "-o", "b.npz", "--method", "gues").err == (
        "fireworld: --method: expected one of paper, assignment, evolution, gates, imitation, rollouts, sarsa, search, "
        "targets, guess, got 'gues'\n"
    )


def test_a_module_in_the_folder_is_all_it_takes(here, fireworld, monkeypatch, guessing):
    monkeypatch.delitem(METHODS, "guess")
    assert fireworld(*guessing, "-o", "a.npz").code == 2
    (here / "guess.py").write_text("from tests.training.test_new_method import Guess\n\nMETHOD = Guess()\n")
    monkeypatch.setattr(methods, "__path__", [*methods.__path__, str(here)])
    assert method_names() == [
        "paper",
        "assignment",
        "evolution",
        "gates",
        "imitation",
        "rollouts",
        "sarsa",
        "search",
        "targets",
        "guess",
    ]
    assert fireworld(*guessing, "-o", "a.npz").code == 0
    monkeypatch.delitem(sys.modules, f"{methods.__name__}.guess")


def test_stopped_and_resumed(here, guessing):
    def stop(training, report):
        if training.n_reports == 2:
            raise StopTraining

    options = {"method": "guess", "output": "a.npz", "log": "a.csv"}
    train("tiny.yaml", **options, callbacks=[stop])
    assert (here / "a.npz.checkpoint").exists()
    team = train("tiny.yaml", **options, resume=True)
    whole = train("tiny.yaml", method=Guess(), output="whole.npz", log="whole.csv")
    assert team.digest == whole.digest
    for suffix in ("npz", "csv"):
        assert (here / f"a.{suffix}").read_bytes() == (here / f"whole.{suffix}").read_bytes()


def test_its_teams_show_themselves(here, fireworld, guessing):
    for action, name in ((2, "a.npz"), (3, "b.npz")):
        FixedTeam(action).save(name)
    assert fireworld("policy", "show", "a.npz").out.startswith("a.npz: always nearest-to-center\n")
    assert fireworld("policy", "show", "a.npz", "7").err == (
        "fireworld: STATE: expected none: a fixed action has no states, got '7'\n"
    )
    differing = fireworld("policy", "diff", "a.npz", "b.npz")
    assert (differing.code, differing.out) == (1, "nearest-to-center / nearest-to-me\n")
    assert fireworld("policy", "diff", "a.npz", "a.npz", "--json").code == 0
    assert fireworld("policy", "diff", "a.npz", "a.npz", "--actions-only").code == 2
    team = load_team("a.npz")
    assert repr(team) == f"<FixedTeam: always nearest-to-center, digest {team.digest[:12]}>"
    assert '<td class="text">nearest-to-center</td>' in team._repr_html_()
    with pytest.raises(TrainingError, match=r"^B: expected a fixed action, as in A, got a ranking of targets$"):
        compare_teams(team, load_team("best-2026"))
