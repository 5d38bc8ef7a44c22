"""SARSA over the features of targets: a network of values that a team learns while it fights. MODEL 9."""

from __future__ import annotations

from fireworld.draws import ACTION
from fireworld.kernels.allocation import may_name
from fireworld.kernels.arrays import Array, Learner, NetworkArrays, TargetLearner
from fireworld.kernels.choice import keeps_choice, tries_another
from fireworld.kernels.draws import below
from fireworld.kernels.episode_arrays import Ranks
from fireworld.kernels.jit import inner
from fireworld.kernels.network import add_multiple, put_through, slope
from fireworld.kernels.ranking import Sight
from fireworld.kernels.ranks import count_in, see_row
from fireworld.kernels.situation import reads_around


@inner
def explored_place(brigade: int, first: int, end: int, epsilon: float, seed: int, step: int) -> int:
    """Return a place drawn from [first, end) with probability epsilon, else -1."""
    if tries_another(brigade, epsilon, seed, step):
        return first + below(seed, ACTION, brigade, step, end - first)
    return -1


@inner
def value_and_gradient(network: NetworkArrays, seen: Array, learner: TargetLearner) -> float:
    """Return the value of a target as `value_by_network` does, and write how each of its numbers changes it.

    `seen` (30,) is what the brigade sees of it; written are `learner.gradient`, in the order of the network's numbers,
    and the scratch of the layers.
    """
    outputs, n_layers = learner.outputs, len(network.layer)
    for i in range(len(network.feature)):
        outputs[0, i] = seen[network.feature[i]]
    for k in range(n_layers):
        put_through(network, k, outputs[k], outputs[k + 1])
    learner.back[n_layers & 1, 0] = 1.0
    for after in range(n_layers):
        k = n_layers - 1 - after
        take_back(network, k, outputs[k], outputs[k + 1], learner.back[(k + 1) & 1], learner.back[k & 1], learner)
    return outputs[n_layers, 0]


@inner
def take_back(
    network: NetworkArrays, k: int, came: Array, result: Array, down: Array, up: Array, learner: TargetLearner
) -> None:
    """Write how the numbers of layer k change the value, and how its inputs do, `up`; `down`: how its outputs do."""
    number, (n_in, n_out, activation, place) = network.number, network.layer[k]
    for j in range(n_out):
        down[j] *= slope(activation, result[j])
        learner.gradient[place + j] = down[j]
    for i in range(n_in):
        place += n_out
        total = 0.0
        for j in range(n_out):
            learner.gradient[place + j] = down[j] * came[i]
            total += down[j] * number[place + j]
        up[i] = total


@inner
def compare_targets(
    brigade: int,
    first: int,
    end: int,
    greedy: int,
    chosen: int,
    epsilon: float,
    known: Array,
    network: NetworkArrays,
    sight: Sight,
    ranks: Ranks,
    seen: Array,
    learner: TargetLearner,
) -> None:
    """Write what a brigade's choice is compared with, and what it sees of it into the first row of `seen` (8, 30).

    The buildings [first, end) in the row have been valued by it; `greedy` and `chosen` are among them. Written are the
    mean value and gradient of all targets, each by how probable its choice was, and the mean of what is seen of them.
    """
    sites, around, mean = sight.sites, reads_around(network), learner.state_seen
    count_in(known[brigade], -1.0, sites, ranks)
    mean[:] = 0.0
    learner.mean_gradient[:] = 0.0
    learner.mean_value[0] = 0.0
    for k in range(first, end):
        see_row(brigade, k, k + 1, around, sight, ranks, seen)
        add_multiple(1.0 / (end - first), seen[0], mean)
        share = epsilon / (end - first) + (1.0 - epsilon if k == greedy else 0.0)
        learner.mean_value[0] += share * value_and_gradient(network, seen[0], learner)
        add_multiple(share, learner.gradient, learner.mean_gradient)
    see_row(brigade, chosen, chosen + 1, around, sight, ranks, seen)
    count_in(known[brigade], 1.0, sites, ranks)


@inner
def go_for_and_learn(brigade: int, seen: Array, network: NetworkArrays, learner: Learner) -> None:
    """Learn from the choice before, now that the next target is known and compared; remember this one.

    Its value is that of the state, a weighted sum of the mean of what is seen of all targets, and by how much the
    network values it above their mean. `seen` (30,) is what the brigade sees of it.
    """
    of_targets = learner.of_targets
    mean, gradient, size = of_targets.state_seen, of_targets.gradient, 1.0
    value = value_and_gradient(network, seen, of_targets) - of_targets.mean_value[0]
    add_multiple(-1.0, of_targets.mean_gradient, gradient)
    for k in range(len(mean)):
        value += of_targets.state_weight[k] * mean[k]
        size += mean[k] * mean[k]
    for k in range(len(gradient)):
        size += gradient[k] * gradient[k]
    learn_target(brigade, value, network, learner)
    kept = learner.discount[brigade] * of_targets.decay[0] if learner.state[brigade] >= 0 else 0.0
    decay_and_add(of_targets.trace[brigade], kept, gradient, size)
    decay_and_add(of_targets.state_trace[brigade], kept, mean, size)
    of_targets.value[brigade] = value
    learner.state[brigade], learner.reward[brigade], learner.discount[brigade] = 0, 0.0, 1.0


@inner
def decay_and_add(trace: Array, kept: float, gradient: Array, size: float) -> None:
    """Keep a part of a trace, and add a gradient, divided by its size so that steps are bounded."""
    for k in range(len(trace)):
        trace[k] = kept * trace[k] + gradient[k] / size


@inner
def learn_target(brigade: int, next_value: float, network: NetworkArrays, learner: Learner) -> None:
    """Move all numbers by what came of a brigade's last choice, each as far as it had part in it."""
    if learner.state[brigade] < 0:
        return
    of_targets = learner.of_targets
    error = learner.reward[brigade] + learner.discount[brigade] * next_value - of_targets.value[brigade]
    learner.td_error[brigade] = error
    add_multiple(learner.alpha[0] * error, of_targets.trace[brigade], network.number)
    add_multiple(learner.alpha[0] * error, of_targets.state_trace[brigade], of_targets.state_weight)


@inner
def keeps_target(brigade: int, before: int, step: int, site_of: Array, sight: Sight, learner: TargetLearner) -> bool:
    """Return whether a brigade that learns stays with its target: while it may name it, for some steps by a clock."""
    if not keeps_choice(brigade, before, learner.commit[0], step):
        return False
    return may_name(brigade, before, site_of, sight.sites, sight.brigade_constants.free)
