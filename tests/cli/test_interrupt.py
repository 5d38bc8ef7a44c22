"""Ctrl-C and kill: a recording ends with the last step done, whatever happens and wherever it happens."""

from __future__ import annotations

import json
import signal
import subprocess
import sys

import pytest
from fireworld_recorder.reader import open_log
from fireworld_recorder.writer import StepFile

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("policies_file")]

RECORD = ("run", "quick", "--record", "a.mcap", "--policy")


def test_ctrl_c_ends_the_recording_at_the_step_under_way(here, fireworld, fireworld_process, files):
    done = fireworld_process(*RECORD, "policies:Interrupted", "--json")
    assert done.code == 130
    outcome = json.loads(done.out)
    assert (outcome["ended"], outcome["steps"]) == ("interrupted", 5)
    assert files() == ["a.mcap"]
    info = json.loads(fireworld("info", "a.mcap", "--json").out)
    assert (info["state"], info["steps"]["last"], info["digest"]) == ("complete", 5, outcome["digest"])
    assert info["ending"] == "stopped before its end"
    assert fireworld("verify", "a.mcap").code == 0


def test_ctrl_c_without_a_recording(here, fireworld_process, files):
    done = fireworld_process("run", "quick", "--policy", "policies:Interrupted")
    assert done.code == 130
    assert "interrupted after step 5" in done.err
    assert "Traceback" not in done.err
    assert files() == []


def test_a_second_ctrl_c_stops_at_once(here, fireworld, fireworld_process, files):
    done = fireworld_process(*RECORD, "policies:InterruptedTwice")
    assert done.code == 130
    assert done.err == "interrupted within a step; steps 0 to 4 are kept in a.mcap.partial\n"
    assert files() == ["a.mcap.partial"]
    assert fireworld("recover", "a.mcap.partial", "-o", "b.mcap").code == 0
    assert open_log(here / "b.mcap").steps.tolist() == [0, 1, 2, 3, 4]


@pytest.mark.parametrize("moment", ["before", "after"])
def test_ctrl_c_while_a_step_is_written(here, fireworld, files, monkeypatch, moment):
    """The writer is in the middle of a step when the signal comes: the step is finished, the recording whole."""
    commit = StepFile.commit

    def interrupted_commit(self, step, messages):
        if step == 7 and moment == "before":
            signal.raise_signal(signal.SIGINT)
        commit(self, step, messages)
        if step == 7 and moment == "after":
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(StepFile, "commit", interrupted_commit)
    monkeypatch.setattr(signal, "getsignal", lambda _: signal.default_int_handler)
    done = fireworld(*RECORD, "policies:Near")
    assert done.code == 130
    assert files() == ["a.mcap"]
    assert open_log(here / "a.mcap").steps.tolist() == list(range(8))


def test_the_handler_is_taken_back(here, fireworld):
    before = signal.getsignal(signal.SIGINT)
    assert fireworld(*RECORD, "policies:Near", "--steps", 3).code == 0
    assert signal.getsignal(signal.SIGINT) is before


def test_a_killed_run_loses_the_step_under_way_and_no_more(here, fireworld, fireworld_process, files):
    assert fireworld_process(*RECORD, "policies:Killed").code == -signal.SIGKILL
    assert files() == ["a.mcap.partial"]
    info = fireworld("info", "a.mcap.partial", "--json")
    assert info.code == 1
    assert json.loads(info.out)["steps"]["last"] == 4
    again = fireworld(*RECORD, "policies:Near")
    assert again.code == 2
    assert "try `fireworld recover` to keep its steps, or --force to replace it" in again.err
    recovered = fireworld("recover", "a.mcap.partial", "-o", "b.mcap")
    assert recovered.code == 0
    assert "5 steps, up to step 4" in recovered.out
    assert fireworld("info", "b.mcap").code == 0
    assert fireworld("verify", "b.mcap").code == 0
    assert fireworld(*RECORD, "policies:Near", "--force", "--steps", 4).code == 0
    assert fireworld("diff", "a.mcap", "b.mcap").code == 1, "one ended there, the other was cut off"
    assert files() == ["a.mcap", "b.mcap"]


def test_ctrl_c_that_others_made_something_else_of(here, fireworld, monkeypatch):
    """Compiled code and libraries under import raise their own errors when it comes at the wrong moment."""

    def wrapped(*_, **__):
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    monkeypatch.setattr("fireworld.scenario.load_scenario", wrapped)
    done = fireworld("run", "quick")
    assert (done.code, done.err) == (130, "interrupted\n")


BEFORE = """
import signal, sys
sys.addaudithook(lambda event, names: event == "import" and names[0] == "click" and signal.raise_signal(signal.SIGINT))
from fireworld.__main__ import main
main()
"""


def test_ctrl_c_before_there_is_a_command_line():
    done = subprocess.run([sys.executable, "-c", BEFORE], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "interrupted\n")


LOST = """
import signal, sys, time
from fireworld.cli import _say_what_is_ignored
_say_what_is_ignored()
class Finalized:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)
        for _ in range(1000):
            pass
try:
    Finalized()
    time.sleep(20)
except KeyboardInterrupt:
    sys.exit(130)
"""


def test_ctrl_c_within_a_finalizer_is_not_lost():
    done = subprocess.run([sys.executable, "-c", LOST], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "")


@pytest.mark.parametrize("event", ["os.mkdir", "open", "os.rename"])
def test_ctrl_c_while_a_file_is_written_leaves_no_scratch_folder(tmp_path, event):
    seen = subprocess.run([sys.executable, "-c", WRITING, event], cwd=tmp_path, check=False).returncode
    assert seen == 130
    assert [path.name for path in tmp_path.iterdir()] == ["policies.py"]


WRITING = """
import signal, sys
from pathlib import Path
from fireworld.files import write_file
def note(event, arguments):
    global left
    if event == sys.argv[1] and left:
        left = False
        signal.raise_signal(signal.SIGINT)
left = True
sys.addaudithook(note)
try:
    write_file(Path("a.txt"), b"a")
except KeyboardInterrupt:
    sys.exit(130)
"""


@pytest.mark.parametrize(("last", "code"), [("", -signal.SIGINT), ("no_more()", 130)])
def test_ctrl_c_while_text_is_executed_ends_in_an_exit_code_too(here, last, code):
    lines = ("try: exec('raise KeyboardInterrupt')", "except KeyboardInterrupt: pass", last, "sys.exit(130)")
    program = "\n".join(("import sys", "from fireworld.interrupt import no_more", *lines))
    (here / "program.py").write_text(program)
    assert subprocess.run([sys.executable, "-m", "program"], cwd=here, check=False).returncode == code


def test_ctrl_c_while_python_ends_changes_no_exit_code(here):
    lines = (
        "import atexit, os, signal, sys",
        "from fireworld.interrupt import no_more",
        "atexit.register(lambda: [os.kill(os.getpid(), one) for one in (signal.SIGINT, signal.SIGTERM)])",
        "no_more()",
        "sys.exit(1)",
    )
    (here / "program.py").write_text("\n".join(lines))
    done = subprocess.run([sys.executable, "-m", "program"], cwd=here, check=False, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (1, "")
