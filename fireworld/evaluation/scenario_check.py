"""What rules that do not learn make of scenarios: a verdict for each, tables, hints, JSON and Markdown."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean
from typing import Any, Final, get_args

from fireworld.evaluation.contested import Contest, Limits
from fireworld.evaluation.inputs import seeds_text
from fireworld.evaluation.runs import Outcomes
from fireworld.evaluation.statistics import mean
from fireworld.records import ACTIONS
from fireworld.scenario import Scenario
from fireworld.shown import SHOWN_MAX, Block, Shown, TextTable, block_text

RULES: Final = (*ACTIONS, "each-another", "random")
"""Policies that learn nothing. No team that learned is asked: what a fire is called must not depend on one."""
NO_WATER: Final = "no water"
"""What stands beside the rules: the same fire, and nobody puts water on it."""
FORMAT: Final = "fireworld-scenario-check/1"
WIDTH: Final = 80
NAME_MAX: Final = 21
"""Letters of a name for which there is room in a table of 80 columns."""
NO_DIFFERENCE: Final = 0.1
"""If the scores of all rules, and that of no water, are nearer to each other than that, brigades do not matter."""


@dataclass(frozen=True, kw_only=True)
class PolicyResult:
    """How a policy came out in a scenario: means over the seeds."""

    policy: str
    """Of a rule the name."""
    score_share: float
    """Score as a share of its maximum."""
    n_burnt_out: float
    steps: float
    """Until nothing burned any more; the last step where something still did."""
    n_ended: int
    """Runs in which nothing burned any more, because it was put out or had burnt down."""


def policy_result(policy: str, outcomes: Outcomes) -> PolicyResult:
    """Return the means of the outcomes of a policy."""
    return PolicyResult(
        policy=policy,
        score_share=mean(outcomes.score_share),
        n_burnt_out=mean(outcomes.n_burnt_out),
        steps=mean(outcomes.steps),
        n_ended=int(outcomes.completed.sum()),
    )


def mean_share(rules: Sequence[PolicyResult]) -> float:
    """Return the mean score of rules, as a share of the maximum: what a fire is judged by."""
    return fmean(rule.score_share for rule in rules)


@dataclass(frozen=True, kw_only=True, repr=False)
class ScenarioCheck(Shown):
    """What the rules, and nobody, make of a scenario."""

    name: str
    """As it was asked for."""
    scenario: Scenario
    n_buildings: int
    n_burning: int
    """Buildings that its fires are lit in."""
    rules: tuple[PolicyResult, ...]
    no_water: PolicyResult
    limits: Limits
    seeds: Sequence[int]

    @property
    def results(self) -> tuple[PolicyResult, ...]:
        """Of the rules, then without water."""
        return *self.rules, self.no_water

    @property
    def score_share(self) -> float:
        """Mean score of the rules, as a share of the maximum."""
        return mean_share(self.rules)

    @property
    def lowest(self) -> float:
        """Score of the rule that comes out worst, as a share of the maximum."""
        return min(rule.score_share for rule in self.rules)

    @property
    def highest(self) -> float:
        """Score of the rule that comes out best, as a share of the maximum."""
        return max(rule.score_share for rule in self.rules)

    @property
    def verdict(self) -> Contest:
        """Whether the fire is lost, contested or held."""
        return self.limits.verdict(self.score_share)

    @property
    def brigades_matter(self) -> bool:
        """Whether it makes a difference what brigades do."""
        shares = [result.score_share for result in self.results]
        return max(shares) - min(shares) >= NO_DIFFERENCE

    @property
    def hint(self) -> str:
        """What to change if it is not contested, or if brigades hardly matter; "" if all is well."""
        fire, brigades = self.scenario.fires[0], f"brigades.n {{}} {self.scenario.brigades.n}"
        size = "buildings named in fires.0.buildings" if fire.at is None else "burning buildings (fires.0.n_buildings)"
        if self.no_water.score_share > self.limits.held_above:
            return (
                f"without any water the score is {self.no_water.score_share:.2f}: the fire hardly spreads, or harms "
                f"nobody; try more {size}, a place where houses stand closer, people near it, or more steps"
            )
        if not self.brigades_matter:
            less = f", fewer {size}" if self.n_burning > 1 else ""
            return (
                f"what brigades do makes hardly a difference: do they reach the fire? try more of them "
                f"({brigades.format('above')}), brigades that start nearer{less}"
            )
        if self.verdict == "held":
            worst = min(self.rules, key=lambda rule: rule.score_share)
            lost = f"most rules hold it, {worst.policy} does not; " if self.lowest < self.limits.lost_below else ""
            return f"{lost}try more {size}, or fewer brigades ({brigades.format('below')})"
        if self.verdict == "lost":
            less = f"fewer {size}, or " if self.n_burning > 1 else ""
            return f"try {less}more brigades ({brigades.format('above')})"
        return ""

    def to_dict(self) -> dict[str, Any]:
        """Return the check as plain values."""
        return {
            "scenario": self.name,
            "digest": self.scenario.digest,
            "n_buildings": self.n_buildings,
            "n_burning": self.n_burning,
            "n_brigades": self.scenario.brigades.n,
            "n_civilians": self.scenario.civilians.count,
            "n_steps_max": self.scenario.steps,
            "score_share": self.score_share,
            "verdict": self.verdict,
            "brigades_matter": self.brigades_matter,
            "hint": self.hint,
            "policies": [asdict(result) for result in self.results],
        }

    def describe(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield a table of the rules, and the verdict."""
        del limit
        scenario, n = self.scenario, len(self.seeds)
        amounts = {"brigade": scenario.brigades.n, "civilian": scenario.civilians.count, "step": scenario.steps}
        team = ", ".join(counted(amount, word) for word, amount in amounts.items())
        yield self.name
        yield f"{self.n_burning} of {counted(self.n_buildings, 'building')} burn; {team}"
        yield ""
        yield TextTable(
            ["policy", "score", "burnt out", "steps", "ended"],
            [
                [
                    each.policy,
                    f"{each.score_share:.2f}",
                    f"{each.n_burnt_out:.1f}",
                    f"{each.steps:.0f}",
                    f"{each.n_ended} of {n}",
                ]
                for each in self.results
            ],
        )
        yield ""
        yield from wrapped(f"{self.verdict}: the rules score {self.score_share:.2f} on the mean")
        if self.hint:
            yield from wrapped(self.hint)

    def __repr__(self) -> str:
        return "\n".join(map(block_text, self.describe()))


@dataclass(frozen=True, repr=False)
class ScenarioChecks(Shown):
    """Checks of scenarios, each of them once, or with several numbers of burning buildings."""

    checks: tuple[ScenarioCheck, ...]
    """Scenario by scenario, and of each by rising numbers."""
    limits: Limits
    seeds: Sequence[int]

    def to_dict(self) -> dict[str, Any]:
        """Return the checks as plain values."""
        return {
            "format": FORMAT,
            "seeds": list(self.seeds),
            **asdict(self.limits),
            "checks": [check.to_dict() for check in self.checks],
        }

    @property
    def markdown(self) -> str:
        """The scores as a table in Markdown."""
        heads = ["scenario", "burning", "mean", *RULES, NO_WATER, "verdict"]
        rows = [
            [
                f"`{check.name}`",
                str(check.n_burning),
                *(f"{share:.2f}" for share in (check.score_share, *(each.score_share for each in check.results))),
                check.verdict,
            ]
            for check in self.checks
        ]
        head, *body = ["| " + " | ".join(cells) + " |" for cells in (heads, *rows)]
        return "\n".join([head, "|---" * len(heads) + "|", *body])

    def describe(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield a table for each scenario that is checked once; if there are several checks, a table of all."""
        names = Counter(check.name for check in self.checks)
        alone = [check for check in self.checks if names[check.name] == 1]
        for check in alone:
            yield from check.describe(limit=limit)
            yield ""
        if len(self.checks) > 1:
            yield TextTable(_HEADS, [_row(check) for check in self.checks])
            yield ""
        for name in names:
            if names[name] > 1:
                yield from wrapped(_sentence(name, [check for check in self.checks if check.name == name]))
                yield ""
        parts = [SCORES, *([STEPS] if alone else []), *([MEANS] if len(self.checks) > 1 else [])]
        of = "Means over" if len(self.seeds) > 1 else "With"
        yield from wrapped(f"{of} {seeds_text(self.seeds)}. {'; '.join(parts)}. {limits_text(self.limits)}")

    def __repr__(self) -> str:
        return "\n".join(map(block_text, self.describe()))


SCORES: Final = "score: share of the maximum"
STEPS: Final = (
    "steps: until nothing burns any more, or to the last; ended: runs in which nothing burns any more, because it was "
    "put out or has burnt down"
)
MEANS: Final = "mean, lowest, highest: of the scores of the rules"
_HEADS: Final = ("scenario", "burning", "mean", "lowest", "highest", NO_WATER, "verdict")


def _row(check: ScenarioCheck) -> list[str]:
    """Return the cells of a check in the table of all."""
    shares = (check.score_share, check.lowest, check.highest, check.no_water.score_share)
    return [shortened(check.name, NAME_MAX), str(check.n_burning), *(f"{share:.2f}" for share in shares), check.verdict]


def _sentence(name: str, checks: Sequence[ScenarioCheck]) -> str:
    """Return with which numbers of burning buildings a scenario is contested, or what to try if with none."""
    burning = {
        verdict: [check.n_burning for check in checks if check.verdict == verdict] for verdict in get_args(Contest)
    }
    if burning["contested"]:
        return f"{name}: contested with {', '.join(map(str, burning['contested']))} burning buildings"
    if not burning["lost"]:
        return f"{name}: held with {burning['held'][-1]} burning buildings, too; {checks[-1].hint}"
    if not burning["held"]:
        return f"{name}: lost with {burning['lost'][0]} burning buildings already; {checks[0].hint}"
    return (
        f"{name}: held with {burning['held'][-1]} burning buildings, lost with {burning['lost'][0]}; try the numbers "
        "between them, if there are any, or another place"
    )


def limits_text(limits: Limits) -> str:
    """Return when a fire is lost, contested or held."""
    return (
        f"A fire is lost if the rules score less than {limits.lost_below:g} on the mean, held if more than "
        f"{limits.held_above:g}, contested between them."
    )


def shortened(name: str, most: int) -> str:
    """Return a name without its beginning if it is longer than so many letters: how a path ends says more."""
    return name if len(name) <= most else "..." + name[3 - most :]


def counted(n: int, word: str) -> str:
    """Return a number of things in words: 1 brigade, 2 brigades."""
    return f"{n} {word}" if n == 1 else f"{n} {word}s"


def wrapped(text: str) -> list[str]:
    """Return a text as lines of at most 80 characters."""
    return textwrap.wrap(text, WIDTH, break_on_hyphens=False)
