"""The eight features in words: from a state's number to what a brigade sees in it, and back."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from fireworld.errors import PolicyError, expected
from fireworld.records import ACTIONS, LEVELS, VOLUMES


class Feature(NamedTuple):
    """One of the eight features that make up a state."""

    name: str
    values: tuple[str, ...]


FEATURES: Final = (
    Feature("free_edges", ("0", "1", "2", "3", "4")),
    Feature("distance_from_center", LEVELS),
    Feature("distance_from_civilian", LEVELS),
    Feature("volume", VOLUMES),
    *(Feature("others_" + action.replace("-", "_"), ("no", "yes")) for action in ACTIONS),
)
"""The features, the most significant first; their names are those of the recorded /observations."""
N_OWN: Final = 4
"""Features of the fire; those after them are what the other brigades do."""
RADIX: Final = tuple(len(feature.values) for feature in FEATURES)
N_STATES_ALONE: Final = math.prod(RADIX[:N_OWN])
"""270, without the cooperation flags."""
N_FLAG_VALUES: Final = math.prod(RADIX[N_OWN:])
N_STATES: Final = N_STATES_ALONE * N_FLAG_VALUES
"""4320."""


def features_of(state: int) -> tuple[int, ...]:
    """Return the eight features of a state 0..4319."""
    found = []
    for feature in reversed(FEATURES):
        state, value = divmod(state, len(feature.values))
        found.append(value)
    return tuple(reversed(found))


def describe_state(state: int, *, with_others: bool = True) -> str:
    """Return in words what a brigade sees in a state 0..4319; a table of 270 states does not see what the others do."""
    edges, center, civilian, volume, *others = features_of(state)
    fire = (
        f"free to spread over {edges} side{'' if edges == 1 else 's'}, distance from center {LEVELS[center]}, "
        f"from a civilian {LEVELS[civilian]}, burning volume {VOLUMES[volume].replace('-', ' ')}"
    )
    if not with_others:
        return fire
    doing = [action for action, done in zip(ACTIONS, others, strict=True) if done]
    return f"{fire}; others do {', '.join(doing) or 'nothing'}"


def short_state(state: int, *, with_others: bool = True) -> str:
    """Return a state as `find_states` reads it: free_edges=3,volume=high and so on; without the flags that are "no"."""
    parts = []
    for place, (feature, value) in enumerate(zip(FEATURES, features_of(state), strict=True)):
        if place < N_OWN or (with_others and value):
            parts.append(f"{feature.name}={feature.values[value]}")
    return ",".join(parts)


def find_states(text: str) -> list[int]:
    """Return the states that a user names: by a number, or by features as in "free_edges=3,volume=high"."""
    if text.strip().isdecimal() and text.isascii():
        number = int(text) if len(text) < 10 else N_STATES
        if number >= N_STATES:
            raise PolicyError(expected("STATE", "", f"a number from 0 to {N_STATES - 1}", text))
        return [number]
    wanted = _wanted_values(text)
    return [
        state for state in range(N_STATES) if all(features_of(state)[place] == value for place, value in wanted.items())
    ]


def _wanted_values(text: str) -> dict[int, int]:
    """Return the values asked for, by the place of their feature."""
    names = [feature.name for feature in FEATURES]
    wanted: dict[int, int] = {}
    for part in text.split(","):
        name, equals, word = (piece.strip() for piece in part.partition("="))
        if not equals:
            raise PolicyError(expected("STATE", "", "a number, or features as in free_edges=3,volume=high", text))
        if name not in names:
            raise PolicyError(expected("STATE", name, "one of " + ", ".join(names), name))
        place = names.index(name)
        values = FEATURES[place].values
        if word not in values:
            raise PolicyError(expected("STATE", name, "one of " + ", ".join(values), word))
        if wanted.setdefault(place, values.index(word)) != values.index(word):
            raise PolicyError(expected("STATE", name, "one value", f"{word} besides another"))
    return wanted
