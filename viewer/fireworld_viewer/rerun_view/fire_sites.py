"""Fire sites in Rerun: a box around each, and thick lines where its fire can still spread."""

from __future__ import annotations

import numpy as np
import rerun
from numpy.typing import NDArray

from fireworld.records import Recording
from fireworld_viewer import colors
from fireworld_viewer.rerun_view.layers import Layers

_TOPIC = "/observations"


def log_sites(layers: Layers, recording: Recording) -> None:
    """Draw a box around each fire site and thick lines along the sides over which its fire can spread."""
    ids, sides = recording.ragged(_TOPIC, "site_id"), recording.ragged(_TOPIC, "site_free_sides")
    count = np.array([len(row) for row in ids])
    if not count.any() and not layers.has("fire/sites"):
        return
    west, south, east, north = (
        _joined(recording, f"site_{side}_m").astype(np.float32) for side in ("west", "south", "east", "north")
    )
    site, burning = np.concatenate(ids).tolist(), _joined(recording, "site_n_burning").tolist()
    labels = [f"fire {number}: {n} burning" for number, n in zip(site, burning, strict=True)]
    height = np.full(len(west), 1.0, dtype=np.float32)
    boxes = rerun.Boxes3D.columns(
        centers=np.column_stack([(west + east) / 2, (south + north) / 2, height]),
        half_sizes=np.column_stack([(east - west) / 2, (north - south) / 2, height]),
        labels=labels,
    )
    style = rerun.Boxes3D.from_fields(colors=colors.single(colors.CLOSED_SIDE_RGB), radii=[0.2], show_labels=[False])
    layers.static("fire/sites", style)
    layers.rows("fire/sites", boxes.partition(count))

    bits = np.concatenate(sides).astype(np.uint8)
    free = (bits[:, np.newaxis] >> np.arange(4, dtype=np.uint8)) & 1  # (sites, 4): N, E, S, W as in records.SIDES
    nw, ne, se, sw = (
        np.column_stack([x, y, height]) for x, y in ((west, north), (east, north), (east, south), (west, south))
    )
    ends = ((nw, ne), (ne, se), (se, sw), (sw, nw))
    strips = np.stack([np.stack(pair, axis=1) for pair in ends], axis=1)
    per_step = np.bincount(np.repeat(np.arange(len(count)), count), weights=free.sum(axis=1), minlength=len(count))
    chosen = strips[free.astype(bool)]
    layers.strips("fire/free_sides", chosen, per_step.astype(int), radius_m=0.9, rgb=colors.FREE_SIDE_RGB)


def _joined(recording: Recording, name: str) -> NDArray[np.generic]:
    """Return a field of the sites of all steps, one after another: (sites,)."""
    return np.concatenate(recording.ragged(_TOPIC, name))
