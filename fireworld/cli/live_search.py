"""`--view` of `fireworld train --method search`: the scores of the generations, and the weights they come to."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING, Final

from fireworld.cli.live import warn

if TYPE_CHECKING:
    from fireworld_viewer.rerun_view.live import Screen
    from fireworld_viewer.rerun_view.training_curves import TrainingLayout, TrainingPoint

    from fireworld.policy.ranking import Weight
    from fireworld.training.search import Generation, Searcher
    from fireworld.training.searches import SearchRun

SCORE: Final = "score"
SPREAD: Final = "spread"
HELP: Final = """\
## How to read this

A point for every generation: the mean score of all rankings that were tried in it; that of the best, on the fires by
which they were found to be the best; and how far the rankings of the next generation lie apart.

The team is the mean of the weights. What a weight counts:
"""


@contextmanager
def watched_search(
    screen: Screen | None, runs: Sequence[SearchRun]
) -> Iterator[Callable[[SearchRun, Generation], None]]:
    """Give a function that shows a generation, as `watched_training` does an episode.

    Args:
        screen: where; None for nowhere.
        runs: all searches to come.
    """
    if screen is None:
        yield lambda _, __: None
        return
    from fireworld_viewer.rerun_view.live import TrainingView

    with closing(TrainingView(screen, _layout([run.searcher for run in runs]), warn=warn)) as watched:
        yield lambda run, generation: watched.add(_point(run.searcher, generation))


def _layout(searchers: Sequence[Searcher]) -> TrainingLayout:
    """Return what is drawn: scores and spread of all searches, and a tab with the weights of each."""
    from fireworld_viewer.rerun_view.training_curves import LayoutTab, TrainingLayout

    return TrainingLayout(
        title="search",
        timeline="generation",
        plots={SCORE: "Score, as a share of the maximum", SPREAD: "Spread: mean standard deviation of the weights"},
        tabs={
            f"Seed {one.seed}": LayoutTab(
                {_plot(one, group): f"Weights of {group}" for group in _groups(one)}, _page(one)
            )
            for one in searchers
        },
    )


def _point(searcher: Searcher, generation: Generation) -> TrainingPoint:
    """Return a generation as it is drawn."""
    from fireworld_viewer.rerun_view.training_curves import TrainingPoint

    team, mean = f"seed {searcher.seed}", searcher.state.mean.tolist()
    weights = {
        _plot(searcher, group): {weight.name: mean[place] for place, weight in members.items()}
        for group, members in _groups(searcher).items()
    }
    scores = {f"{team}, all": generation.score_mean, f"{team}, the best": generation.score_best}
    return TrainingPoint(
        number=generation.generation + 1,
        values={SCORE: scores, SPREAD: {team: generation.spread}, **weights},
        pages={_page(searcher): _found(searcher)},
    )


def _found(searcher: Searcher) -> str:
    """Say what the weights come to by now, and what each of them counts."""
    from fireworld.policy.preferences import sentences

    said = "\n".join(f"* {sentence}" for sentence in sentences(searcher.ranking(), row=0))
    members = [weight for group in _groups(searcher).values() for weight in group.values()]
    meanings = "\n".join(f"* **{weight.name}**: {weight.meaning}" for weight in members)
    n = f"{searcher.state.generation} of {searcher.search.n_generations}"
    return f"# Generation {n}\n\n{said}\n\n{HELP}\n{meanings}\n"


def _page(searcher: Searcher) -> str:
    """Name the page about the weights of a search."""
    return f"page/{searcher.seed}"


def _plot(searcher: Searcher, group: str) -> str:
    """Name the plot of a group of weights of a search."""
    return f"weights/{searcher.seed}/{group.replace(' ', '-')}"


def _groups(searcher: Searcher) -> Mapping[str, Mapping[int, Weight]]:
    """Return the weights that are searched for, by their place among all, in groups of what they are about."""
    from fireworld.policy.ranking import OF_BRIGADE, OF_BUILDING, OF_TEAM, WEIGHTS

    free = searcher.free_weights()
    sizes = {"the building": len(OF_BUILDING), "the brigade": len(OF_BRIGADE), "the team": len(OF_TEAM)}
    sizes["the action"] = len(WEIGHTS) - sum(sizes.values())
    groups, first = {}, 0
    for name, size in sizes.items():
        members = {place: WEIGHTS[place] for place in range(first, first + size) if free[place]}
        first += size
        if members:
            groups[name] = members
    return groups
