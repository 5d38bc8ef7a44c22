"""What learners played, through every command and function that reads training logs."""

from __future__ import annotations

import json
from dataclasses import fields, replace

import numpy as np
import pytest
from fireworld_recorder.chain import Chain
from fireworld_recorder.codec import decode, encode
from fireworld_recorder.header import to_metadata
from fireworld_recorder.writer import StepFile

import fireworld as fw
from fireworld import envs
from fireworld.errors import FireworldError, LogError, TrainingError
from fireworld.training.log.environment import ENVIRONMENT, Environment
from fireworld.training.log.export import table_arrays
from fireworld.training.log.played import NOTHING, OWN, Played
from fireworld.training.log.records import TRAINING, PartCommit, channels_of
from fireworld.training.method import COUNT_MAX
from tests.envs.played import chosen, play, play_with_forks
from tests.envs.towns import HOT, LATER, SMALL


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return play(tmp_path_factory.mktemp("played") / "a.mcap", own_targets=3)


@pytest.fixture(scope="module")
def other(tmp_path_factory):
    """Of one brigade that once does something else: world 1, episode 0, step 1, brigade 2."""
    file = tmp_path_factory.mktemp("played") / "b.mcap"
    worlds = envs.worlds([SMALL, LATER], 3, record=file, seeds=4, own_targets=3)
    seen = worlds.reset()
    for step in range(73):
        actions = chosen(seen, step)
        if step == 0:
            actions[1, 2] = (actions[1, 2] + 1) % 4
        seen = worlds.step(actions).observation
    worlds.close()
    return file


@pytest.fixture
def log(path):
    return fw.open_training(path)


def rewrite(log, path, change, *, plan=None):
    """Write a log again, sealed as if it were true, changed: `change(number, record)`; None: left out."""
    first = log.found.first if plan is None else encode(plan)
    chain = Chain(first, TRAINING)
    with StepFile(
        path,
        metadata=to_metadata(log.header, TRAINING),
        attachments=log.header.attachments,
        channels=channels_of(log.trainer().topics),
        city=first,
        kind=TRAINING,
        force=True,
    ) as file:
        for number, raw in enumerate(log.raw_parts()):
            changed = change(number, decode(Played, raw[0][1]))
            messages = [] if changed is None else [(Played.topic, encode(changed))]
            for topic, data in messages:
                chain.add(topic, data)
            commit = chain.seal(PartCommit(step=number, done=False, hash=b""))
            file.commit(number, [*messages, (PartCommit.topic, encode(commit))])
    return path


def test_what_environments_have_can_be_recorded():
    from fireworld.envs.autoreset import Autoreset
    from fireworld.envs.views import OBSERVATIONS
    from fireworld.rewards import KINDS

    for observation in OBSERVATIONS:
        ENVIRONMENT.with_settings({"observation": observation})
    for reward in ("score", *KINDS, "function"):
        ENVIRONMENT.with_settings({"reward": reward})
    for mode in Autoreset:
        ENVIRONMENT.with_settings({"autoreset": mode.name.lower().replace("_", "-")})
    assert COUNT_MAX >= 1
    assert {item.name for item in fields(Environment)} >= {"steps", "own_targets", "n_worlds", "first_worker"}


def test_nobody_trains_by_it(curriculum, tmp_path, fireworld):
    with pytest.raises(TrainingError, match="--method: expected one of"):
        fw.train(curriculum, method="environment")
    with pytest.raises(TrainingError, match="expected a method of fireworld's own"):
        fw.train(curriculum, method=ENVIRONMENT)
    with pytest.raises(TrainingError, match="expected a method of fireworld's own"):
        fw.open_training(play(tmp_path / "a.mcap", n_steps=30)).team()
    done = fireworld("verify", tmp_path / "a.mcap", "--team", "best.npz")
    assert done.code == 2


def test_info(path, log, fireworld):
    done = fireworld("info", path)
    assert done.code == 0
    assert "method       environment: observation features, reward score, own_targets 3" in done.out
    assert "team         not known" in done.out
    assert "scenario   episodes   steps   left   unknown" in done.out
    found = json.loads(fireworld("info", path, "--json").out)
    assert found["n_parts"] == len(log)
    assert sum(one["n_episodes"] for one in found["scenarios"]) == len(log)
    assert found["team_digest"] is None
    assert "/played" in fireworld("info", path, "--schema").out
    assert repr(log).startswith("<TrainingLog environment in small, later, seed 4: ")


def test_verify_names_what_is_not_played_so(path, log, tmp_path, fireworld):
    done = fireworld("verify", path)
    assert (done.code, done.err) == (0, "")
    assert f"played again they are the same, {len(log)} episodes, digest {log.digest}" in done.out

    def altered(**values):
        def change(number, record):
            return replace(
                record, **{name: make(getattr(record, name)) for name, make in values.items()} if number == 2 else {}
            )

        return rewrite(log, tmp_path / "b.mcap", change)

    line = log.lines[2]
    where = f"{log.scenarios[line.scenario].name}, world {line.world}, episode {line.episode}"
    for values, text in [
        ({"score": lambda score: score + 0.5}, "score"),
        ({"total_reward": lambda total: total - 1.0}, "total reward"),
        ({"seed": lambda seed: seed + 1}, "seed"),
        ({"n_burnt_out": lambda n: n + 1}, "n burnt out"),
        ({"terminated": lambda one: not one}, "terminated"),
    ]:
        done = fireworld("verify", altered(**values))
        assert done.code == 1, values
        assert where in done.out
        assert text in done.out
    assert fw.verify(altered(base=lambda base: base + 1)).difference.first.what == "seed"


def test_verify_finds_a_choice_that_could_not_be(log, tmp_path):
    """A brigade that named a building which does not burn there does `easiest` when it is played again."""

    def change(number, record):
        if number or not len(record.target):
            return record
        return replace(record, target=(record.target + 1) % 40)

    found = fw.verify(rewrite(log, tmp_path / "b.mcap", change))
    assert not found
    assert found.difference.first.phase in {"choose", "end"}


def test_diff_names_the_first_step_that_differs(path, other, fireworld):
    assert fireworld("diff", path, path).code == 0
    done = fireworld("diff", path, other)
    assert done.code == 1
    cause, first = done.out.splitlines()[:2]
    assert cause.startswith("changed: nothing that is recorded; curriculum, method, seed and simulator are the same")
    assert first.startswith("later, world 1, episode 0, step 1, brigade 2: ")
    found = json.loads(fireworld("diff", path, other, "--json").out)
    assert (found["first"]["world"], found["first"]["step"]) == (1, 1)
    assert [one["scenario"] for one in found["scenarios"]] == ["small", "later"]
    difference = fw.diff(path, other)
    assert not difference.same
    assert difference.spread[0].n_equal > 0


def test_logs_of_another_length_differ(path, tmp_path):
    short = play(tmp_path / "b.mcap", own_targets=3, n_steps=40)
    first = fw.diff(path, short).first
    assert first is not None
    with pytest.raises(LogError, match="brigades: expected 3 in small"):
        fw.diff(path, play(tmp_path / "c.mcap", scenarios=[HOT], n=1, n_steps=30))


@pytest.mark.slow
def test_pages_pictures_views_and_tables(path, other, tmp_path, fireworld):
    for words, file in [
        (("report", path, "-o", tmp_path / "a.html"), "a.html"),
        (("report", path, other, "-o", tmp_path / "b.html"), "b.html"),
        (("render", path, other, "-o", tmp_path / "a.png"), "a.png"),
        (("view", path, other, "--save", tmp_path / "a.rrd"), "a.rrd"),
        (("export", path, "--parquet", tmp_path / "tables"), "tables"),
    ]:
        done = fireworld(*words)
        assert done.code == 0, (words, done.err)
        assert (tmp_path / file).exists()
    page = (tmp_path / "a.html").read_text()
    assert "return of the episode, as the learner got it" in page
    assert "fireworld replay a.mcap --scenario small --episode -1" in page
    assert "every episode is played again and compared" in page
    assert "Convergence" in page


def test_tables(path, log):
    played, actions = table_arrays(log, "played"), table_arrays(log, "actions")
    assert len(played["left"]) == len(log)
    assert played["left"].sum() == 3
    n = sum(line.n_steps * log.scenarios[line.scenario].brigades.n for line in log.lines)
    assert len(actions["action"]) == n
    assert set(actions["action"]) == {
        "easiest",
        "nearest-to-civilian",
        "nearest-to-center",
        "nearest-to-me",
        "own-target",
        "",
    }
    assert ((actions["target"] >= 0) == (actions["action"] == "own-target")).all()


def test_episodes_are_found_by_scenario_and_by_world(path, log, tmp_path, fireworld):
    line = log.lines[4]
    assert log.position(None, 4) == log.position(None, line.episode, world=line.world) == 4
    name = log.scenarios[line.scenario].name
    of_scenario = [k for k, one in enumerate(log.lines) if one.scenario == line.scenario]
    assert log.position(name, of_scenario.index(4)) == log.position(line.scenario, of_scenario.index(4)) == 4
    assert log.position(None, -1) == len(log) - 1
    assert log.position(name, line.episode, world=line.world) == 4
    digests = set()
    for words in (
        ("--episode", 4),
        ("--world", line.world, "--episode", line.episode),
        ("--scenario", name, "--episode", of_scenario.index(4)),
    ):
        done = fireworld("replay", path, *words, "-o", tmp_path / "e.mcap", "--force")
        assert done.code == 0, done.err
        digests.add(done.out)
    assert len(digests) == 1
    assert fw.open_episode(path, 4).digest == fw.open_log(tmp_path / "e.mcap").digest
    for words, text in [
        (("--scenario", "x", "--episode", 0), "scenario: expected one of small, later, got 'x'"),
        (("--episode", 99), "episode: expected one from 0 to"),
        (("--world", 9, "--episode", 0), "world: expected a world that has episodes, got 9"),
        (("--world", 1, "--episode", 50), "episode: expected one from 0 to"),
        (("--world", 1, "--every", 2), "--world goes with --episode"),
    ]:
        done = fireworld("replay", path, *words, "-o", tmp_path / "e.mcap", "--force")
        assert done.code == 2
        assert text in done.err


def test_every_so_many_episodes(path, log, tmp_path):
    from fireworld.training.log.replay import replay_every

    written = replay_every(path, 3, tmp_path)
    assert {file.name for file in written} >= {"small-0000.mcap", "small-0003.mcap", "later-0000.mcap"}
    for file, digest in written.items():
        run = fw.open_log(file)
        assert run.digest == digest
        assert run.header.policy == "recorded"
        assert fw.verify(file)


def test_a_replayed_episode_is_a_run_like_any_other(path, log, tmp_path, fireworld):
    fw.replay_episode(log, None, 0, tmp_path / "run.mcap")
    run = fw.open_log(tmp_path / "run.mcap")
    line = log.lines[0]
    assert (run.header.seed, run.outcome.score, run.outcome.steps) == (line.seed, line.score, line.n_steps)
    place = json.loads(run.header.attachments["episode.json"])
    assert (place["world"], place["episode"], place["log"]) == (line.world, line.episode, log.digest)
    assert "choices: simultaneous" in run.header.attachments["scenario.yaml"].decode()
    decided = log.played_at(0).decided
    for row, step in enumerate([*run][1:]):
        assert step.decisions.action.tolist() == decided.action[row].tolist()
    fork = fw.fork(tmp_path / "run.mcap", at=3)
    assert fork.digest == run.digest
    assert fw.verify(fw.fork(run, at=3, policy="easiest"))
    done = fireworld("explain", tmp_path / "run.mcap", tmp_path / "run.mcap")
    assert done.code in {0, 2}


def test_columns_that_cannot_be_are_refused(log, tmp_path):
    """A log can be sealed by anybody: what goes into compiled code is looked at first."""
    faults = [
        {"action": lambda column: np.full(len(column), 9)},
        {"action": lambda column: column[:-1]},
        {"target": lambda column: column[:-1]},
        {"target": lambda column: column - 1000},
        {"n_steps": lambda n: n + 1},
        {"n_steps": lambda _: 0},
        {"n_steps": lambda _: 2**31 - 1},
        {"first_step": lambda _: 3},
        {"first_step": lambda _: -1},
        {"scenario": lambda _: 2},
        {"world": lambda _: 2048},
        {"episode": lambda _: -1},
        {"seed": lambda _: 2**63},
        {"base": lambda _: 2**32},
        {"state": lambda _: b"1" * 31},
        {"later_step": lambda _: np.array([2])},
        {"later_seed": lambda _: np.array([2], dtype=np.uint64)},
    ]
    for values in faults:

        def change(number, record, values=values):
            return replace(
                record, **{name: make(getattr(record, name)) for name, make in values.items()} if number == 1 else {}
            )

        file = rewrite(log, tmp_path / "b.mcap", change)
        with pytest.raises(LogError, match=rf"^{file}: part 1: /played"):
            for _ in fw.open_training(file).reports():
                pass
        with pytest.raises(FireworldError):
            fw.verify(file)

    def beyond(number, record):
        return replace(record, target=record.target + 10_000) if number == 1 else record

    with pytest.raises(LogError, match="a target that is no building"):
        fw.verify(rewrite(log, tmp_path / "b.mcap", beyond))


def test_forks_through_the_commands(tmp_path, fireworld):
    path = play_with_forks(tmp_path / "a.mcap")
    assert fireworld("verify", path).code == 0
    assert fireworld("diff", path, path).code == 0
    assert fireworld("export", path, "--parquet", tmp_path / "tables").code == 0
    (tmp_path / "episodes").mkdir()
    assert fireworld("replay", path, "--every", 1, "-o", tmp_path / "episodes").code == 0
    for file in (tmp_path / "episodes").iterdir():
        assert fireworld("verify", file).code == 0


def test_a_golden_that_no_learner_makes_again(path, tmp_path, fireworld):
    (tmp_path / "g").mkdir()
    (tmp_path / "g" / "a.mcap").write_bytes(path.read_bytes())
    done = fireworld("golden", "check", tmp_path / "g")
    assert done.code in {1, 2}
    assert "Traceback" not in done.err + done.out


def test_a_log_is_not_the_checkpoint_of_a_training(path, tmp_path, curriculum_file, fireworld):
    (tmp_path / "t.mcap.partial").write_bytes(path.read_bytes()[:-500])
    words = ("train", curriculum_file, "-o", tmp_path / "t.npz", "--record", tmp_path / "t.mcap", "--resume")
    done = fireworld(*words)
    assert done.code == 2
    assert "expected" in done.err


def test_codes():
    assert (OWN, NOTHING) == (4, 5)


def test_a_part_without_an_episode_is_a_line(path, log, tmp_path, fireworld):
    file = rewrite(log, tmp_path / "b.mcap", lambda number, record: None if number == 2 else record)
    calls = (["diff", path, file], ["diff", file, path], ["verify", file], ["report", file, "-o", tmp_path / "r.html"])
    for words in (
        *calls,
        ["export", file, "--parquet", tmp_path / "csv"],
        ["replay", file, "--episode", 0, "-o", tmp_path / "r.mcap"],
    ):
        done = fireworld(*words)
        assert done.code == 2, words
        assert done.err.endswith("part 2: no /played, of which the method environment has one in every part\n"), (
            done.err
        )


@pytest.mark.parametrize(
    "change", [{"stage": [0, 7]}, {"stage": [-1, 0]}, {"n_brigades": [3, 99]}, {"stage": [0, 0, 0]}]
)
def test_a_plan_that_is_not_the_curriculums_is_a_line(log, tmp_path, fireworld, change):
    (name, values), *_ = change.items()
    plan = replace(log.plan, **{name: np.array(values, dtype=np.int32)})
    file = rewrite(log, tmp_path / "b.mcap", lambda _, record: record, plan=plan)
    for words in (("report", file, "-o", tmp_path / "r.html"), ("info", file)):
        done = fireworld(*words)
        assert done.code == 2
        assert done.err.endswith("/plan: it has other stages or brigades than the curriculum that is attached\n")
