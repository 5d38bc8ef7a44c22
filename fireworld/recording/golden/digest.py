"""Digest-only goldens: what a run was made of, how it came out and a code for every step, without its recording."""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import json
from collections import Counter
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Literal

import msgspec
import numpy as np
from fireworld_recorder.chain import step_messages
from fireworld_recorder.codec import encode
from fireworld_recorder.diff import FirstDifference, RunComparison
from fireworld_recorder.header import header_differences
from fireworld_recorder.match import Rules
from fireworld_recorder.step_difference import describe, find_differences
from fireworld_recorder.totals import Totals, totals_of

from fireworld.cause import DIGEST_SHOWN
from fireworld.errors import LogError, expected
from fireworld.files import read_text_file, write_file
from fireworld.recording.golden.spec import SPEC_ATTACHMENT, GoldenSpec, encode_spec, spec_of
from fireworld.recording.golden.text import LETTERS, NONE, action_letter, run_facts
from fireworld.records import PHASES, STEP_TOPICS, CityRecord, Decisions, RunHeader, StepRecord, StoredRun
from fireworld.simulation.placement import SCENARIO_ATTACHMENT

DIGEST_SUFFIX: Final = ".digest"
FORMAT: Final = "fireworld-golden-digest/1"
CODE_LETTERS: Final = 2
"""Of the code of a topic in a step: 12 bits, to find where runs begin to differ; the digest says whether they do."""
_TOPICS: Final = [topic.topic for topic in STEP_TOPICS]
_LETTERS: Final = (*LETTERS,)


class DigestGolden(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, dict=True):
    """What is kept of a run, in the order of the file."""

    format: Literal["fireworld-golden-digest/1"] = FORMAT
    facts: list[str]
    """What was run and how it ended, to be read in reviews."""
    digest: str
    run: dict[str, str | int]
    """The header of the run, without its attachments."""
    spec: GoldenSpec
    scenario: list[str]
    """The scenario as it was resolved, line by line."""
    city: str
    """The beginning of the digest of the city."""
    totals: Totals
    steps: list[str]
    """For each step, from 0, a code of two letters for each topic; then what each brigade chose, a letter each."""

    @cached_property
    def header(self) -> RunHeader:
        """The header of the run; its attachments are the spec and the scenario (LogError)."""
        attachments = {
            SCENARIO_ATTACHMENT: ("\n".join(self.scenario) + "\n").encode(),
            SPEC_ATTACHMENT: encode_spec(self.spec),
        }
        try:
            return dataclasses.replace(msgspec.convert(self.run, RunHeader), attachments=attachments)
        except msgspec.ValidationError as error:
            raise LogError(f"run: {error}") from None


def digest_of(run: StoredRun) -> DigestGolden:
    """Return what a digest-only golden keeps of a run.

    Raises:
        LogError: it is to be compared by tolerances, for which values would be needed.
    """
    spec = spec_of(run.header)
    if spec.tolerances or spec.ignore:
        hint = "keep its recording, or compare it exactly"
        raise LogError(expected("digest-only golden", "", "no tolerances and nothing to ignore", "some", hint))
    header = {item.name: getattr(run.header, item.name) for item in dataclasses.fields(RunHeader)}
    return DigestGolden(
        facts=run_facts(run),
        digest=run.digest,
        run={name: value for name, value in header.items() if name != "attachments" and value != ""},
        spec=spec,
        scenario=run.header.attachments[SCENARIO_ATTACHMENT].decode().splitlines(),
        city=_city_code(run.city),
        totals=totals_of(run),
        steps=[_line_of(record) for record in run],
    )


def write_digest(path: Path, run: StoredRun) -> None:
    """Write a digest-only golden; it is written beside and renamed (OutputError)."""
    write_file(path, json.dumps(msgspec.to_builtins(digest_of(run)), indent=1, ensure_ascii=False) + "\n")


def read_digest(path: Path) -> DigestGolden:
    """Read a digest-only golden; LogError if it is none, or is damaged."""
    try:
        golden = msgspec.json.decode(read_text_file(path, strict=True), type=DigestGolden)
    except msgspec.DecodeError as error:
        raise LogError(f"{path}: {error}; it is no digest-only golden, or was changed by hand") from None
    _ = golden.header
    return golden


def compare_digest(golden: DigestGolden, fresh: StoredRun) -> RunComparison:
    """Compare a new run with what is kept of an old one: step by step and topic by topic, by their codes."""
    header, totals = header_differences(golden.header, fresh.header), (golden.totals, totals_of(fresh))
    if golden.digest == fresh.digest:
        return RunComparison(None, totals, header, len(fresh), {})
    if golden.city != _city_code(fresh.city):
        what = "it is another one, or begins otherwise"
        first = _in_words(None, CityRecord.topic, what, golden.city, _city_code(fresh.city))
        return RunComparison(first, totals, header, 0, {})
    n_differing: Counter[str] = Counter()
    by_topic: dict[str, FirstDifference] = {}
    for kept, record in zip(golden.steps, fresh, strict=False):
        for topic in _topics_that_differ(kept, _line_of(record)):
            n_differing[topic] += 1
            if topic not in by_topic:
                by_topic[topic] = _difference(topic, kept, record, fresh.city)
    first = next(iter(by_topic.values()), None) or _without_a_step(len(golden.steps), len(fresh))
    n_compared = min(len(golden.steps), len(fresh))
    return RunComparison(first, totals, header, n_compared, dict(n_differing), by_topic)


def _line_of(record: StepRecord) -> str:
    """Return the codes of the topics of a step, and the letters of what was chosen."""
    codes = (hashlib.sha256(data).digest() for _, data in step_messages(record))
    code = "".join(base64.b64encode(one, b"-_")[:CODE_LETTERS].decode() for one in codes)
    letters = "".join(map(action_letter, record.decisions.action.tolist()))
    return f"{code} {letters}".rstrip()


def _city_code(city: CityRecord) -> str:
    return hashlib.sha256(encode(city)).hexdigest()[:DIGEST_SHOWN]


def _topics_that_differ(kept: str, now: str) -> list[str]:
    """Return the topics whose codes differ, in the order in which things happen: brigades choose, others see that."""
    places = range(0, len(_TOPICS) * CODE_LETTERS, CODE_LETTERS)
    topics = [
        topic
        for topic, at in zip(_TOPICS, places, strict=True)
        if kept[at : at + CODE_LETTERS] != now[at : at + CODE_LETTERS]
    ]
    if kept.partition(" ")[2] != now.partition(" ")[2]:
        topics.sort(key=lambda topic: topic != Decisions.topic)
    return topics


def _difference(topic: str, kept: str, record: StepRecord, city: CityRecord) -> FirstDifference:
    """Put what differs in a step into words: which brigade chose what, as far as that is kept."""
    letters = kept.partition(" ")[2]
    if topic == Decisions.topic and len(letters) == len(record.decisions.action):
        chosen = [-1 if one == NONE else _LETTERS.index(one) if one in _LETTERS else len(LETTERS) for one in letters]
        now = np.array([min(action, len(LETTERS)) for action in record.decisions.action.tolist()])
        a, b = (
            dataclasses.replace(record, decisions=dataclasses.replace(record.decisions, action=action))
            for action in (np.array(chosen, now.dtype), now)
        )
        found = find_differences(a, b, Rules({}, ()))
        if found:
            return describe(found[0][0], a, b, city)
    return _in_words(record.step, topic, f"{topic[1:]} are not the same", None, None)


def _without_a_step(n_kept: int, n_now: int) -> FirstDifference:
    """Report what is found in no step: how many there are, or something of which no code is kept."""
    if n_kept != n_now:
        return FirstDifference(
            min(n_kept, n_now), "length", "", "", None, None, n_kept, n_now,
            f"{n_now} steps, was {n_kept}; all that both have are the same",
        )  # fmt: skip
    text = "the digest is another one, and no step is: snapshots or the way it ended differ"
    return FirstDifference(n_now - 1, "end", "", "", None, None, None, None, text)


def _in_words(step: int | None, topic: str, what: str, a: Any, b: Any) -> FirstDifference:
    phase = PHASES[topic]
    place = phase if step is None else f"step {step}, {phase}"
    return FirstDifference(step, phase, topic, "", None, None, a, b, f"{place}: {what}")
