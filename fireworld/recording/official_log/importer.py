"""Import the log of an official kernel: read it once, front to back, and write a recording."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO, Final

from fireworld_recorder.codec import encode
from fireworld_recorder.source import unreadable
from fireworld_recorder.writer import LogWriter

from fireworld.arguments import path_of
from fireworld.errors import LogError, expected
from fireworld.files import check_outputs
from fireworld.outcome import outcome_of
from fireworld.recording.official_log import archive_form, json_form, old_form, protobuf_form
from fireworld.recording.official_log.city import Cast, cast_of, city_of
from fireworld.recording.official_log.imported import Imported
from fireworld.recording.official_log.official_score import official_score
from fireworld.recording.official_log.parts import (
    Configuration,
    CutOffError,
    End,
    Form,
    Initial,
    Part,
    Parts,
)
from fireworld.recording.official_log.seven_zip import MAGIC
from fireworld.recording.official_log.source import Bytes, unpacked
from fireworld.recording.official_log.world import NOT_RECORDED, World, settings_text
from fireworld.records import CityRecord, RunHeader, StepRecord
from fireworld.version import __version__

POLICY: Final = "official-agents"
"""What the agents that were connected to the kernel are called: a log has no name for them."""
ORIGIN: Final = "official log"
SETTINGS_ATTACHMENT: Final = "kernel.cfg"
_SETTINGS: Final = ("resq-fire.", "fire.", "ignition.", "misc.injury.", "score.", "kernel.timesteps", "random.seed")
"""What of the configuration is kept in the recording."""
_WANTED: Final = "expected the log of an official kernel"
_SEED: Final = "random.seed"
_N_STEPS: Final = "kernel.timesteps"


@dataclass
class _Import:
    """An import under way: the start of the run is held until the first step, for the configuration comes after it."""

    output: Path
    force: bool
    on_step: Callable[[StepRecord], object]
    form: Form
    settings: Mapping[str, str] = field(default_factory=dict)
    initial: Initial | None = None
    begun: _Begun | None = None
    ended: bool = False

    def take(self, part: Part, stack: ExitStack) -> None:
        """Take a part of the log; a step is written when the next one begins."""
        if isinstance(part, Initial):
            if self.initial is not None:
                raise LogError(expected("initial conditions", "", "one record of them", "a second one"))
            self.initial = part
        elif isinstance(part, Configuration):
            self.settings = self.settings or part.values
        elif isinstance(part, End):
            self.ended = True
        else:
            begun = self.begin(stack)
            begun.write(self.on_step, truncated=False)
            begun.world.take(part.time, part.changes)

    def begin(self, stack: ExitStack) -> _Begun:
        """Write the header and the city, unless they are written; return what is under way."""
        if self.begun is None:
            if self.initial is None:
                raise LogError(expected("record", "", "initial conditions before the first step", "none of them"))
            entities = self.initial.entities
            cast = cast_of(entities)
            world = World(entities, cast)
            name = _map_name(self.settings)
            city, absent = city_of(entities, cast, self.settings, name=name, civilians=world.civilians())
            header = _header(city, self.settings, absent, form=self.form)
            writer = LogWriter(self.output, header, city, force=self.force, scratch_suffix=".importing")
            self.begun = _Begun(cast, world, city, stack.enter_context(writer))
        return self.begun


@dataclass
class _Begun:
    """A recording under way."""

    cast: Cast
    world: World
    city: CityRecord
    writer: LogWriter
    n_steps: int = 0

    def write(self, on_step: Callable[[StepRecord], object], *, truncated: bool) -> StepRecord:
        """Write the step that the world has come to."""
        record = self.world.record(truncated=truncated)
        self.writer.write(record)
        self.n_steps += 1
        on_step(record)
        return record


def import_log(
    file: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    force: bool = False,
    on_step: Callable[[StepRecord], object] = lambda _: None,
) -> Imported:
    """Make a recording of a log that an official RoboCup Rescue kernel wrote.

    What such a log does not have (fuel, energy, choices, rewards ...) is absent from the recording, and its header says
    so. A log that was cut off is imported up to its last whole step.

    Args:
        file: the log: raw, .xz, .lzma, .gz, .7z or JSON, of any year; its bytes say which it is.
        output: the recording to write.
        force: replace an existing recording.
        on_step: called after each step.

    Raises:
        LogError: the file is no such log, or is damaged; nothing is left of the recording.
        OutputError: the recording exists or cannot be written.
    """
    source, path = path_of("file", file), path_of("output", output)
    check_outputs([path], force=force, inputs=[source])
    work = _Import(path, force, on_step, Form(""))
    damage: str | None = None
    try:
        with ExitStack() as stack, _named(source):
            try:
                for part in _parts(source, work.form, stack):
                    work.take(part, stack)
                damage = None if work.ended else "cut off: it has no end record"
            except CutOffError as error:
                if work.initial is None:
                    raise LogError(f"{error}; no step is good") from None
                damage = f"cut off: {error}"
            begun = work.begin(stack)
            last = begun.write(on_step, truncated=work.ended)
    except OSError as error:
        raise unreadable(source, error) from error
    outcome = replace(outcome_of(last, begun.city), total_reward=math.nan, water_used_litres=math.nan)
    return Imported(
        source=source,
        path=path,
        form=str(work.form),
        n_steps=begun.n_steps,
        last_step=last.step,
        digest=begun.writer.digest,
        damage=damage and f"{damage}; imported up to step {last.step}",
        n_left_out=begun.cast.n_left_out,
        outcome=outcome,
        official=official_score(last, begun.world, begun.cast.buildings, work.settings),
    )


@contextmanager
def _named(source: Path) -> Iterator[None]:
    """Let errors of a log begin with its name."""
    try:
        yield
    except LogError as error:
        text = str(error)
        raise LogError(text if text.startswith(str(source)) else f"{source}: {text}") from None


def _parts(source: Path, form: Form, stack: ExitStack) -> Parts:
    """Yield the parts of a file, whatever its form."""
    if source.is_dir():
        raise LogError(f"{_WANTED}, got a folder")
    file: IO[bytes] = stack.enter_context(source.open("rb"))
    if source.is_file():  # what comes from a pipe is read once
        if file.read(len(MAGIC)) == MAGIC:
            yield from archive_form.read_parts(file, form)
            return
        file.seek(0)
    data, packed = unpacked(file)
    for part in _parts_of(data, form):
        form.text = form.text if not packed or packed in form.text else f"{form.text}, {packed}"
        yield part
    if not data.at_end():
        raise LogError(f"expected the end of the log, got more bytes at byte {data.n_read}")


def _parts_of(data: Bytes, form: Form) -> Parts:
    """Return the parts of unpacked bytes."""
    start = data.peek(64)
    if start.startswith(old_form.MAGIC):
        return old_form.read_parts(data, form)
    if json_form.begins(start):
        return json_form.read_parts(data, form)
    if protobuf_form.begins(start):
        return protobuf_form.read_parts(data, form)
    got = f"a file that begins with {start[:8]!r}" if start else "an empty file"
    raise LogError(f"{_WANTED}, got {got}")


def _header(city: CityRecord, settings: Mapping[str, str], absent: set[str], *, form: Form) -> RunHeader:
    """Return the header of a recording, in which stands what the log does not have."""
    config = settings_text(settings, _SETTINGS)
    seed = settings.get(_SEED, "").strip()
    has_seed = seed.isdecimal() and len(seed) < 19
    not_recorded = {*NOT_RECORDED, *absent, *(() if has_seed else ("seed",))}
    scenario = b"".join(line for line in config.splitlines(keepends=True) if not line.startswith(_SEED.encode()))
    n_steps = settings.get(_N_STEPS, "").strip()
    return RunHeader(
        scenario=city.name,
        scenario_digest=hashlib.sha256(encode(city) + scenario).hexdigest(),
        seed=int(seed) if has_seed else 0,
        policy=POLICY,
        policy_digest="",
        fireworld_version=__version__,
        n_steps_max=int(n_steps) if n_steps.isdecimal() and len(n_steps) < 10 else 0,
        origin=f"{ORIGIN}: {form.text.partition(',')[0]}, {form.numbering}",
        not_recorded=", ".join(sorted(not_recorded)),
        attachments={SETTINGS_ATTACHMENT: config} if config else {},
    )


def _map_name(settings: Mapping[str, str]) -> str:
    """Return the name of the map, from where the kernel found it."""
    parts = settings.get("gis.map.dir", "").replace("\\", "/").split("/")
    named = [part for part in parts if part not in {"", ".", "..", "map"}]
    return named[-1] if named else "official map"
