"""What is recorded of a step beside the state as it stands, in plain numpy."""

from __future__ import annotations

from typing import Any

import numpy as np

from fireworld.draws import STEP, hash_key
from fireworld.kernels.arrays import WorldState
from fireworld.kernels.brigades import REFILLING
from fireworld.policy.words import FEATURES
from fireworld.records import EVENT_KINDS
from fireworld.simulation.choices import Choices
from fireworld.simulation.world import World

BURNT_OUT = 8


def expected_fields(world: World, choices: Choices, before: WorldState) -> dict[str, Any]:
    """Return fields of the record of the last step by topic and name; `before`: a copy of the state before it."""
    state, buildings = world.state, world.city_arrays.buildings
    brigades, sites = state.brigades, state.sites
    n = int(sites.counts[0])
    order = sites.number[:n].argsort(kind="stable")
    features = choices.features.T.astype(np.uint8)
    fields = {
        "draws.key": hash_key(world.seed, STEP, 0, world.step_number),
        "observations.site": np.where(brigades.site > 0, brigades.site, -1),
        **{f"observations.{feature.name}": column for feature, column in zip(FEATURES, features, strict=True)},
        "observations.state_index": choices.state_index,
        "observations.site_id": sites.number[order],
        "observations.site_free_sides": sites.free_sides[order],
        "observations.site_n_burning": sites.start[order + 1] - sites.start[order],
        "observations.site_volume_m3": sites.volume[order],
        **{
            f"observations.site_{side}_m": getattr(sites, side)[order] / 1000.0
            for side in ("west", "south", "east", "north")
        },
        "decisions.action": brigades.action,
        "decisions.target": brigades.target,
        "brigades.x_m": brigades.x / 1000.0,
        "brigades.y_m": brigades.y / 1000.0,
        "brigades.driven_m": brigades.driven / 1000.0,
        "buildings.temperature": (np.rint(state.fire.energy / buildings.capacity * 64.0) / 64.0).astype(np.float32),
        "buildings.fuel_share": state.fire.fuel / buildings.initial_fuel,
    }
    events = _events(state, before)
    kinds = [EVENT_KINDS.index(kind) for kind, entities in events for _ in entities]
    return fields | {"events.kind": kinds, "events.entity": [entity for _, entities in events for entity in entities]}


def _events(now: WorldState, before: WorldState) -> list[tuple[str, list[int]]]:
    code, old = now.fire.fieryness, before.fire.fieryness
    burns, burnt = (code >= 1) & (code <= 3), (old >= 1) & (old <= 3)
    refilled = _zero(now.brigades.refilling, before.brigades.refilling) & (now.brigades.activity == REFILLING)
    touched = set(now.sites.label[burnt & ~burns].tolist()) - {0}
    found = [
        ("refilled", refilled),
        ("tank-empty", _zero(now.brigades.tank, before.brigades.tank)),
        ("ignited", burns & ~burnt),
        ("extinguished", burnt & ~burns & (code != BURNT_OUT)),
        ("burnt-out", (code == BURNT_OUT) & (old != BURNT_OUT)),
        ("site-out", None),
        ("civilian-hurt", _zero(before.civilians.damage, now.civilians.damage)),
        ("civilian-died", _zero(now.civilians.hp, before.civilians.hp)),
        ("brigade-hurt", _zero(before.brigades.damage, now.brigades.damage)),
        ("brigade-died", _zero(now.brigades.hp, before.brigades.hp)),
    ]
    out = sorted(touched - set(now.sites.label[burns].tolist()))
    return [(kind, out if where is None else np.flatnonzero(where).tolist()) for kind, where in found]


def _zero(zero: np.ndarray[Any, Any], more: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return where the one array holds zero and the other more."""
    return (zero == 0) & (more > 0)
