"""A recording in Rerun: every layer of a run on the `step` timeline."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun

from fireworld.errors import ViewError, expected
from fireworld.records import CityRecord, Recording
from fireworld_viewer.city_mesh import build_mesh
from fireworld_viewer.rerun_view import brigades, city_layers
from fireworld_viewer.rerun_view.air import log_air
from fireworld_viewer.rerun_view.layers import Layers
from fireworld_viewer.rerun_view.plots import log_plots
from fireworld_viewer.story.narration import decision_lines, event_lines
from fireworld_viewer.story.series import choices_of


class RunLayers:
    """Sends one run to a Rerun stream: the city at once, then its steps as they come, one by one or many together.

    Args:
        stream: where to; its log time and log tick are left out of everything sent.
        city: where the run takes place.
        prefix: entity path to put it below, "" or like "/a".
        name: of the run beside another, "" where it is alone.
        focus: ids of buildings whose temperatures are plotted.

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
    ) -> None:
        self._focus_index = _building_indices(city, focus)
        self._layers = Layers(stream, prefix, np.zeros(0, dtype=np.int64), name=name)
        self._mesh = build_mesh(city)
        self._layers.static("", rerun.ViewCoordinates.RIGHT_HAND_Z_UP)
        city_layers.log_city(self._layers, city)
        city_layers.log_handles(self._layers, city, self._mesh)

    def add(self, recording: Recording) -> None:
        """Send the next steps of the run, which are in a recording of this city: one, all, or any number of them."""
        layers, mesh = self._layers, self._mesh
        layers.steps = recording.steps
        city_layers.log_buildings(layers, recording, mesh)
        log_air(layers, recording, mesh)
        brigades.log_brigades(layers, recording)
        brigades.log_water(layers, recording, mesh)
        city_layers.log_civilians(layers, recording, mesh)
        city_layers.log_sites(layers, recording)
        log_plots(layers, recording, self._focus_index)
        brigades.log_states(layers, recording)
        _log_text(layers, recording)


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
