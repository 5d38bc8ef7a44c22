"""Convergence graphs of a study: return and policy changes by episode, mean over repetitions."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from fireworld.kernels.arrays import Array
from fireworld.reproduction import paper
from fireworld.reproduction.study import TOGETHER, TOGETHER_WITHOUT_FLAGS, LearningCurve, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_returns(study: Study) -> Figure:
    """Draw the return of every episode of Table 1's scenarios."""
    return _draw(study, "return of the episode, in thousands", lambda curve: curve.total_reward / 1000.0)


def draw_policy_changes(study: Study) -> Figure:
    """Draw in how many states the greedy action changed, episode by episode of Table 1's scenarios."""
    return _draw(study, "states whose best action changed", lambda curve: curve.n_changed)


def _draw(study: Study, label: str, of: Callable[[LearningCurve], Array]) -> Figure:
    from fireworld_viewer.pictures.policy_figures import LearningPanel, draw_learning_curves

    panels = [
        LearningPanel(
            title=row.scenario,
            curves={
                team: [of(curve) for curve in study.curves_of(team, row.scenario)]
                for team in (TOGETHER, TOGETHER_WITHOUT_FLAGS)
            },
            marked_episode=row.convergence_episode,
        )
        for row in paper.TABLE_1
    ]
    return draw_learning_curves(panels, label=label, mark="paper converged")
