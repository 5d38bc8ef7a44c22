"""What all forms have in common: snapshots, forks, digests, pictures, and how they are made."""

from __future__ import annotations

import copy
import hashlib
import json
import secrets
from collections.abc import Mapping
from typing import Any, ClassVar, Final, Self, Unpack

import numpy as np

from fireworld.arguments import seed_of, whole_number
from fireworld.envs.many_worlds import Worlds
from fireworld.envs.one_world import OneWorld
from fireworld.envs.rendering import MODES, Rendering
from fireworld.envs.setup import Scenarios, SetupOptions, setup_of
from fireworld.envs.snapshots import pack, unpack
from fireworld.errors import LogError, expected
from fireworld.policy.protocol import Policy
from fireworld.scenario.document import Choices
from fireworld.training.seeds import WORKERS_MAX, Seeds

DEFAULT: Final = "default"
"""The scenario of forms that are made by their name in Gymnasium's registry, if none is named."""


class FormOptions(SetupOptions, total=False):
    """Options of every form, besides those of `SetupOptions`.

    Attributes:
        seed: the base that the seeds of the episodes follow from, or `Seeds`; None, as if left out: one by chance.
        worker: who plays, among those that share a base, so that no two play the same episodes; 0 if left out.
        render_mode: None, as if left out; "rgb_array", pictures; "rerun", a live view.
        view_url: of "rerun", the viewer that runs already; None, as if left out: a window of its own.
    """

    seed: int | Seeds | None
    worker: int
    render_mode: str | None
    view_url: str | None


class Form:
    """A form in which a library takes worlds.

    Attributes:
        worlds: what is stepped.
        render_mode: as of `FormOptions`.
    """

    FORM: ClassVar[str]
    """What snapshots are named by."""
    worlds: Worlds
    render_mode: str | None
    _rendering: Rendering

    def snapshot(self) -> bytes:
        """Return the state, to be restored here or in another environment of the same kind and scenarios."""
        worlds = np.frombuffer(self.worlds.snapshot(), dtype=np.uint8)
        return pack(self._format, {"own": self._own_state()}, {"worlds": worlds})

    def restore(self, snapshot: bytes) -> Any:
        """Go back to the state of a snapshot, its seeds included, and return what a reset returns.

        Raises:
            LogError: it is no snapshot, or one of another kind of environment or of other scenarios.
        """
        head, held = unpack(self._format, snapshot)
        inner = held.get("worlds")
        if inner is None or inner.dtype != np.uint8:
            raise LogError(expected("snapshot", "worlds", "the bytes of worlds", "others"))
        self._check_own(head.get("own"))
        self.worlds.restore(inner.tobytes())
        self._take_own(head["own"])
        if (self.worlds.episode_number >= 0).all():
            self._rendering.begin(self.worlds)
        return self._beginning()

    def digest(self) -> str:
        """Return a digest of the state: where it is equal, the same actions lead to the same end."""
        own, worlds = self._own_state(), self.worlds.digest()
        return worlds if own is None else hashlib.sha256(f"{worlds} {json.dumps(own)}".encode()).hexdigest()

    def render(self) -> Any:
        """Return a picture with "rgb_array", (height, width, 3) uint8; with "rerun" None: the view shows every step.

        Raises:
            ArgumentError: no mode was chosen, or nothing has begun.
            ViewError: matplotlib is not installed.
        """
        found = self._rendering.pictures(self.worlds)
        return found and found[0]

    def close(self) -> None:
        """End the view; called again, it does nothing."""
        self._rendering.close()
        self.worlds.close()

    @property
    def _format(self) -> str:
        return f"fireworld-{self.FORM}/1"

    def _own_state(self) -> Any:
        """Return what a form remembers besides its worlds, as plain values."""
        return None

    def _check_own(self, own: Any) -> None:
        """Raise LogError for anything that `_own_state` would not return."""
        if own is not None:
            raise LogError(expected("snapshot", "own", "nothing", own))

    def _take_own(self, own: Any) -> None:
        """Go back to what `_own_state` returned."""

    def _beginning(self) -> Any:
        """Return what a reset returns."""
        raise NotImplementedError


class OneWorldForm(Form):
    """A form of one world."""

    worlds: OneWorld

    def __init__(
        self,
        scenario: Scenarios = DEFAULT,
        *,
        choices: Choices | None,
        others: Policy | None = None,
        seed: int | Seeds | None = None,
        worker: int = 0,
        render_mode: str | None = None,
        view_url: str | None = None,
        **options: Unpack[SetupOptions],
    ) -> None:
        """Make the world; arguments as of `FormOptions` and `setup_of`; `others` as of `OneWorld`."""
        self._rendering = Rendering(render_mode, view_url)
        self.render_mode = render_mode
        self.worlds = OneWorld(
            setup_of(scenario, choices=choices, **options),
            seeds=seeds_of(seed),
            worker=whole_number("worker", worker, least=0, most=WORKERS_MAX - 1),
            others=others,
        )

    def fork(self, *, seed: int | None = None) -> Self:
        """Return an environment in the same state that goes its own way, without a view.

        Args:
            seed: of the random draws from here on; None: the same, so that the same actions lead to the same end.

        Raises:
            ArgumentError: it has not begun, or the seed makes no sense.
        """
        forked = copy.deepcopy(self)
        forked.worlds.fork(0, 0, seed=seed)
        return forked


def metadata_of(name: str) -> dict[str, Any]:
    """Return what libraries want to know of a form."""
    return {"name": f"fireworld_{name}_v0", "render_modes": list(MODES), "render_fps": 10}


def seeds_of(seed: object) -> Seeds:
    """Return the seeds that follow from a base, or from one by chance.

    Raises:
        ArgumentError: it is no base.
    """
    if isinstance(seed, Seeds):
        return seed
    return Seeds(secrets.randbits(32) if seed is None else seed_of(seed))


def world_seed_in(options: Mapping[str, Any] | None) -> list[int] | None:
    """Return the seed that the options of a reset name for its world, if they do."""
    return [options["world_seed"]] if options and "world_seed" in options else None
