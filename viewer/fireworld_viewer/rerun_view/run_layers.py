"""A recording in Rerun, every layer of it on the `step` timeline; or two in one city, and in /diff how they differ."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np
import rerun
from numpy.typing import NDArray

from fireworld.errors import ViewError, expected
from fireworld.records import CityRecord, MemoryRecording, Recording, StepRecord
from fireworld_viewer import colors
from fireworld_viewer.city_mesh import CityMesh, build_mesh
from fireworld_viewer.rerun_view import brigades, city_layers
from fireworld_viewer.rerun_view.layers import Layers
from fireworld_viewer.rerun_view.pages import OutcomePage
from fireworld_viewer.rerun_view.plots import log_plot, log_plots
from fireworld_viewer.story.narration import LogLine, decision_lines, event_lines
from fireworld_viewer.story.series import choices_of
from fireworld_viewer.story.steps import check_same_city, common_steps, compare_damage

MARK_PATH: Final = "/diff/plots/first_difference"
AGREEMENT: Final = ("the same", "buildings the same, something else not", "buildings differ")
"""States of the timeline of two runs."""

PART_BYTES: Final = 64 << 20
"""Size of the parts in which a long run of a large city is sent: their numbers are put together in memory."""
_BYTES_OF_BUILDING: Final = 21  # what is recorded of a building in a step

_AGREEMENT_RGB: Final = (colors.HEALTHY_RGB, colors.MARK_RGB, colors.WORSE_RGB)


class RunLayers:
    """Sends one run to a Rerun stream: the city at once, then its steps as they come, one by one or many together.

    Args:
        stream: where to; its log time and log tick are left out of everything sent.
        city: where the run takes place.
        prefix: entity path to put it below, "" or like "/a".
        name: of the run beside another, "" where it is alone.
        focus: ids of buildings whose temperatures are plotted.
        mesh: of the city, if it was made before.
        names_apart_m: brigades nearer to each other share a label.
        after_block: called when a block of wide data has been sent.

    Raises:
        ViewError: a building of the focus is not in the city.
    """

    def __init__(
        self,
        stream: rerun.RecordingStream,
        city: CityRecord,
        *,
        prefix: str = "",
        name: str = "",
        focus: Sequence[int] = (),
        mesh: CityMesh | None = None,
        names_apart_m: float = brigades.NAMES_APART_M,
        after_block: Callable[[], object] | None = None,
    ) -> None:
        self._names_apart_m = names_apart_m
        self._focus_index = _building_indices(city, focus)
        self._layers = Layers(stream, prefix, np.zeros(0, dtype=np.int64), name=name, after_block=after_block)
        self._mesh = build_mesh(city) if mesh is None else mesh
        self._layers.static("", rerun.ViewCoordinates.RIGHT_HAND_Z_UP)
        city_layers.log_city(self._layers, city, self._mesh)

    def add(self, recording: Recording, *, complete: bool = False) -> None:
        """Send the next steps of the run, which are in a recording of this city: one, all, or any number of them.

        complete: these are all.
        """
        for part in _parts(recording):
            self._add(part)
        self._layers.steps = recording.steps
        brigades.log_states(self._layers, recording, complete=complete)

    def _add(self, recording: Recording) -> None:
        layers, mesh = self._layers, self._mesh
        layers.steps = recording.steps
        city_layers.log_buildings(layers, recording, mesh)
        city_layers.log_air(layers, recording, mesh)
        brigades.log_brigades(layers, recording, names_apart_m=self._names_apart_m)
        brigades.log_water(layers, recording, mesh)
        city_layers.log_civilians(layers, recording, mesh)
        city_layers.log_sites(layers, recording)
        log_plots(layers, recording, self._focus_index)
        _log_text(layers, recording)


def _parts(recording: Recording) -> Iterator[MemoryRecording]:
    """Yield a recording in parts of at most PART_BYTES, or a step; one part of a recording without steps."""
    held: list[StepRecord] = []
    n_bytes = 0
    for record in recording:
        arrays = record.snapshot.arrays.values() if record.snapshot is not None else ()
        more = _BYTES_OF_BUILDING * len(record.buildings.fieryness) + sum(array.nbytes for array in arrays)
        if held and n_bytes + more > PART_BYTES:
            yield MemoryRecording(recording.header, recording.city, held)
            held, n_bytes = [], 0
        held.append(record)
        n_bytes += more
    yield MemoryRecording(recording.header, recording.city, held)


def _log_text(layers: Layers, recording: Recording) -> None:
    """Send a line for every event, and one for every choice that is new or explores."""
    layers.text("log/events", event_lines(recording))
    choices = choices_of(recording)
    new = choices.explored.copy()
    for brigade in range(new.shape[1]):
        pairs = np.column_stack([choices.action[:, brigade], choices.target[:, brigade]])
        new[layers.changed(f"log/decisions/{brigade}", pairs), brigade] = True
    new[[len(row) == 0 for row in recording.ragged("/decisions", "action")]] = False  # nobody was asked
    layers.text("log/decisions", decision_lines(recording, choices, new))


def _building_indices(city: CityRecord, ids: Sequence[int]) -> list[int]:
    """Return the indices of buildings, or raise ViewError where the city has no building of such an id."""
    index_of = {int(identifier): index for index, identifier in enumerate(city.building_id)}
    for identifier in ids:
        if identifier not in index_of:
            some = f"the first are {', '.join(map(str, list(index_of)[:3]))}"
            raise ViewError(expected("--focus", "", f"ids of buildings of city {city.name!r}", identifier, some))
    return [index_of[identifier] for identifier in ids]


def log_comparison(
    stream: rerun.RecordingStream,
    first: Recording,
    second: Recording,
    *,
    focus: Sequence[int] = (),
    outcome: OutcomePage | None = None,
    names_apart_m: float = brigades.NAMES_APART_M,
    after_block: Callable[[], object] | None = None,
) -> None:
    """Send two runs, below /a and /b, and their difference; where they first differ is marked if the outcome is given.

    Brigades nearer to each other than `names_apart_m` share a label; `after_block` is called when a block of wide data
    has been sent.
    ViewError if the runs are of different cities, one has no steps, or a building of the focus is unknown.
    """
    check_same_city(first.city, second.city)
    steps, rows_a, rows_b = common_steps(first.steps, second.steps)
    mesh = build_mesh(first.city)
    for recording, name in ((first, "A"), (second, "B")):
        RunLayers(
            stream, recording.city, prefix=f"/{name.lower()}", name=name, focus=focus, mesh=mesh,
            names_apart_m=names_apart_m, after_block=after_block,
        ).add(recording, complete=True)  # fmt: skip

    layers = Layers(stream, "/diff", steps, after_block=after_block)
    city_layers.log_city(layers, first.city, mesh)
    fieryness_a = first.column("/buildings", "fieryness")[rows_a]
    fieryness_b = second.column("/buildings", "fieryness")[rows_b]
    change = compare_damage(fieryness_a, fieryness_b)
    city_layers.log_mesh(layers, mesh, (change + 1).astype(np.uint8), colors.DIFFERENCE_RGB)
    codes = {"difference": change, "fieryness_a": fieryness_a, "fieryness_b": fieryness_b}
    layers.numbers("city/handles", "Difference", codes)

    counts = np.column_stack([np.count_nonzero(change == sign, axis=1) for sign in (1, -1)]).astype(np.float64)
    log_plot(layers, "plots/buildings", counts, ("worse", "better"), (colors.WORSE_RGB, colors.BETTER_RGB))
    if outcome is not None:
        _mark_first_difference(layers, outcome, np.any(change != 0, axis=1))


def _mark_first_difference(layers: Layers, outcome: OutcomePage, buildings_differ: NDArray[np.bool_]) -> None:
    """Send a timeline of whether the runs are the same, a mark in the plots and a line in the log."""
    first = outcome.first_step
    states = np.zeros(len(layers.steps), dtype=np.int64)
    if first is not None:
        states[layers.steps >= first] = 1
        states[buildings_differ] = 2
    layers.states("agreement", states, AGREEMENT, _AGREEMENT_RGB, complete=True)
    if first is None:
        return
    style = rerun.SeriesPoints(
        names=["first"],
        colors=colors.single(colors.MARK_RGB),
        markers="diamond",
        marker_sizes=[6.0],
    )
    layers.static("plots/first_difference", style)
    layers.rows("plots/first_difference", rerun.Scalars.columns(scalars=[0.0]), steps=[first])
    line = LogLine(first, "ERROR", f"first difference: {outcome.first_sentence}", colors.MARK_RGB)
    layers.text("log/first_difference", [line])
