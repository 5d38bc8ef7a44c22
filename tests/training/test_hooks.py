"""Hooks of training: what TensorBoard, MLflow and JSON lines hold is what the log holds; failures cost no team."""

from __future__ import annotations

import json
import math
import struct

import numpy as np
import pytest

from fireworld.errors import FireworldError, LibraryError, OutputError
from fireworld.training.hooks import Hook, JsonlCallback, MLflowCallback, StopTraining, TensorBoardCallback
from fireworld.training.log.reader import open_training
from fireworld.training.train import train
from tests.training.conftest import SHORT_WORDS

FEW = {"n_episodes_max": 6, "n_episodes_unchanged": 3}
FULL = OSError(28, "No space left on device")
SEARCH = {"n_generations": 3, "n_candidates": 4, "n_best": 2, "n_fires": 2, "n_steps_max": 10}
METHODS = [
    ("paper", FEW),
    ("paper", {**FEW, "rule": "q-learning", "shared_table": True, "commit": 3}),
    ("search", SEARCH),
]
OLD_CALLS = pytest.mark.filterwarnings("ignore::DeprecationWarning")
"""What MLflow calls in the libraries that it needs is not always their newest."""
TRAIN = ("train", "tiny.yaml", *SHORT_WORDS, "-o", "t.npz")


def recorded(path):
    """What a training log holds, as numbers of each report."""
    log = open_training(path)
    trainer = log.trainer()
    trainer.watched = True
    return [
        trainer.numbers(log.follow(trainer, part, number)) | {"n": number} for number, part in enumerate(log.parts())
    ]


def finite(numbers):
    return {key: value for key, value in numbers.items() if key != "n" and math.isfinite(value)}


def lines_of(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def scalars_of(folder):
    """What TensorBoard shows: the scalars of each step, without those that a later event file takes back; the texts."""
    event_pb2 = pytest.importorskip("tensorboardX.proto.event_pb2")
    steps, texts = {}, []
    for path in sorted(folder.iterdir()):
        data, place = path.read_bytes(), 0
        while place < len(data):
            (size,) = struct.unpack_from("<Q", data, place)
            event = event_pb2.Event.FromString(data[place + 12 : place + 12 + size])
            place += size + 16
            if event.session_log.status == 1:
                steps = {step: values for step, values in steps.items() if step < event.step}
            for value in event.summary.value:
                if value.HasField("simple_value"):
                    steps.setdefault(event.step, {})[value.tag] = value.simple_value
                elif value.tag.endswith("text_summary"):
                    texts.append(value.tensor.string_val[0].decode())
    return steps, texts


class Failing(Hook):
    """Fails at a report."""

    name = "a server"

    def __init__(self, at, error=FULL):
        self.at, self.error, self.called = at, error, []

    def begin(self, training):
        self.called.append("begin")

    def write(self, training, report):
        self.called.append(training.n_reports)
        if training.n_reports == self.at:
            raise self.error

    def end(self, training):
        self.called.append(training.ending)

    def close(self):
        self.called.append("close")


def stop_after(n_reports):
    def callback(training, report):
        if training.n_reports == n_reports:
            raise StopTraining

    return callback


@pytest.mark.parametrize(("method", "settings"), METHODS)
def test_lines_have_what_the_log_has(here, method, settings):
    team = train(
        "tiny.yaml", method=method, set=settings, output="t.npz", record="t.mcap", callbacks=[JsonlCallback("t.jsonl")]
    )
    head, *lines, end = lines_of(here / "t.jsonl")
    assert (head["kind"], head["method"], head["seed"]) == ("training", method, 1)
    assert all(head[key] == value for key, value in settings.items())
    assert end == {"kind": "end", "ending": "done", "team": "t.npz", "digest": team.digest}
    known = recorded("t.mcap")
    assert len(lines) == len(known) > 2
    for line, numbers in zip(lines, known, strict=True):
        assert {key: line[key] for key in numbers} == numbers
    wanted = {"td_error/50", "score_share", "epsilon", "return"} if method == "paper" else {"score/the_best", "spread"}
    assert wanted <= set(lines[0])
    assert team.digest == train("tiny.yaml", method=method, set=settings).digest, "a hook changes nothing"


@pytest.mark.parametrize(("method", "settings"), METHODS)
def test_tensorboard_has_what_the_log_has(here, method, settings):
    pytest.importorskip("tensorboardX")
    team = train("tiny.yaml", method=method, set=settings, record="t.mcap", callbacks=[TensorBoardCallback("runs/a")])
    steps, texts = scalars_of(here / "runs" / "a")
    known = recorded("t.mcap")
    assert sorted(steps) == [numbers["n"] for numbers in known]
    for numbers in known:
        wanted = {key: float(np.float32(value)) for key, value in finite(numbers).items()}
        assert {key: value for key, value in steps[numbers["n"]].items() if math.isfinite(value)} == wanted
    assert f"method: {method}" in texts[0]
    assert texts[-1] == f"done, team not written, digest {team.digest}"
    assert method != "paper" or {"alone-1", "together-2"} <= set(texts)


@OLD_CALLS
@pytest.mark.slow
@pytest.mark.parametrize(("method", "settings"), METHODS)
def test_mlflow_has_what_the_log_has(here, method, settings):
    client, (run,) = mlflow_after(
        here, {"method": method, "set": settings, "output": "t.npz", "record": "t.mcap", "log": "t.csv"}
    )
    known = recorded("t.mcap")
    for key in known[0].keys() - {"n"}:
        history = {one.step: one.value for one in client.get_metric_history(run.info.run_id, key)}
        assert history == {one["n"]: one[key] for one in known if math.isfinite(one.get(key, math.nan))}
    assert run.info.status == "FINISHED"
    assert all(run.data.params[key] == str(value) for key, value in settings.items())
    kept = here / "ml" / "artifacts" / run.info.run_id / "artifacts"
    assert (kept / "t.npz").read_bytes() == (here / "t.npz").read_bytes()
    assert (kept / "log.csv").read_bytes() == (here / "t.csv").read_bytes()
    assert run.data.tags["fireworld.team_digest"] in (here / "t.jsonl").read_text()


@OLD_CALLS
@pytest.mark.slow
def test_mlflow_goes_on_with_its_run(here):
    mlflow_after(here, {"set": FEW, "output": "t.npz"}, callbacks=[stop_after(8)], ending="KILLED")
    client, (run,) = mlflow_after(here, {"set": FEW, "output": "t.npz", "record": None, "resume": True})
    steps = [one.step for one in client.get_metric_history(run.info.run_id, "score_share")]
    n_lines = len(lines_of(here / "t.jsonl")) - 2
    assert sorted(steps) == [*range(n_lines)], "each report once"


def mlflow_after(here, arguments, *, callbacks=(), ending="FINISHED"):
    pytest.importorskip("mlflow")
    pytest.importorskip("alembic")
    from mlflow.tracking import MlflowClient

    hooks = [MLflowCallback("ml"), JsonlCallback("t.jsonl"), *callbacks]
    train("tiny.yaml", callbacks=hooks, **arguments)
    client = MlflowClient(tracking_uri=f"sqlite:///{here}/ml/mlflow.db")
    runs = client.search_runs([client.get_experiment_by_name("fireworld").experiment_id])
    assert [run.info.status for run in runs] == [ending]
    return client, runs


@pytest.mark.parametrize("record", [None, "t.mcap"])
def test_a_resumed_training_continues_its_curves(here, record):
    pytest.importorskip("tensorboardX")
    arguments = {"set": FEW, "output": "t.npz", "record": record}

    def hooks():
        return [JsonlCallback("t.jsonl"), TensorBoardCallback("runs")]

    train("tiny.yaml", callbacks=[*hooks(), stop_after(8)], **arguments)
    assert lines_of(here / "t.jsonl")[-1]["ending"] == "stopped"
    with (here / "t.jsonl").open("a") as file:  # as after a kill: more than the checkpoint has, and half a line
        file.write('{"kind": "episode", "n": 8}\n{"kind": "epi')
    train("tiny.yaml", callbacks=hooks(), resume=True, **arguments)
    train("tiny.yaml", callbacks=[JsonlCallback("whole.jsonl")], **{**arguments, "output": None, "record": None})
    resumed, whole = lines_of(here / "t.jsonl"), lines_of(here / "whole.jsonl")
    assert resumed[:-1] == whole[:-1]
    assert resumed[-1]["digest"] == whole[-1]["digest"]
    assert sorted(scalars_of(here / "runs")[0]) == [*range(len(whole) - 2)]


def test_a_hook_that_fails_costs_no_team(here):
    hook = Failing(3)
    line = r"a server: OSError: \[Errno 28\] No space left on device; the training continues without it"
    with pytest.warns(UserWarning, match=line) as warned:
        team = train("tiny.yaml", set=FEW, callbacks=[hook])
    assert len(warned) == 1
    assert hook.called == ["begin", 1, 2, 3, "close"]
    assert team.digest == train("tiny.yaml", set=FEW).digest


def test_hooks_may_stop_a_training_and_know_how_it_ended(here):
    hook = Failing(3, StopTraining())
    train("tiny.yaml", set=FEW, callbacks=[hook])
    assert hook.called == ["begin", 1, 2, 3, "stopped", "close"]

    def broken(training, report):
        raise RuntimeError

    hook = Failing(None)
    with pytest.raises(RuntimeError):
        train("tiny.yaml", set=FEW, callbacks=[hook, broken])
    assert hook.called == ["begin", 1, "failed", "close"]


def test_a_hook_that_cannot_begin_ends_it(here, monkeypatch):
    def begin(self, training):
        raise ConnectionError("nobody there")

    monkeypatch.setattr(Failing, "begin", begin)
    hook = Failing(1)
    with pytest.raises(OutputError, match="a server: cannot begin: ConnectionError: nobody there"):
        train("tiny.yaml", set=FEW, output="t.npz", callbacks=[hook])
    assert hook.called == ["close"]
    assert not (here / "t.npz").exists()


def test_a_full_disk(here, fireworld, monkeypatch):
    begin = JsonlCallback.begin

    def on_a_full_disk(self, training):
        begin(self, training)
        self.close()
        self._file = open("/dev/full", "a", buffering=1)  # noqa: SIM115, PTH123 - closed by the hook

    monkeypatch.setattr(JsonlCallback, "begin", on_a_full_disk)
    done = fireworld(*TRAIN, "--jsonl", "t.jsonl")
    assert done.code == 0
    assert (
        done.err.count("t.jsonl: OSError: [Errno 28] No space left on device; the training continues without it\n") == 1
    )
    assert "digest" in done.out
    assert fireworld(*TRAIN, "--jsonl", "t.jsonl", "--force", "--strict").code == 1


def test_repetitions_have_curves_of_their_own(here, fireworld):
    pytest.importorskip("tensorboardX")
    words = ("--repetitions", 2, "--seed", 4, "--jobs", 2, "--jsonl", "t.jsonl", "--tensorboard", "runs", "--strict")
    assert fireworld(*TRAIN, *words).code == 0
    for number in (1, 2):
        head, *lines, _ = lines_of(here / f"t-{number}.jsonl")
        assert head["seed"] == 3 + number
        steps, _ = scalars_of(here / "runs" / f"seed-{3 + number}")
        assert [steps[n]["n_steps"] for n in sorted(steps)] == [line["n_steps"] for line in lines]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--jsonl", "there.txt"), "there.txt: expected a name that is free, got an existing file; use --force"),
        (("--jsonl", "t.npz"), "t.npz: expected a file of its own for every input and output, got one name twice"),
        (("--jsonl", "no/t.jsonl"), "no"),
        (("--tensorboard", "there.txt"), "there.txt: expected a folder, or a name that is free, got a file"),
        (("--tensorboard", "old"), "old: expected no event files, got those of another run; name a folder for each"),
    ],
)
def test_what_is_in_the_way_is_found_before_any_work(here, fireworld, words, message):
    if words[0] == "--tensorboard":
        pytest.importorskip("tensorboardX")
    (here / "there.txt").write_text("mine")
    (here / "old").mkdir()
    (here / "old" / "events.out.tfevents.1.host").write_text("theirs")
    done = fireworld(*TRAIN, *words)
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith(f"fireworld: {message}")
    assert done.err.count("\n") == 1
    assert (here / "there.txt").read_text() == "mine"
    assert (here / "old" / "events.out.tfevents.1.host").read_text() == "theirs"


@pytest.mark.parametrize(
    ("hook", "missing", "extra"),
    [
        (lambda: TensorBoardCallback("runs"), "tensorboardX", "tensorboard"),
        (lambda: MLflowCallback("ml"), "mlflow", "mlflow"),
    ],
)
def test_what_is_not_installed(here, monkeypatch, hook, missing, extra):
    for module in ("tensorboard", "mlflow"):
        monkeypatch.setattr(f"fireworld.training.hooks.{module}.find_spec", lambda _: None)
    with pytest.raises(LibraryError, match=rf"{missing} is not installed; try pip install 'fireworld\[{extra}\]'"):
        train("tiny.yaml", set=FEW, callbacks=[hook()])


def test_lines_of_another_training_are_left_alone(here):
    train("tiny.yaml", set=FEW, seed=2, callbacks=[JsonlCallback("t.jsonl")])
    kept = (here / "t.jsonl").read_text()
    train("tiny.yaml", set=FEW, output="t.npz", callbacks=[stop_after(8)])
    with pytest.raises(
        FireworldError, match=r"t\.jsonl: expected the lines of this training, got those of another one"
    ):
        train("tiny.yaml", set=FEW, output="t.npz", resume=True, callbacks=[JsonlCallback("t.jsonl")])
    assert (here / "t.jsonl").read_text() == kept
