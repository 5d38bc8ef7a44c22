"""What environments show: pictures of worlds, or a live view of the first of them."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any, Final

from fireworld.arguments import ArgumentError
from fireworld.envs.following import Follower
from fireworld.envs.many_worlds import Worlds
from fireworld.errors import expected, nearest
from fireworld.simulation.built import BuiltScenario

if TYPE_CHECKING:
    from fireworld_viewer.pictures.frames import Frame, RunFrames
    from fireworld_viewer.rerun_view.live import EpisodesView, Screen

    from fireworld.records import CityRecord, RunHeader

PICTURES, LIVE = "rgb_array", "rerun"
MODES: Final = (PICTURES, LIVE)
WHO: Final = "environment"
"""In place of a policy's name."""


class Watched:
    """A world that is shown, followed from the beginning of an episode, or from where it was restored."""

    def __init__(self, worlds: Worlds, index: int) -> None:
        self.built, world = worlds.built(index), worlds.world(index)
        self.follower = Follower(world)
        self.header: RunHeader = self.built.header(
            seed=world.seed, policy=WHO, policy_digest="", n_steps_max=world.n_steps_max
        )


class Rendering:
    """Shows worlds in a mode of MODES, or not at all; copies of it, and what is pickled, have no view.

    Args:
        mode: None: nothing is shown, and nothing is followed.
        view_url: of a live view, the viewer that runs; None: a window of its own.

    Raises:
        ArgumentError: there is no such mode.
        ViewError: there is no viewer, no display, or nothing at the address.
    """

    def __init__(self, mode: str | None, view_url: str | None) -> None:
        if mode is not None and mode not in MODES:
            hint = nearest(mode, MODES) if isinstance(mode, str) else ""
            raise ArgumentError(expected("render_mode", "", f"None or one of {', '.join(MODES)}", mode, hint))
        if view_url is not None and mode != LIVE:
            raise ArgumentError(expected("view_url", "", f"None without render_mode {LIVE}", view_url))
        self._mode = mode
        self._forget()
        self._screen: Screen | None = find_screen(view_url) if mode == LIVE else None

    def _forget(self) -> None:
        self._screen = None
        self._view: EpisodesView | None = None
        self._watched: list[Watched] = []
        self._cities: dict[int, tuple[BuiltScenario, CityRecord]] = {}
        self._frames: dict[int, RunFrames] = {}

    def begin(self, worlds: Worlds) -> None:
        """Show worlds that have been reset or restored."""
        shown = {PICTURES: worlds.n, LIVE: int(self._screen is not None)}.get(self._mode or "", 0)
        self._watched = [Watched(worlds, index) for index in range(shown)]
        self._show()

    def follow(self, worlds: Worlds) -> None:
        """Show the step that has been run; worlds that have begun anew in it are followed from there on."""
        if not self._watched:
            return
        (action, target), steps = worlds.decisions(), worlds.info()["step"]
        for index, watched in enumerate(self._watched):
            if steps[index] == 0:
                self._watched[index] = Watched(worlds, index)
            elif watched.follower.record.step < steps[index]:
                watched.follower.follow(action[index], target[index])
        self._show()

    def pictures(self, worlds: Worlds) -> tuple[Frame, ...] | None:
        """Return a picture of every world, (height, width, 3) uint8; None with a live view, which shows every step.

        Raises:
            ArgumentError: no mode was chosen, or nothing has begun.
            ViewError: matplotlib is not installed.
        """
        if self._mode is None:
            raise ArgumentError(expected("render", "", f"render_mode {' or '.join(MODES)} when it was made", None))
        if (worlds.episode_number < 0).any():
            raise ArgumentError(expected("render", "", "an environment that was reset", "one that was not"))
        if self._mode == LIVE:
            return None
        if not self._watched:
            self.begin(worlds)
        return tuple(map(self._picture, self._watched))

    def close(self) -> None:
        """End the view."""
        if self._view is not None:
            self._view.close()
        self._forget()

    def _picture(self, watched: Watched) -> Frame:
        from fireworld_viewer.pictures.frames import RunFrames

        key = id(watched.built)
        if key not in self._frames:
            self._frames[key] = RunFrames(self._city(watched), watched.built.scenario.name)
        return self._frames[key].frame(watched.follower.record, note=f"seed {watched.header.seed}")

    def _show(self) -> None:
        """Send the last step of the first world to the live view, if there is one."""
        if self._screen is None or not self._watched:
            return
        from fireworld_viewer.rerun_view.live import EpisodesView

        first = self._watched[0]
        city = self._city(first)
        if self._view is None:
            self._view = EpisodesView(self._screen, len(city.building_id), warn=_warn)
        self._view.add(first.header, city, first.follower.record)

    def _city(self, watched: Watched) -> CityRecord:
        key = id(watched.built)
        if key not in self._cities:
            self._cities[key] = watched.built, watched.built.city_record()  # kept, so that no other has its id
        return self._cities[key][1]

    def __getstate__(self) -> dict[str, Any]:
        return {"_mode": self._mode}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._mode = state["_mode"]
        self._forget()


def find_screen(view_url: str | None) -> Screen:
    """Return where a live view goes, before anything is run; ViewError if it cannot."""
    from fireworld_viewer.rerun_view import live

    if view_url is None:
        return live.own_window("render_mode", f"view_url of a viewer that runs, or {PICTURES}")
    return live.running_viewer(view_url, "view_url")


def _warn(line: str) -> None:
    sys.stderr.write(f"{line}\n")
