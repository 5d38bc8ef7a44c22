"""Training logs that are damaged, cut, foreign or made by hand: one line each, and never another error."""

import json
import random
import zlib

import pytest
from fireworld_recorder.header import to_metadata
from fireworld_recorder.writer import StepFile

from fireworld.errors import FireworldError, LogError
from fireworld.training.log.difference import diff_trainings
from fireworld.training.log.export import export_training
from fireworld.training.log.reader import open_training
from fireworld.training.log.records import TRAINING, channels_of
from fireworld.training.log.summary import training_summary
from fireworld.training.log.writer import header_of, plan_of
from fireworld.training.methods.sarsa import Sarsa


def use(path):
    """Do all that reads a log."""
    log = open_training(path, partial=True)
    for _ in log.reports():
        pass
    training_summary(log)
    return log


@pytest.mark.slow
def test_a_changed_byte_is_found_and_what_is_before_it_is_good(log_path, tmp_path):
    whole = log_path.read_bytes()
    places, n_good = random.Random(5), set()
    for _ in range(60):
        data = bytearray(whole)
        data[places.randrange(len(data))] ^= 1 << places.randrange(8)
        path = tmp_path / "a.mcap"
        path.write_bytes(data)
        with pytest.raises(FireworldError):
            open_training(path)
        try:
            log = use(path)
        except FireworldError:
            continue
        assert log.damage is not None
        n_good.add(len(log))
    assert len(n_good) > 5


@pytest.mark.slow
def test_a_cut_log_is_good_up_to_the_last_part(log_path, tmp_path):
    whole, places = log_path.read_bytes(), random.Random(6)
    for n_bytes in [0, 1, 8, *(places.randrange(len(whole)) for _ in range(40)), len(whole) - 1]:
        path = tmp_path / "a.mcap"
        path.write_bytes(whole[:n_bytes])
        try:
            log = use(path)
        except FireworldError:
            continue
        assert log.state == "partial"
        prefix = [[bytes(data) for _, data in raw] for raw in log.raw_parts()]
        full = [[bytes(data) for _, data in raw] for raw in open_training(log_path).raw_parts()]
        assert prefix == full[: len(prefix)]
        if prefix:
            assert diff_trainings(log_path, path, partial=True).same == (len(prefix) == len(full))


def rewrite(log, path, *, header=None, change=lambda _, messages: messages):
    """Write a log again, sealed as if it were true, with something changed."""
    from fireworld_recorder.chain import Chain
    from fireworld_recorder.codec import encode

    from fireworld.training.log.records import PartCommit

    header = header or log.header
    chain = Chain(log.found.first, TRAINING)
    with StepFile(
        path,
        metadata=to_metadata(header, TRAINING),
        attachments=header.attachments,
        channels=channels_of(log.trainer().topics),
        city=log.found.first,
        kind=TRAINING,
        force=True,
    ) as file:
        for number, raw in enumerate(log.raw_parts()):
            messages = change(number, [(topic, bytes(data)) for topic, data in raw[:-1]])
            for topic, data in messages:
                chain.add(topic, data)
            commit = chain.seal(PartCommit(step=number, done=False, hash=b""))
            file.commit(number, [*messages, (PartCommit.topic, encode(commit))])
    return path


def test_columns_that_cannot_be_are_refused(log, tmp_path):
    """A log can be sealed by anybody: what goes into compiled code is looked at first."""
    from dataclasses import replace

    import numpy as np
    from fireworld_recorder.codec import decode, encode

    from fireworld.training.log.records import Episode, Tables

    def changed(**values):
        def change(number, messages):
            if number != 1:
                return messages
            record = decode(Episode, dict(messages)["/episode"])
            made = {key: value(getattr(record, key)) for key, value in values.items()}
            return [("/episode", encode(replace(record, **made))), *messages[1:]]

        return change

    def no_tables(number, messages):
        empty = Tables(1, 270, np.zeros(7), np.zeros(7, dtype=np.uint64))
        return [*messages[:1], ("/tables", encode(empty))] if number == 1 else messages

    faults = [
        changed(state=lambda column: np.full(len(column), 4320)),
        changed(state=lambda column: np.full(len(column), -7)),
        changed(action=lambda column: np.full(len(column), 4)),
        changed(choice=lambda column: np.full(len(column), 9)),
        changed(state=lambda column: column[:-1]),
        changed(reward=lambda column: column[:-1]),
        changed(n_steps=lambda n: n + 1),
        changed(n_steps=lambda _: -1),
        changed(n_steps=lambda _: 2**31 - 1),
        changed(scenario=lambda _: 99),
        changed(scenario=lambda _: -1),
        changed(episode=lambda _: 5),
        lambda number, messages: [] if number == 1 else messages,
        no_tables,
    ]
    for change in faults:
        path = rewrite(log, tmp_path / "a.mcap", change=change)
        with pytest.raises(LogError, match=f"^{path}: part [12]: "):
            for _ in open_training(path).reports():
                pass


@pytest.mark.parametrize("name", ["weights", "scores", "fire", "seed", "mean", "spread"])
def test_generations_whose_columns_do_not_fit_are_refused(make_log, tmp_path, name):
    from dataclasses import replace

    from fireworld_recorder.codec import decode, encode

    from fireworld.training.log.records import Tried

    log = open_training(make_log("search"))

    def change(_, messages):
        tried = decode(Tried, dict(messages)["/generation"])
        return [("/generation", encode(replace(tried, **{name: getattr(tried, name)[:-1]})))]

    path = rewrite(log, tmp_path / "a.mcap", change=change)
    with pytest.raises(LogError, match="part 0: /generation: its columns are not of the same"):
        export_training(open_training(path), tmp_path / "tables")


EVOLVED = ("evolution", "/evolved", "networks and fires")
IMPROVED = ("rollouts", "/improved", "fights")


@pytest.mark.parametrize(
    ("method", "topic", "same", "name"),
    [(*EVOLVED, name) for name in ("scores", "fire", "seed", "mean", "direction", "kept")]
    + [(*IMPROVED, name) for name in ("fire", "seed", "score", "n_tried")],
)
def test_generations_of_networks_whose_columns_do_not_fit_are_refused(make_log, tmp_path, method, topic, same, name):
    from dataclasses import replace

    from fireworld_recorder.codec import decode, encode

    from fireworld.training.log.records import Evolved, Improved

    log = open_training(make_log(method))

    def change(_, messages):
        found = decode({"/evolved": Evolved, "/improved": Improved}[topic], dict(messages)[topic])
        return [(topic, encode(replace(found, **{name: getattr(found, name)[:-1]})))]

    path = rewrite(log, tmp_path / "a.mcap", change=change)
    with pytest.raises(LogError, match=f"part 0: {topic}: its columns are not of the same {same}"):
        export_training(open_training(path), tmp_path / "tables")


@pytest.mark.parametrize(("name", "value"), [("scenario", 99), ("scenario", -1), ("seed", 2**63)])
def test_places_and_seeds_that_cannot_be_are_refused_by_every_command(log, tmp_path, fireworld, name, value):
    from dataclasses import replace

    from fireworld_recorder.codec import decode, encode

    from fireworld.training.log.records import Episode

    def change(number, messages):
        first = ("/episode", encode(replace(decode(Episode, dict(messages)["/episode"]), **{name: value})))
        return [first, *messages[1:]] if number == 1 else messages

    path = rewrite(log, tmp_path / "a.mcap", change=change)
    scenario = log.scenarios[0].name
    for words in (
        ("info", path),
        ("verify", path),
        ("diff", log.path, path),
        ("diff", path, log.path),
        ("export", path, "--parquet", tmp_path / "tables"),
        ("replay", path, "--scenario", scenario, "--episode", 1, "-o", tmp_path / "b.mcap"),
        ("report", path, "-o", tmp_path / "a.html"),
    ):
        done = fireworld(*words)
        assert (done.code, done.out) == (2, ""), words
        assert f"a.mcap: part 1: /episode: {name}: " in done.err, words


def test_attachments_that_make_no_sense(log, tmp_path):
    from dataclasses import replace

    files = dict(log.header.attachments)
    method, curriculum = json.loads(files["method.json"]), json.loads(files["curriculum.json"])
    for changed, message in [
        ({"method.json": b"{"}, "make no sense"),
        ({"method.json": json.dumps({**method, "name": "x"}).encode()}, "--method: expected one of"),
        ({"method.json": json.dumps({**method, "alpha": 7}).encode()}, "alpha: expected a number from 0 to 1"),
        ({"curriculum.json": json.dumps({**curriculum, "stages": 1}).encode()}, "make no sense"),
        ({"curriculum.json": json.dumps({**curriculum, "stages": []}).encode()}, "attachments: curriculum: expected"),
        ({next(name for name in files if name.endswith(".yaml")): b"a: ["}, "attachments: "),
    ]:
        path = rewrite(log, tmp_path / "a.mcap", header=replace(log.header, attachments={**files, **changed}))
        with pytest.raises(LogError, match=message):
            open_training(path)
    for name in ("method.json", "curriculum.json"):
        left = {key: data for key, data in files.items() if key != name}
        path = rewrite(log, tmp_path / "a.mcap", header=replace(log.header, attachments=left))
        with pytest.raises(LogError, match=f"expected {name}"):
            open_training(path)


def test_another_version_or_kind(log_path, tmp_path):
    path = tmp_path / "a.mcap"
    path.write_bytes(log_path.read_bytes().replace(b"fireworld-training/1", b"fireworld-training/2"))
    with pytest.raises(
        LogError, match="expected fireworld-training/1, got 'fireworld-training/2'; it was written by a"
    ):
        open_training(path)
    path.write_bytes(b"not a log")
    with pytest.raises(LogError, match="expected an MCAP recording"):
        open_training(path)
    with pytest.raises(LogError, match="cannot be read"):
        open_training(tmp_path / "none.mcap")


def test_header_and_plan_say_what_the_training_is(curriculum, log):
    trainer = Sarsa(n_episodes_max=6, n_episodes_unchanged=3).trainer(curriculum, seed=1)
    assert header_of(trainer) == log.header
    assert plan_of(trainer).n_brigades.tolist() == log.plan.n_brigades.tolist() == [1, 1, 3, 3]
    assert log.plan.stage.tolist() == [0, 0, 1, 1]
    assert zlib.crc32(log.plan.digests) == zlib.crc32(b"".join(bytes.fromhex(one.digest) for one in log.scenarios))
