"""A comparison of two policies as a table, as a sentence, as JSON and as JUnit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final
from xml.etree import ElementTree as Xml

from fireworld.errors import one_line
from fireworld.evaluation.paired import METRICS, N_SEEDS_ENOUGH, Judgement, Metric, Pairing, Side, over_all
from fireworld.evaluation.statistics import Estimate
from fireworld.junit import report
from fireworld.reproduction.findings import spread

if TYPE_CHECKING:
    from rich.table import Table

FORMAT: Final = "fireworld-comparison/1"
OVER_ALL: Final = "over all"


@dataclass(frozen=True)
class Gate:
    """What is asked of B, and whether it is met."""

    metric: str
    margin: float
    judgement: Judgement


@dataclass(frozen=True)
class Comparison:
    """Two policies compared, and how they were called."""

    policies: tuple[str, str]
    digests: tuple[str, str]
    scenarios: Sequence[tuple[str, str]]
    """Name and digest of each."""
    seeds: Sequence[int]
    version: str
    same_policy: bool
    pairings: Sequence[Pairing]
    gate: Gate


def table(found: Comparison) -> Table:
    """Return the comparison as a table for people."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    a, b = found.policies
    made = Table(
        title=Text(f"A: {a}, B: {b}, {_seeds(found.seeds)}"),
        caption="mean (interquartile mean); B - A [95 % interval]; P: a run of B is the better one",
        box=SIMPLE_HEAD,
        show_edge=False,
        padding=(0, 1, 0, 0),
    )
    for heading in ("", "A", "B", "B - A", "P", "B is"):
        made.add_column(heading, justify="left" if heading in {"", "B is"} else "right", no_wrap=True)
    for pairing in scopes(found):
        metric = pairing.metric
        if metric is METRICS[0]:
            made.add_section()
            made.add_row(Text(pairing.scenario or OVER_ALL, style="bold"))
        made.add_row(
            f" {metric.label}",
            _side(metric, pairing.a),
            _side(metric, pairing.b),
            Text(spread(pairing.difference, digits=metric.digits, sign=True)),
            f"{pairing.improvement.mean:.2f}",
            pairing.verdict,
        )
    return made


def scopes(found: Comparison) -> list[Pairing]:
    """Return what people are shown: of a single scenario, nothing over all."""
    alone = len(found.scenarios) == 1
    return [pairing for pairing in found.pairings if pairing.scenario is not None or not alone]


def sentence(found: Comparison) -> str:
    """Say in one line what was found: one verdict a metric, over all."""
    a, b = found.policies
    names = ", ".join(name for name, _ in found.scenarios)
    where = f"{names}; {_seeds(found.seeds)}; fireworld {found.version}"
    if found.same_policy:
        return f"{b} against {a}: the same policy ({where})"
    verdicts = (_verdict(over_all(found.pairings, metric.name)) for metric in METRICS)
    return f"{b} against {a}: {'; '.join(verdicts)} ({where})"


def notes(found: Comparison) -> list[str]:
    """Return what a reader has to know besides."""
    said = []
    time = over_all(found.pairings, "time")
    n_runs = len(found.seeds) * len(found.scenarios)
    if time.a.n_truncated or time.b.n_truncated:
        said.append(
            f"the fire was not out at the last step in {time.a.n_truncated} of {n_runs} runs of A and "
            f"{time.b.n_truncated} of B; their time to complete is counted as the last step"
        )
    if len(found.seeds) < N_SEEDS_ENOUGH and not found.same_policy:
        said.append(f"intervals of fewer than {N_SEEDS_ENOUGH} seeds are too narrow; verdicts need more")
    return said


def gate_line(found: Comparison) -> str:
    """Say what the gate found."""
    gate = found.gate
    pairing = over_all(found.pairings, gate.metric)
    metric = pairing.metric
    margin = f", margin {gate.margin:g} {metric.unit}" if gate.margin else ""
    advice = f", {pairing.advice(margin=gate.margin)}" if gate.judgement == "cannot tell" else ""
    return f"gate: {metric.label}{margin}: {gate.judgement}{advice}"


def as_json(found: Comparison, *, gated: bool) -> dict[str, Any]:
    """Return the comparison as plain values (docs/comparing-policies.md)."""
    policies = [{"name": name, "digest": digest} for name, digest in zip(found.policies, found.digests, strict=True)]
    gate = found.gate
    return {
        "format": FORMAT,
        "version": found.version,
        "a": policies[0],
        "b": policies[1],
        "same_policy": found.same_policy,
        "scenarios": [{"name": name, "digest": digest} for name, digest in found.scenarios],
        "first_seed": found.seeds[0],
        "n_seeds": len(found.seeds),
        "comparisons": [_plain(pairing) for pairing in found.pairings],
        "gate": {"metric": gate.metric, "margin": gate.margin, "judgement": gate.judgement} if gated else None,
        "sentence": sentence(found),
        "notes": notes(found),
    }


def junit(found: Comparison) -> bytes:
    """Return the comparison as JUnit XML: one case a metric and scenario; only the gate's, over all, can fail."""
    cases = [_case(found, pairing) for pairing in found.pairings]
    return report("fireworld compare", one_line(f"{found.policies[1]} against {found.policies[0]}"), cases)


def _case(found: Comparison, pairing: Pairing) -> Xml.Element:
    place = one_line(pairing.scenario or OVER_ALL)
    case = Xml.Element("testcase", classname=f"fireworld.compare.{place}", name=pairing.metric.label, time="0")
    text = _verdict(pairing)
    if pairing.scenario is None and pairing.metric.name == found.gate.metric:
        kind = {"worse": "failure", "cannot tell": "error"}.get(found.gate.judgement)
        if kind is not None:
            Xml.SubElement(case, kind, message=f"{found.gate.judgement}: {text}", type=found.gate.judgement)
        text = f"{text}; {gate_line(found)}"
    Xml.SubElement(case, "system-out").text = text
    return case


def _verdict(pairing: Pairing) -> str:
    metric = pairing.metric
    reason = f", {pairing.reason}" if pairing.reason else ""
    difference = spread(pairing.difference, digits=metric.digits, sign=True)
    return (
        f"{metric.label} {pairing.verdict}{reason}: {difference} {metric.unit}, "
        f"P(better) {pairing.improvement.mean:.2f}"
    )


def _plain(pairing: Pairing) -> dict[str, Any]:
    sides = {
        name: {"mean": side.mean, "interquartile_mean": side.interquartile_mean, "n_truncated": side.n_truncated}
        for name, side in (("a", pairing.a), ("b", pairing.b))
    }
    return {
        "scenario": pairing.scenario,
        "metric": pairing.metric.name,
        "unit": pairing.metric.unit,
        "higher_is_better": pairing.metric.higher_is_better,
        **sides,
        "difference": _estimate(pairing.difference),
        "improvement": _estimate(pairing.improvement),
        "n_differing": pairing.n_differing,
        "verdict": pairing.verdict,
        "more_seeds": pairing.more_seeds,
        "reason": pairing.reason,
    }


def _estimate(found: Estimate) -> dict[str, float]:
    return {"mean": found.mean, "low": found.low, "high": found.high}


def _side(metric: Metric, side: Side) -> str:
    return f"{side.mean:.{metric.digits}f} ({side.interquartile_mean:.{metric.digits}f})"


def _seeds(seeds: Sequence[int]) -> str:
    return f"seed {seeds[0]}" if len(seeds) == 1 else f"seeds {seeds[0]} to {seeds[-1]}"
