"""Golden recordings, added and recorded anew."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import msgspec

from fireworld.errors import FireworldError, LogError, OutputError, expected
from fireworld.files import make_folder, read_text_file, write_file
from fireworld.interrupt import gentle_interrupt
from fireworld.recording.golden.again import run_again
from fireworld.recording.golden.check import GoldenResult, check_goldens, compare_golden
from fireworld.recording.golden.find import FOLDER, spec_in
from fireworld.recording.golden.spec import make_spec, prepare_golden, spec_of
from fireworld.recording.golden.store import (
    SUFFIX,
    digest_path,
    is_digest,
    recording_path,
    store_golden,
    store_text,
    text_path,
)
from fireworld.recording.golden.training import make_training_spec, prepare_training, training_spec_of
from fireworld.recording.run import Run
from fireworld.training.log.verify import TrainedAgain

REASONS: Final = "REASONS.md"
REASONS_TITLE: Final = "# Why golden recordings changed\n\nWritten by `fireworld golden update`; the newest last.\n"


@dataclass(frozen=True)
class GoldenUpdate:
    """What was done to a golden."""

    name: str
    done: Literal["nothing", "text", "recording"]
    """What was written anew; the text goes with the recording."""
    sentence: str
    """The first difference; empty if there was none."""


def add_golden(
    scenario: str | Path,
    *,
    policy: str,
    seed: int = 1,
    steps: int | None = None,
    settings: Mapping[str, Any] | None = None,
    name: str | None = None,
    folder: Path = FOLDER,
    digest_only: bool = False,
) -> Path:
    """Run a scenario and store the recording and its text as a golden.

    Args:
        scenario: a shipped name, or a YAML file.
        policy: a name as for `fireworld run --policy`.
        seed: of the random draws.
        steps: last step; None: the scenario's.
        settings: keys of the scenario with other values; text is read as YAML.
        name: of the golden; None: made of scenario, policy and seed.
        folder: where it goes.
        digest_only: keep what it was made of, its outcome and a code for every step, instead of the recording.

    Returns:
        The path of the recording, or of the digest.

    Raises:
        OutputError: there is such a golden already, the name is not possible, or it cannot be written.
        ScenarioError, CityError, PolicyError, TrainingError: it cannot be run.
    """
    path = _free_path(folder, name if name is not None else _default_name(scenario, policy, seed))
    spec = make_spec(folder, scenario=scenario, policy=policy, seed=seed, steps=steps, settings=settings)
    fresh = run_again(prepare_golden(spec, folder))
    make_folder(folder)
    path = digest_path(path) if digest_only else path
    with gentle_interrupt():
        store_golden(path, fresh, free=True)
    return path


def add_training(
    curriculum: str | Path,
    *,
    method: str = "paper",
    seed: int = 1,
    stages: str | Sequence[str] | None = None,
    settings: Mapping[str, Any] | None = None,
    name: str | None = None,
    folder: Path = FOLDER,
) -> Path:
    """Train a team, and store the training log and its text as a golden.

    Args:
        curriculum: the name of a shipped curriculum or scenario, or a YAML file of either.
        method: a name as for `fireworld train --method`.
        seed: of all random draws.
        stages: the curriculum's stages to train in, by name: a list, or text as in "alone,together". None: all.
        settings: hyperparameters of the method by name.
        name: of the golden; None: made of curriculum, method and seed.
        folder: where it goes.

    Returns:
        The path of the training log.

    Raises:
        OutputError: there is such a golden already, the name is not possible, or it cannot be written.
        TrainingError, ScenarioError, CityError: it cannot be trained.
    """
    path = _free_path(folder, name if name is not None else _default_name(curriculum, f"{method}-training", seed))
    spec = make_training_spec(folder, curriculum=curriculum, method=method, seed=seed, stages=stages, settings=settings)
    again = prepare_training(spec, folder)
    make_folder(folder)
    store_golden(path, again, free=True)
    return path


def update_goldens(
    folder: Path = FOLDER,
    names: Collection[str] = (),
    *,
    reason: str,
    on_result: Callable[[GoldenResult], object] = lambda _: None,
) -> list[GoldenUpdate]:
    """Record anew those goldens that changed, and write the reason into the folder's REASONS.md.

    Nothing is written unless all of them can be run. Goldens that are the same stay as they are.

    Args:
        folder: of the goldens.
        names: of those to look at; all if there are none.
        reason: why they changed, in a sentence.
        on_result: called after each run.

    Raises:
        OutputError: no reason, no such goldens, or they cannot be written.
        LogError: one cannot be run or compared.
    """
    reason = " ".join(reason.split())
    if not reason:
        raise OutputError(expected("reason", "", "a sentence on why the goldens changed", "nothing"))
    results = []
    for result in check_goldens(folder, names):
        results.append(result)
        on_result(result)
    failed = [f"{result.name}: {result.error}" for result in results if result.difference is None]
    if failed:
        others = f"; {len(failed) - 1} more cannot be run" if len(failed) > 1 else ""
        raise LogError(f"{failed[0]}{others}; nothing is updated")
    changed = [result for result in results if result.differs]
    with gentle_interrupt():  # what begins here takes a moment, and belongs together
        if changed:
            write_file(folder / REASONS, _reasons(folder / REASONS, reason, changed))
        return [_update(result) for result in results]


def store_if_changed(path: Path, fresh: Run | TrainedAgain) -> bool:
    """Store a golden, unless it is there already, was made by the same spec and is the same.

    A digest takes the place of a recording, and the other way round.

    Returns:
        Whether the recording was stored; its text is written in any case if it is outdated.

    Raises:
        OutputError: it cannot be written.
    """
    wanted = training_spec_of(fresh.header) if isinstance(fresh, TrainedAgain) else spec_of(fresh.header)
    try:
        same = (
            msgspec.structs.replace(spec_in(path), test=wanted.test) == wanted
            and not compare_golden(path, fresh).differs
        )
    except FireworldError:
        same = False
    if same:
        store_text(path)
        return False
    make_folder(path.parent)
    store_golden(path, fresh)
    for old in (recording_path(path), text_path(path)) if is_digest(path) else (digest_path(path),):
        old.unlink(missing_ok=True)
    return True


def _update(result: GoldenResult) -> GoldenUpdate:
    if result.differs and result.fresh is not None:
        store_golden(result.path, result.fresh)
        return GoldenUpdate(result.name, "recording", result.sentence)
    return GoldenUpdate(result.name, "text" if store_text(result.path) else "nothing", "")


def _free_path(folder: Path, name: str) -> Path:
    """Return where a golden of that name goes; OutputError if it cannot have that name, or there is one."""
    if not re.fullmatch(r"[\w.+=-]+", name) or name.startswith((".", "-")):
        raise OutputError(expected("name", "", "letters, digits and any of _ . + = -", name))
    path = folder / f"{name}{SUFFIX}"
    if path.exists() or digest_path(path).exists():
        path = path if path.exists() else digest_path(path)
        hint = "`fireworld golden update` records it anew; or try another name"
        raise OutputError(expected(str(path), "", "a name that is free", "an existing golden", hint))
    return path


def _default_name(scenario: str | Path, policy: str, seed: int) -> str:
    """Name a golden after what it runs; after its seed too, if that is not 1."""
    parts = [Path(scenario).stem, policy.removesuffix(".npz"), *([f"seed-{seed}"] if seed != 1 else [])]
    return "-".join(re.sub(r"[^\w.+=]+", "-", part).strip("-.") for part in parts)


def _reasons(path: Path, reason: str, changed: Sequence[GoldenResult]) -> str:
    """Return the list of reasons with one more entry: the reason, and where each golden first differs.

    Where the last entry has this reason it is the same update, which was killed: what it lacks is added to it.
    """
    before = read_text_file(path, strict=True) if path.is_file() else REASONS_TITLE
    head, lines = f"\n* {reason}\n", [f"  * {result.name}: {result.sentence}\n" for result in changed]
    last = before.rpartition("\n* ")[2]
    if not f"\n* {last}".startswith(head):
        return before + head + "".join(lines)
    return before + "".join(line for line in lines if line not in last.splitlines(keepends=True))
