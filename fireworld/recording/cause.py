"""Why two runs can differ: another scenario, policy, seed or simulator."""

from __future__ import annotations

from fireworld.cause import DIGEST_SHOWN, SIMULATOR, Cause, cause_of, scenario_changes, simulator_changes, with_digest
from fireworld.errors import FireworldError
from fireworld.records import RunHeader


def run_cause(a: RunHeader, b: RunHeader) -> Cause:
    """Compare what run B was made of with what run A was made of."""
    simulators = (a.fireworld_version, a.simulator_digest), (b.fireworld_version, b.simulator_digest)
    seldom = {"steps": (a.n_steps_max, b.n_steps_max), "origin": (_origin(a), _origin(b))}
    return cause_of(
        {
            "scenario": _scenario_changes(a, b),
            "policy": _policy_changes(a, b),
            "seed": None if a.lacks("seed") or b.lacks("seed") else _change(a.seed, b.seed),
            **{name: _change(*pair) for name, pair in seldom.items() if pair[0] != pair[1]},
            SIMULATOR: simulator_changes(*simulators, known=not (a.imported or b.imported)),
        }
    )


def scenario_text(header: RunHeader) -> str:
    """Name a run's scenario, so that those of one name are not taken for the same."""
    return with_digest(header.scenario, header.scenario_digest)


def _scenario_changes(a: RunHeader, b: RunHeader) -> list[str]:
    """Compare scenarios key by key, as they were resolved; and the files of their cities."""
    if a.scenario_digest == b.scenario_digest:
        return []
    from fireworld.recording.replay import recorded_scenario

    try:
        changes = scenario_changes(recorded_scenario(a), recorded_scenario(b))
    except FireworldError:  # of an imported log, or with keys that only another version knows
        changes = []
    return changes or _change(scenario_text(a), scenario_text(b))


def _policy_changes(a: RunHeader, b: RunHeader) -> list[str] | None:
    if a.lacks("decisions") or b.lacks("decisions"):
        return None
    if a.policy != b.policy or not (a.policy_digest and b.policy_digest):
        return _change(a.policy, b.policy) or None
    return [f"{a.policy}, digest {line}" for line in _change(*(one.policy_digest[:DIGEST_SHOWN] for one in (a, b)))]


def _origin(header: RunHeader) -> str:
    return header.origin or (f"a fork of {header.forked_from}" if header.forked_from else "a run of its own")


def _change(a: object, b: object) -> list[str]:
    return [f"{b}, was {a}"] if a != b else []
