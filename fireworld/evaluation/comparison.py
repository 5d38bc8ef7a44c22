"""Comparison: policies compared with a reference, as verdicts, a table, text, JSON, JUnit, HTML and a figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from xml.etree import ElementTree as Xml

from fireworld.arguments import ArgumentError
from fireworld.cause import with_digest
from fireworld.errors import OutputError, ViewError, expected, one_line
from fireworld.evaluation.inputs import in_a_row, seeds_text
from fireworld.evaluation.paired import N_SEEDS_ENOUGH, Judgement, Pairing, Verdict, judge, over_all
from fireworld.files import check_output, make_folder, write_file
from fireworld.findings import Finding
from fireworld.findings import Verdict as FindingVerdict
from fireworld.html_page import html_mark, html_table, text_cell
from fireworld.junit import report
from fireworld.markdown import files_beside, markdown_page
from fireworld.outcome import METRICS, Metric
from fireworld.shown import text_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMAT: Final = "fireworld-comparison/1"
FORMAT_OF_SEVERAL: Final = "fireworld-comparisons/1"
OVER_ALL: Final = "over all"
_VERDICTS: Final[Mapping[Judgement, FindingVerdict]] = {
    "not worse": "same",
    "worse": "different",
    "cannot tell": "cannot",
}
_WORDS: Final[Mapping[FindingVerdict, str]] = {verdict: judgement for judgement, verdict in _VERDICTS.items()}
_MARKS: Final = {"better": "good", "worse": "bad", "equal": "open", "cannot tell": "open", "the same policy": "open"}
_CAPTION: Final = "means; B - A [95 % interval]; P: a run of B is the better one; CRN: what pairing is worth"


@dataclass(frozen=True)
class ComparedPolicy:
    """A policy, as it was asked for, and how it compares with the reference."""

    name: str
    digest: str
    pairings: tuple[Pairing, ...] = ()
    """All metrics in each scenario, then over all; empty for the reference."""


@dataclass(frozen=True, repr=False)
class Comparison:
    """Policies compared with the first of them, run by run on the same scenarios and seeds."""

    policies: tuple[ComparedPolicy, ...]
    """The reference (A), and one or more others (each of them B)."""
    scenarios: tuple[tuple[str, str], ...]
    """Name and digest of each, or of each suite."""
    seeds: Sequence[int]
    version: str
    """Of the simulator."""
    metric: str
    """What the judgement is about."""
    margin: float
    """Loss that does not matter, in the metric's unit."""
    warnings: tuple[str, ...] = ()
    """How teams are used differently from their training."""
    suites: Mapping[str, int] = field(default_factory=dict)
    """Those of `scenarios` that are suites, and how many scenarios each has."""

    @property
    def n_scenarios(self) -> int:
        """Scenarios that were run, those of suites too."""
        return sum(self.suites.get(name, 1) for name, _ in self.scenarios)

    @property
    def each(self) -> list[Comparison]:
        """The comparison of every other policy alone with the reference."""
        reference, *others = self.policies
        return [self] if len(others) == 1 else [replace(self, policies=(reference, other)) for other in others]

    def of(self, policy: str | None = None) -> Comparison:
        """Return the comparison of one policy with the reference.

        Args:
            policy: its name; None: the only one.

        Raises:
            ArgumentError: there is no such policy, or more than one.
        """
        names = [other.name for other in self.policies[1:]]
        found = [one for one, name in zip(self.each, names, strict=True) if policy is None or name == policy]
        if len(found) != 1:
            raise ArgumentError(expected("policy", "", "one of " + ", ".join(names), policy))
        return found[0]

    @property
    def pairings(self) -> list[Pairing]:
        """All metrics of all scenarios and over all; policy after policy."""
        return [pairing for policy in self.policies[1:] for pairing in policy.pairings]

    @property
    def same_policy(self) -> bool:
        """Whether all policies are one, whatever they are called."""
        return all(pairing.same_policy for pairing in self.pairings)

    def verdict(self, metric: str | None = None, *, policy: str | None = None) -> Verdict:
        """Return what B is over all scenarios.

        Args:
            metric: what is compared; None: the metric of the comparison.
            policy: which one is B; None: the only one.

        Raises:
            ArgumentError: there is no such metric or policy.
        """
        return over_all(self.of(policy).pairings, find_metric(metric or self.metric).name).verdict

    @property
    def judgement(self) -> Judgement:
        """Whether B is not worse than A; of several policies, the least good judgement."""
        found = {judge(over_all(one.pairings, self.metric), margin=self.margin) for one in self.each}
        return next(judgement for judgement in ("worse", "cannot tell", "not worse") if judgement in found)

    @property
    def gate(self) -> str:
        """The judgement as a line of text for each policy."""
        return "\n".join(_gate(one) for one in self.each)

    @property
    def sentence(self) -> str:
        """What was found, as a line of text for each policy: one verdict a metric, over all scenarios."""
        return "\n".join(_sentence(one) for one in self.each)

    @property
    def notes(self) -> list[str]:
        """What a reader has to know besides."""
        return list(dict.fromkeys(note for one in self.each for note in _notes(one)))

    @property
    def table(self) -> list[dict[str, Any]]:
        """One row for each policy, scenario (None: over all) and metric, as plain values."""
        return [{"policy": policy.name, **pairing.to_dict()} for policy in self.policies for pairing in policy.pairings]

    def to_pandas(self) -> Any:
        """Return the table as a pandas DataFrame; columns are named as in "difference.low".

        Raises:
            OutputError: pandas is not installed.
        """
        try:
            pandas = import_module("pandas")
        except ImportError:
            raise OutputError("pandas is not installed; try pip install 'fireworld[frames]'") from None
        return pandas.json_normalize(self.table)

    def to_dict(self, *, gate: bool = True) -> dict[str, Any]:
        """Return the comparison as plain values (docs/comparing-policies.md).

        Args:
            gate: with the judgement.
        """
        if len(self.policies) > 2:
            return {"format": FORMAT_OF_SEVERAL, "comparisons": [one.to_dict(gate=gate) for one in self.each]}
        a, b = ({"name": policy.name, "digest": policy.digest} for policy in self.policies)
        judged = {"metric": self.metric, "margin": self.margin, "judgement": self.judgement}
        return {
            "format": FORMAT,
            "version": self.version,
            "a": a,
            "b": b,
            "same_policy": self.same_policy,
            "scenarios": [
                {"name": name, "digest": digest, **({"n_scenarios": self.suites[name]} if name in self.suites else {})}
                for name, digest in self.scenarios
            ],
            "first_seed": self.seeds[0],
            "n_seeds": len(self.seeds),
            **({} if in_a_row(self.seeds) else {"seeds": list(self.seeds)}),
            "comparisons": [pairing.to_dict() for pairing in self.pairings],
            "gate": judged if gate else None,
            "sentence": self.sentence,
            "notes": self.notes,
        }

    def findings(self, pictures: Mapping[str, str] | None = None) -> list[Finding]:
        """Return the comparison with each policy for the pages of a CI server, with pictures by policy."""
        return [_finding(one, (pictures or {}).get(one.policies[1].name, "")) for one in self.each]

    def summary(self, pictures: Mapping[str, str] | None = None, *, beside: Path | None = None) -> str:
        """Return the comparison as Markdown: what was compared, the judgement, the table.

        Args:
            pictures: files, by policy.
            beside: the folder of the Markdown file, from which pictures are named.
        """
        return markdown_page("compare", self.findings(pictures), beside=beside, words=_WORDS)

    def save_summary(self, path: Path | str, *, force: bool = False) -> None:
        """Write the Markdown to a file, and with matplotlib the figures to a folder FILE-files beside it.

        Raises:
            OutputError: the file exists, or cannot be written.
        """
        page = Path(path)
        check_output(page, force=force)
        from fireworld_viewer.pictures.figure_files import save_figure

        folder, pictures = files_beside(page), {}
        for number, one in enumerate(self.each, start=1):
            picture = folder / f"difference-{number}.png"
            try:
                figure = one.figure()
            except ViewError:  # no matplotlib
                break
            make_folder(folder)
            save_figure(figure, picture, force=force)
            pictures[one.policies[1].name] = str(picture)
        write_file(page, self.summary(pictures, beside=page.parent))

    def junit(self) -> bytes:
        """Return JUnit XML: one case a metric, scenario and policy; only those of the gate, over all, can fail."""
        reference, *others = (policy.name for policy in self.policies)
        cases = [_case(one, pairing, several=len(others) > 1) for one in self.each for pairing in one.pairings]
        return report("fireworld compare", one_line(f"{', '.join(others)} against {reference}"), cases)

    def figure(self, policy: str | None = None) -> Figure:
        """Draw every paired difference, metric by metric.

        Args:
            policy: which one is B; None: the only one.

        Raises:
            ArgumentError: there is no such policy.
            ViewError: matplotlib is not installed.
        """
        from fireworld_viewer.pictures.differences import DifferencePanel, draw_paired_differences

        one = self.of(policy)
        a, b = (compared.name for compared in one.policies)
        panels = [
            DifferencePanel(
                label=metric.label,
                unit=metric.unit,
                higher_is_better=metric.higher_is_better,
                lines={
                    pairing.scenario or OVER_ALL: (pairing.differences, [*pairing.difference.ends().values()])
                    for pairing in _shown(one)
                    if pairing.metric == metric
                },
            )
            for metric in METRICS
        ]
        return draw_paired_differences(panels, title=f"{b} (B) against {a} (A), {len(self.seeds)} seeds")

    def save_figure(self, path: Path | str, *, policy: str | None = None, force: bool = False) -> None:
        """Write the figure to a file.

        Args:
            path: ending in .png, .svg or .pdf.
            policy: as for `figure`.
            force: replace an existing file.

        Raises:
            ArgumentError, ViewError, OutputError: as for `figure`; or the file cannot be written.
        """
        from fireworld_viewer.pictures.figure_files import save_figure

        save_figure(self.figure(policy), Path(path), force=force)

    def __repr__(self) -> str:
        def text(one: Comparison) -> str:
            table = text_table(_HEADS, _text_rows(one), "<>>>>><")
            return "\n".join([_title(one), table, _CAPTION, *one.notes])

        return "\n\n".join(map(text, self.each))

    def _repr_html_(self) -> str:
        """Show the comparison in a notebook."""
        return "".join(
            f"<p><b>{escape(_title(one))}</b></p>{html_table(_HEADS, _html_rows(one))}"
            f"<p>{'<br>'.join(map(escape, [_CAPTION, *one.notes]))}</p>"
            for one in self.each
        )


_HEADS: Final = ("", "A", "B", "B - A", "P", "CRN", "B is")


def _finding(one: Comparison, picture: str) -> Finding:
    a, b = one.policies
    judged, pairing = one.judgement, over_all(one.pairings, one.metric)
    names = [with_digest(policy.name, policy.digest) for policy in (b, a)]
    cause = f"policy: {names[0]}, against {names[1]}" if not one.same_policy else f"{names[0]}: the same policy"
    scenarios = ", ".join(with_digest(name, digest) for name, digest in one.scenarios)
    return Finding(
        name=f"{b.name} against {a.name}",
        verdict=_VERDICTS[judged],
        headline=f"{judged}: {pairing.sentence}",
        cause=[cause, f"scenarios: {scenarios}", f"{seeds_text(one.seeds)}; fireworld {one.version}"],
        first=_gate(one).removeprefix("gate: "),
        heads=_HEADS,
        rows=[row if len(row) == len(_HEADS) else [row[0], *[""] * (len(_HEADS) - 1)] for row in _text_rows(one)],
        picture=picture,
    )


def find_metric(name: object) -> Metric:
    """Return a metric by its name; ArgumentError if there is none."""
    for metric in METRICS:
        if metric.name == name:
            return metric
    raise ArgumentError(expected("metric", "", "one of " + ", ".join(metric.name for metric in METRICS), name))


def _shown(one: Comparison) -> list[Pairing]:
    """Return what people are shown: of a single scenario, nothing over all."""
    return [pairing for pairing in one.pairings if pairing.scenario is not None or len(one.scenarios) > 1]


def _text_rows(one: Comparison) -> list[list[str]]:
    rows = []
    for pairing in _shown(one):
        if pairing.metric is METRICS[0]:
            rows.append([pairing.scenario or OVER_ALL])
        label, *cells = pairing.cells
        rows.append([f" {label}", *cells])
    return rows


def _html_rows(one: Comparison) -> list[list[str]]:
    rows = []
    for pairing in _shown(one):
        label, *cells, verdict = pairing.cells
        heading = f"{escape(pairing.scenario or OVER_ALL)}: {label}"
        rows.append([text_cell(heading), *cells, html_mark(verdict, _MARKS[verdict])])
    return rows


def _title(one: Comparison) -> str:
    a, b = (policy.name for policy in one.policies)
    return f"A: {a}, B: {b}, {seeds_text(one.seeds)}"


def _sentence(one: Comparison) -> str:
    a, b = (policy.name for policy in one.policies)
    names = ", ".join(name for name, _ in one.scenarios)
    where = f"{names}; {seeds_text(one.seeds)}; fireworld {one.version}"
    if one.same_policy:
        return f"{b} against {a}: the same policy ({where})"
    verdicts = (over_all(one.pairings, metric.name).sentence for metric in METRICS)
    return f"{b} against {a}: {'; '.join(verdicts)} ({where})"


def _notes(one: Comparison) -> list[str]:
    notes = []
    time = over_all(one.pairings, "time")
    n_runs = len(one.seeds) * one.n_scenarios
    if time.a.n_truncated or time.b.n_truncated:
        notes.append(
            f"the fire was not out at the last step in {time.a.n_truncated} of {n_runs} runs of A and "
            f"{time.b.n_truncated} of B; their time to complete is counted as the last step"
        )
    if len(one.seeds) < N_SEEDS_ENOUGH and not one.same_policy:
        notes.append(f"intervals of fewer than {N_SEEDS_ENOUGH} seeds are too narrow; verdicts need more")
    return notes


def _gate(one: Comparison) -> str:
    pairing = over_all(one.pairings, one.metric)
    metric = pairing.metric
    margin = f", margin {one.margin:g} {metric.unit}" if one.margin else ""
    advice = f", {pairing.advice(margin=one.margin)}" if one.judgement == "cannot tell" else ""
    return f"gate: {metric.label}{margin}: {one.judgement}{advice}"


def _case(one: Comparison, pairing: Pairing, *, several: bool) -> Xml.Element:
    place = one_line(pairing.scenario or OVER_ALL) + (f".{one_line(one.policies[1].name)}" if several else "")
    case = Xml.Element("testcase", classname=f"fireworld.compare.{place}", name=pairing.metric.label, time="0")
    text = pairing.sentence
    if pairing.scenario is None and pairing.metric.name == one.metric:
        kind = {"worse": "failure", "cannot tell": "error"}.get(one.judgement)
        if kind is not None:
            Xml.SubElement(case, kind, message=f"{one.judgement}: {text}", type=one.judgement)
        text = f"{text}; {_gate(one)}"
    Xml.SubElement(case, "system-out").text = text
    return case
