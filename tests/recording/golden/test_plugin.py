"""The pytest plugin: fixture, update, failures, options; and that it costs others nothing."""

from __future__ import annotations

import subprocess
import sys

import pytest
from fireworld_recorder.reader import open_log

from fireworld.pytest_plugin import NAME_MAX, golden_name
from fireworld.recording.golden.check import check_golden
from fireworld.recording.golden.find import find_goldens
from fireworld.recording.golden.spec import GoldenSpec, prepare_golden, spec_of
from fireworld.recording.golden.store import store_golden
from fireworld.recording.golden.update import add_golden
from fireworld.recording.record import run_prepared
from tests.recording.golden.conftest import POLICY

pytestmark = pytest.mark.slow

UPDATE = "--fireworld-update"
ONE = """
def test_policy(recording):
    recording(scenario="quick", policy="mine:Policy", seed=3, steps=5)
"""


def run(project, *words, outcome):
    """Run the tests of the project and check how they went; return what was printed."""
    result = project.runpytest_inprocess(*words)
    result.assert_outcomes(**outcome)
    assert "Traceback" not in result.stdout.str()
    return result.stdout


def change_policy(project, action):
    """Let the policy choose another action; a file of another time, so that no compiled one is taken for it."""
    project.makepyfile(mine=POLICY.replace("NEAREST_TO_ME", action))
    for compiled in project.path.rglob("mine*.pyc"):
        compiled.unlink()


def test_a_missing_golden_fails_and_says_how_to_store_it(project):
    project.makepyfile(test_mine=ONE)
    out = run(project, outcome={"failed": 1})
    missing = (
        "recordings/test_mine-test_policy.mcap: there is no such recording; run with --fireworld-update to store it"
    )
    out.fnmatch_lines([missing])
    assert not (project.path / "recordings").exists()


def test_stored_and_the_same_then_changed_then_updated(project):
    project.makepyfile(test_mine=ONE)
    out = run(project, UPDATE, outcome={"passed": 1})
    out.fnmatch_lines(["*fireworld: 1 recordings stored*", "recordings/test_mine-test_policy.mcap"])
    log = open_log(project.path / "recordings" / "test_mine-test_policy.mcap")
    assert (log.header.policy, log.header.seed, len(log)) == ("mine:Policy", 3, 6)
    assert (project.path / "recordings" / "test_mine-test_policy.txt").is_file()
    run(project, outcome={"passed": 1})

    change_policy(project, "EASIEST")
    out = run(project, outcome={"failed": 1})
    out.fnmatch_lines(
        [
            "policy changed; step 1, choose: brigade 0 chose easiest, was nearest-to-me",
            "recordings/test_mine-test_policy.mcap: the run is not the same any more",
            "  changed: policy: mine:Policy, digest *, was *; scenario, seed and simulator are the same",
            "  return: *, was *",
            "the new run: *test_mine-test_policy.mcap; *",
            "if that is meant, run with --fireworld-update",
        ]
    )
    assert "pytest_plugin.py" not in out.str()
    (line,) = [line for line in out.lines if line.startswith("the new run: ")]
    assert len(open_log(line.removeprefix("the new run: ").partition(";")[0])) == 6

    run(project, UPDATE, outcome={"passed": 1})
    run(project, outcome={"passed": 1})


def test_update_leaves_what_is_the_same(project):
    project.makepyfile(test_mine=ONE)
    run(project, UPDATE, outcome={"passed": 1})
    path = project.path / "recordings" / "test_mine-test_policy.mcap"
    before = path.stat().st_mtime_ns
    out = run(project, UPDATE, outcome={"passed": 1})
    assert path.stat().st_mtime_ns == before
    assert "stored" not in out.str()
    path.write_bytes(b"damaged")
    run(project, outcome={"failed": 1}).fnmatch_lines(["*test_mine-test_policy.mcap*"])
    run(project, UPDATE, outcome={"passed": 1}).fnmatch_lines(["*1 recordings stored*"])
    run(project, outcome={"passed": 1})


def test_policies_as_classes_and_objects(project):
    project.makepyfile(
        test_mine="""
        import pytest
        from mine import Policy

        @pytest.mark.parametrize("policy", [Policy, Policy()], ids=["class", "object"])
        def test_policy(recording, policy):
            run = recording(scenario="quick", policy=policy, steps=4)
            assert run.column("score", "n_burnt_out").tolist() == [0] * 5
            assert run.header.policy == "mine:Policy"
        """
    )
    run(project, UPDATE, outcome={"passed": 2})
    run(project, outcome={"passed": 2})
    change_policy(project, "EASIEST")
    run(project, outcome={"failed": 2})


def test_goldens_of_tests_can_be_checked_by_the_command_too(project):
    project.makepyfile(test_mine=ONE)
    run(project, UPDATE, outcome={"passed": 1})
    (path,) = find_goldens(project.path / "recordings")
    assert check_golden(path).result == "same"


def test_options(project):
    """Overrides, tolerances, and what is ignored, reach the run, the comparison and the golden."""
    test = """
        def test_policy(recording):
            run = recording(
                scenario="quick", policy="mine:Policy", steps=4, seed={seed},
                overrides={{"brigades.n": 3, "choices": "simultaneous"}},
                tolerances={{"energy": 1e-6}}, ignore={ignore},
            )
            assert len(run.city.brigade_tank_litres) == 3
        """
    everything = [
        "draws",
        "observations",
        "decisions",
        "brigades",
        "buildings",
        "civilians",
        "rewards",
        "score",
        "events",
    ]
    project.makepyfile(test_mine=test.format(seed=1, ignore=[]))
    run(project, UPDATE, outcome={"passed": 1})
    log = open_log(project.path / "recordings" / "test_mine-test_policy.mcap")
    order = spec_of(log.header)
    assert order.settings == {"brigades.n": "3", "choices": "simultaneous"}
    assert order.tolerances == {"energy": 1e-6}
    project.makepyfile(test_mine=test.format(seed=2, ignore=[]))
    run(project, outcome={"failed": 1}).fnmatch_lines(
        ["seed changed; step 0, draw: the runs have different random draws*"]
    )
    project.makepyfile(test_mine=test.format(seed=2, ignore=everything))
    run(project, outcome={"passed": 1})


def test_a_training(project):
    test = """
        def test_it_learns(recording):
            log = recording.training("quick", set={{"n_episodes_max": 3, "alpha": {alpha}}}, seed=2)
            assert len(log) == 3
            assert log.team().tables.shape == (2, 4320, 4)
        """
    project.makepyfile(test_mine=test.format(alpha=0.7))
    run(project, outcome={"failed": 1}).fnmatch_lines(["recordings/test_mine-test_it_learns.mcap: there is no such *"])
    run(project, UPDATE, outcome={"passed": 1}).fnmatch_lines(["*fireworld: 1 recordings stored*"])
    run(project, outcome={"passed": 1})
    (path,) = find_goldens(project.path / "recordings")
    assert check_golden(path).result == "same"

    project.makepyfile(test_mine=test.format(alpha=0.6))
    out = run(project, outcome={"failed": 1})
    out.fnmatch_lines(
        [
            "method changed; quick, episode 0, step *, brigade * in state *: learned value of *",
            "recordings/test_mine-test_it_learns.mcap: the training is not the same any more",
            "  changed: method: alpha: 0.6, was 0.7; curriculum, seed and simulator are the same",
            "the new training: *test_mine-test_it_learns.mcap; *",
        ]
    )
    run(project, UPDATE, outcome={"passed": 1})
    run(project, outcome={"passed": 1})


@pytest.mark.parametrize(
    ("call", "complaint"),
    [
        ('"quack"', "quack: expected a curriculum file*"),
        ('"quick", method="magic"', "--method: expected one of*"),
        ('"quick", set={"beta": 1}', "--set: beta: expected one of*"),
        ('"quick", stages="later"', "--stages: expected stages of quick*"),
    ],
)
def test_mistakes_of_trainings_fail_in_a_line(project, call, complaint):
    project.makepyfile(test_mine=f"def test_it(recording):\n    recording.training({call})\n")
    run(project, UPDATE, outcome={"failed": 1}).fnmatch_lines([complaint])
    assert not (project.path / "recordings").exists()


def test_two_recordings_in_a_test_need_names(project):
    project.makepyfile(
        test_mine="""
        def test_named(recording):
            recording(scenario="quick", policy="mine:Policy", steps=2)
            recording(scenario="quick", policy="mine:Policy", steps=3, name="longer")

        def test_nameless(recording):
            recording(scenario="quick", policy="mine:Policy", steps=2)
            recording(scenario="quick", policy="mine:Policy", steps=3)
        """
    )
    out = run(project, UPDATE, outcome={"passed": 1, "failed": 1})
    out.fnmatch_lines(["recording: a second one in a test needs a name of its own*"])
    names = [path.stem for path in find_goldens(project.path / "recordings")]
    assert names == ["test_mine-test_named", "test_mine-test_named-longer", "test_mine-test_nameless"]


def test_the_folder_is_a_setting(project):
    project.makeini("[pytest]\nfireworld_recordings = kept/golden\n")
    project.mkpydir("inner")
    (project.path / "inner" / "test_mine.py").write_text(ONE)
    run(project, UPDATE, outcome={"passed": 1})
    assert [path.stem for path in find_goldens(project.path / "inner" / "kept" / "golden")] == ["test_mine-test_policy"]


@pytest.mark.parametrize(
    ("call", "complaint"),
    [
        ('scenario="quack", policy="mine:Policy"', "scenario: expected the name of a scenario*"),
        ('scenario="quick", policy="mine:Nobody"', "--policy: mine: expected a class of that name*"),
        ('scenario="quick", policy=3', "policy: expected a policy with a method decide*"),
        ('scenario="quick", policy=type("P", (), {"__init__": lambda self: 1 / 0})', "policy: *: cannot be made: *"),
        ('scenario="quick", policy="mine:Policy", overrides={"brigades.m": 1}', "*brigades.m*"),
        ('scenario="quick", policy="mine:Policy", steps=2, ignore=["nothing"]', "ignore: expected a field*"),
        ('scenario="quick", policy="mine:Failing", steps=2', "policy mine:Failing: step 1, brigade 0: KeyError*"),
    ],
)
def test_mistakes_fail_in_a_line(project, call, complaint):
    failing = POLICY + "\nclass Failing:\n    def decide(self, observation):\n        return {}['a']\n"
    project.makepyfile(mine=failing, test_mine=ONE.partition("    rec")[0] + f"    recording({call})\n")
    (project.path / "recordings").mkdir()
    good = run_prepared(prepare_golden(GoldenSpec(scenario="quick", policy="random", steps=2), project.path))
    store_golden(project.path / "recordings" / "test_mine-test_policy.mcap", good)
    out = run(project, outcome={"failed": 1})
    out.fnmatch_lines([complaint])
    assert "pytest_plugin.py" not in out.str()


def test_names_of_goldens(project):
    items = project.getitems(
        """
        import pytest

        class TestTeam:
            def test_it(self): ...

        @pytest.mark.parametrize("word", ["a-b", "a/b", "a b", "x" * 500])
        def test_word(word): ...
        """
    )
    first, *names = [golden_name(item).partition("-")[2] for item in items]
    assert first == "TestTeam.test_it"
    assert golden_name(items[0], "second").endswith("TestTeam.test_it-second")
    assert names[0] == "test_word-a-b"
    assert [name[:-6] for name in names[1:3]] == ["test_word-a_b-", "test_word-a_b-"]
    assert len({*names}) == 4
    assert max(map(len, names)) < NAME_MAX + 10


def test_with_workers(project):
    """Goldens are stored by workers, which are processes of their own, and told of by the one that people see."""
    project.makepyfile(
        test_mine="""
        import pytest

        @pytest.mark.parametrize("seed", range(2))
        def test_policy(recording, seed):
            recording(scenario="quick", policy="mine:Policy", steps=2, seed=seed)
        """
    )
    words = (sys.executable, "-m", "pytest", "-n", "1")
    first = subprocess.run([*words, UPDATE], cwd=project.path, capture_output=True, text=True, check=False)
    assert first.returncode == 0, first.stdout
    assert "fireworld: 2 recordings stored" in first.stdout
    assert len(find_goldens(project.path / "recordings")) == 2


def test_it_imports_nothing_before_a_test_asks():
    script = (
        "import sys, pytest; before = {*sys.modules}; import fireworld.pytest_plugin; print(*{*sys.modules} - before)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) == {"fireworld", "fireworld.version", "fireworld.pytest_plugin"}


def test_pytest_finds_it(pytestconfig):
    """Installed with fireworld, not only imported by these tests."""
    assert pytestconfig.pluginmanager.get_plugin("fireworld").__name__ == "fireworld.pytest_plugin"


def test_a_policy_that_changes_its_world_fails_and_is_not_stored(project):
    project.makepyfile(test_mine=ONE)
    line = "        return Decision(Action.NEAREST_TO_ME)"
    assert line in POLICY
    project.makepyfile(mine=POLICY.replace(line, f"        observation.world.fire.energy.base[:] = 0.0\n{line}"))
    out = run(project, UPDATE, outcome={"failed": 1})
    out.fnmatch_lines(["*policy mine:Policy: seed 3: expected decisions that lead to its outcome by themselves, *"])
    assert not (project.path / "recordings").exists()


def test_recordings_of_renamed_tests_are_listed_and_removed(project):
    project.makepyfile(test_mine=ONE, test_other=ONE.replace("test_policy", "test_else"))
    run(project, UPDATE, outcome={"passed": 2})
    other = 'def test_other(recording):\n    recording(scenario="quick", policy="mine:Policy", steps=3)\n'
    project.makepyfile(test_mine=other)
    run(project, UPDATE, "test_mine.py::test_other", outcome={"passed": 1})
    out = run(project, "test_mine.py", outcome={"passed": 1})
    out.fnmatch_lines(["*fireworld: 1 recordings that no test uses; --fireworld-update removes them*"])
    out.fnmatch_lines(["recordings/test_mine-test_policy.mcap"])
    for words in (["test_mine.py::test_other"], ["test_mine.py", "-k", "test_other"], ["test_mine.py", "-x"]):
        out = run(project, *words, UPDATE, outcome={"passed": 1})
        out.no_fnmatch_line("*no test uses*")
    out = run(project, "test_mine.py", UPDATE, outcome={"passed": 1})
    out.fnmatch_lines(["*fireworld: 1 recordings removed, which no test uses*"])
    left = sorted(path.name for path in (project.path / "recordings").iterdir())
    assert left == [
        f"{name}{end}" for name in ("test_mine-test_other", "test_other-test_else") for end in (".mcap", ".txt")
    ]


def names_in(project):
    """The files of the folder of recordings."""
    return sorted(path.name for path in (project.path / "recordings").iterdir())


def test_digests_only(project):
    """By the setting, and by the argument; a recording and a digest take each other's place."""
    project.makepyfile(test_mine=ONE)
    run(project, UPDATE, outcome={"passed": 1})
    project.makeini("[pytest]\nfireworld_digest_only = true\n")
    run(project, outcome={"passed": 1})
    run(project, UPDATE, outcome={"passed": 1}).fnmatch_lines(["recordings/test_mine-test_policy.digest"])
    assert names_in(project) == ["test_mine-test_policy.digest"]
    run(project, outcome={"passed": 1})
    assert check_golden(project.path / "recordings" / "test_mine-test_policy.digest").result == "same"
    sys.modules.pop("mine")
    change_policy(project, "EASIEST")
    out = run(project, outcome={"failed": 1})
    out.fnmatch_lines(
        [
            "policy changed; step 1, choose: brigade 0 chose easiest, was nearest-to-me",
            "recordings/test_mine-test_policy.digest: the run is not the same any more",
            "the new run: *test_mine-test_policy.mcap",
        ]
    )
    project.makepyfile(test_mine=ONE.replace("steps=5", "steps=5, digest_only=False"))
    run(project, UPDATE, outcome={"passed": 1})
    assert names_in(project) == ["test_mine-test_policy.mcap", "test_mine-test_policy.txt"]
    project.makepyfile(test_mine=ONE.replace("steps=5", "steps=5, ignore=['draws']"))
    run(project, UPDATE, outcome={"failed": 1}).fnmatch_lines(["digest-only golden: expected no tolerances*"])


def test_recordings_that_no_test_made_are_never_removed(project):
    """Such as those of `fireworld golden add`, whatever their names are."""
    project.makepyfile(test_mine=ONE)
    run(project, UPDATE, outcome={"passed": 1})
    add_golden("quick", policy="random", steps=2, name="test_mine-added", folder=project.path / "recordings")
    add_golden(
        "quick", policy="random", steps=2, name="test_mine-too", folder=project.path / "recordings", digest_only=True
    )
    before = names_in(project)
    run(project, UPDATE, outcome={"passed": 1}).no_fnmatch_line("*no test uses*")
    assert names_in(project) == before


def test_recordings_of_files_that_are_gone(project):
    """Only a run of all tests tells: not one of a file."""
    project.makeini("[pytest]\nfireworld_digest_only = true\n")
    project.makepyfile(test_mine=ONE, test_other=ONE.replace("test_policy", "test_else"))
    run(project, UPDATE, outcome={"passed": 2})
    (project.path / "test_other.py").unlink()
    run(project, "test_mine.py", outcome={"passed": 1}).no_fnmatch_line("*no test uses*")
    out = run(project, outcome={"passed": 1})
    out.fnmatch_lines(["*fireworld: 1 recordings that no test uses*", "recordings/test_other-test_else.digest"])
    run(project, UPDATE, outcome={"passed": 1})
    assert names_in(project) == ["test_mine-test_policy.digest"]


def test_a_file_that_uses_none_any_more(project):
    project.makepyfile(test_mine=ONE)
    run(project, UPDATE, outcome={"passed": 1})
    project.makepyfile(test_mine="def test_nothing(): ...")
    run(project, outcome={"passed": 1}).fnmatch_lines(["recordings/test_mine-test_policy.mcap"])


def test_a_run_that_is_broken_off_removes_nothing(project):
    project.makepyfile(test_mine=ONE + "\n\n" + ONE.replace("test_policy", "test_then"))
    run(project, UPDATE, outcome={"passed": 2})
    before = names_in(project)
    broken = 'import pytest\ndef test_ends():\n    pytest.exit("enough", returncode=0)\n'
    project.makepyfile(test_mine=ONE + broken + ONE.replace("test_policy", "test_then"))
    result = project.runpytest_inprocess(UPDATE)
    assert result.ret == 0
    result.stdout.no_fnmatch_line("*no test uses*")
    assert names_in(project) == before


def test_update_keeps_a_recording_of_before_tests_were_named(project):
    project.makepyfile(test_mine=ONE)
    (project.path / "recordings").mkdir()
    path = project.path / "recordings" / "test_mine-test_policy.mcap"
    spec = GoldenSpec(scenario="quick", policy="mine:Policy", seed=3, steps=5)
    store_golden(path, run_prepared(prepare_golden(spec, path.parent)))
    run(project, UPDATE, outcome={"passed": 1}).no_fnmatch_line("*stored*")


@pytest.mark.parametrize("words", [(), ("-n", "1")])
def test_keep_summary_and_annotations(project, words):
    """The files of all that differs land in one folder; the summary says the cause first, annotations mark the test."""
    project.mkpydir("inner")
    broken = 'def test_broken(recording):\n    recording(scenario="quack", policy="mine:Policy")\n'
    project.makepyfile(test_mine=ONE, test_broken=broken)
    (project.path / "inner" / "test_inner.py").write_text(ONE)
    options = ("--fireworld-keep", "new", "--fireworld-summary", "new/summary.md", "--fireworld-annotate", "github")
    command = (sys.executable, "-m", "pytest", *words)
    for more in ((UPDATE,), options):
        done = subprocess.run([*command, *more], cwd=project.path, capture_output=True, text=True, check=False)
        assert done.returncode == 1
        change_policy(project, "EASIEST")
    new = project.path / "new"
    ends = (".html", ".mcap", ".png", "-difference.html")
    assert {path.name for path in new.iterdir()} == {
        "inner", "summary.md", *(f"test_mine-test_policy{end}" for end in ends)
    }  # fmt: skip
    assert {path.name for path in (new / "inner").iterdir()} == {f"test_inner-test_policy{end}" for end in ends}
    summary = (new / "summary.md").read_text()
    assert summary.startswith(
        "## recordings of tests: 1 failed otherwise, 2 different\n\n### test\\_broken.py::test\\_broken\n"
    )
    assert "**changed: policy: mine:Policy, digest " in summary
    assert "](inner/test_inner-test_policy.html)" in summary
    assert "](test_mine-test_policy.png)" in summary
    told = [line for line in done.stdout.splitlines() if line.startswith("::")]
    assert len(told) == 3
    assert any(
        line.startswith(
            "::error file=inner/test_inner.py,line=2,title=inner/test_inner.py%3A%3Atest_policy::policy changed; step 1"
        )
        for line in told
    )


def test_nothing_to_say(project):
    project.makepyfile(test_mine=ONE)
    run(project, UPDATE, outcome={"passed": 1})
    out = run(project, "--fireworld-summary=s.md", "--fireworld-annotate=github", outcome={"passed": 1})
    out.no_fnmatch_line("::*")
    assert (project.path / "s.md").read_text() == "## recordings of tests: 1 the same\n"
    assert not (project.path / "s-files").exists()


def test_what_else_failed_is_in_the_summary(project):
    project.makepyfile(test_mine=ONE + "    assert 1 == 2, 'no'\n", test_gone="import no_such_module")
    project.runpytest_inprocess(UPDATE, "--continue-on-collection-errors")
    words = ("--fireworld-summary=s.md", "--fireworld-annotate=github", "--continue-on-collection-errors")
    result = project.runpytest_inprocess(*words)
    result.assert_outcomes(failed=1, errors=1)
    lines = [line for line in result.outlines if line.startswith("::")]
    assert lines == [
        "::error file=test_gone.py,line=1,title=test_gone.py::ModuleNotFoundError: No module named 'no_such_module'",
        "::error file=test_mine.py,line=1,title=test_mine.py%3A%3Atest_policy::AssertionError: no",
    ]
    assert (project.path / "s.md").read_text().startswith("## recordings of tests: 2 failed otherwise, 1 the same\n")
