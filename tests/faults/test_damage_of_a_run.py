"""A recorded run is cut or altered anywhere: what is rescued of it still replays to the same."""

import random

import pytest
from fireworld_recorder.diff import compare
from fireworld_recorder.reader import open_log
from fireworld_recorder.recover import recover
from fireworld_recorder.writer import LogWriter

from fireworld.errors import LogError
from fireworld.policy.names import find_policy
from fireworld.recording.replay import Replay
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario
from fireworld.simulation.prepared_run import prepare_run

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def clean_logs(tmp_path_factory):
    """The bytes of the logs of one run that ended after 0, 1, ... 8 steps, as if it had been stopped there."""
    run = prepare_run(build_scenario(load_scenario("quick")), find_policy("chief"), seed=1, n_steps_max=8)
    records = list(run)
    folder = tmp_path_factory.mktemp("clean")
    for n in range(1, len(records) + 1):
        with LogWriter(folder / f"{n}.mcap", run.header, run.city) as log:
            for record in records[:n]:
                log.write(record)
    return [(folder / f"{n}.mcap").read_bytes() for n in range(1, len(records) + 1)]


def rescue(folder, data, clean_logs):
    """Write a damaged log and recover it; return how many steps were rescued, all of them as they were."""
    path, output = folder / "damaged.mcap", folder / "good.mcap"
    path.write_bytes(data)
    n_steps, complaint = 0, f"{path}: "
    try:
        n_steps = recover(path, output, force=True).n_steps
    except LogError as error:
        complaint = str(error)
    assert complaint.startswith(f"{path}: ")
    if not n_steps:
        return 0
    assert output.read_bytes() == clean_logs[n_steps - 1]
    return n_steps


def test_every_cut_and_every_altered_byte_leaves_a_log_that_replays(tmp_path, clean_logs):
    generator = random.Random(3)
    whole = clean_logs[-1]
    rescued = set()
    for _ in range(100):
        rescued.add(rescue(tmp_path, whole[: generator.randrange(len(whole))], clean_logs))
        altered = bytearray(whole)
        altered[generator.randrange(len(whole))] ^= 1 << generator.randrange(8)
        rescued.add(rescue(tmp_path, bytes(altered), clean_logs))
    assert {0, 9} <= rescued
    assert len(rescued) > 7, "the damage fell into many different steps"


@pytest.mark.parametrize("n_steps", [1, 5, 9])
def test_what_is_rescued_replays_to_the_same(tmp_path, clean_logs, n_steps):
    assert rescue(tmp_path, clean_logs[n_steps - 1][:-1], clean_logs) == n_steps
    log = open_log(tmp_path / "good.mcap")
    assert compare(log, Replay(log)).same
