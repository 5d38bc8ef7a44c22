"""Policies that misbehave, each in its own way; a campaign copies this file beside its cases.

`right` says what must come of one. "refused": a line and exit code 2, whatever the command. "harmless": as if it had
behaved. "cheat": refused where something is judged, in `compare` and goldens; its own run may go through. "either".

Left out, because no program that runs a policy within itself can survive them: `os._exit`, signals that it sends to its
own process, `ctypes` on any address. They are as good as pulling the plug; SECURITY.md says that policies are programs.
"""

import asyncio
import decimal
import gc
import locale
import os
import random
import shutil
import sys
import threading
import time
import warnings

import numpy as np

from fireworld.policy.protocol import Action, Decision


class Good:
    """Without a fault: others differ from it in one way."""

    right = "harmless"

    def decide(self, observation):
        self.misbehave(observation)
        return self.answer(observation)

    def misbehave(self, observation):
        pass

    def answer(self, observation):
        return Decision(Action.EASIEST)


class Refused(Good):
    right = "refused"


class Harmless(Good):
    pass


def _raising(name, make):
    """Make a policy that raises what `make` makes."""

    def misbehave(self, observation):
        raise make()

    return type(name, (Refused,), {"misbehave": misbehave, "__module__": __name__})


def _answering(name, make):
    """Make a policy that answers with what `make` makes."""
    return type(name, (Refused,), {"answer": lambda self, observation: make(), "__module__": __name__})


class OwnBase(BaseException):
    pass


class Mute(Exception):
    def __str__(self):
        raise RuntimeError("no text")

    __repr__ = __str__


class MuteExits(Exception):
    def __str__(self):
        sys.exit(0)


class NoWords:
    def __repr__(self):
        raise OwnBase("no words")


class Index:
    """Something that is no number, but says so in odd ways."""

    def __init__(self, error):
        self.error = error

    def __index__(self):
        raise self.error

    __float__ = __bool__ = __iter__ = __len__ = __index__


def _error_of(module, name, *arguments):
    """Make an error of a library, as a policy's own calls may raise it."""
    return lambda: getattr(__import__(module, fromlist=[name]), name)(*arguments)


def _chained():
    error = ValueError("the first")
    for number in range(500):
        following = ValueError(f"error {number}")
        following.__cause__ = error
        error = following
    return error


def _endless():
    while True:
        yield 1.0


RAISED = {
    "RaisesExit": lambda: SystemExit(0),
    "RaisesExitText": lambda: SystemExit("done"),
    "RaisesExitOne": lambda: SystemExit(1),
    "RaisesExitThree": lambda: SystemExit(3),
    "RaisesBase": lambda: OwnBase("base"),
    "RaisesGeneratorExit": GeneratorExit,
    "RaisesStopIteration": StopIteration,
    "RaisesCancelled": asyncio.CancelledError,
    "RaisesMute": Mute,
    "RaisesMuteExits": MuteExits,
    "RaisesMarkup": lambda: ValueError("[/x] [red]\x1b[31mred\x07"),
    "RaisesLines": lambda: ValueError("one\ntwo\r\nthree\u2028four"),
    "RaisesSurrogate": lambda: ValueError("\ud800"),
    "RaisesHugeText": lambda: ValueError("x" * 10**7),
    "RaisesArray": lambda: ValueError(np.zeros(10**6)),
    "RaisesBrokenPipe": lambda: BrokenPipeError(32, "Broken pipe"),
    "RaisesNoSpace": lambda: OSError(28, "No space left on device"),
    "RaisesNotFound": lambda: FileNotFoundError(2, "No such file", "model.pt"),
    "RaisesMemory": MemoryError,
    "RaisesImport": lambda: ModuleNotFoundError("No module named 'torch'", name="torch"),
    "RaisesSyntax": lambda: SyntaxError("odd", ("x.py", 3, 1, "text\x1b[2J")),
    "RaisesAssertion": AssertionError,
    "RaisesUnicode": lambda: UnicodeDecodeError("utf-8", b"\xff", 0, 1, "odd"),
    "RaisesKey": lambda: KeyError("\x1b]0;title\x07"),
    "RaisesGroup": lambda: BaseExceptionGroup("many", [OwnBase(), SystemExit(0)]),
    "RaisesChain": _chained,
    "RaisesClickExit": _error_of("click.exceptions", "Exit", 0),
    "RaisesClickAbort": _error_of("click", "Abort"),
    "RaisesUsageError": _error_of("click", "UsageError", "no such option"),
    "RaisesFullOutput": _error_of("fireworld.stdout", "StandardOutputError", "full"),
    "RaisesOurs": _error_of("fireworld.errors", "PolicyError", "of its own"),
    "RaisesLogError": _error_of("fireworld.errors", "LogError", "a.mcap: of its own"),
    "RaisesTimeout": TimeoutError,
    "RaisesRecursion": lambda: RecursionError("deep"),
}
ANSWERED = {
    "AnswersNone": lambda: None,
    "AnswersMinusOne": lambda: -1,
    "AnswersFive": lambda: 5,
    "AnswersHuge": lambda: 2**70,
    "AnswersFloat": lambda: 1.0,
    "AnswersNaN": lambda: float("nan"),
    "AnswersTrue": lambda: True,
    "AnswersBytes": lambda: b"easiest",
    "AnswersText": lambda: "easyest",
    "AnswersMarkup": lambda: "[/x]\x1b[31m",
    "AnswersHugeText": lambda: "x" * 10**7,
    "AnswersSurrogate": lambda: "\ud800",
    "AnswersArray": lambda: np.array([0, 1]),
    "AnswersFloatScalar": lambda: np.float32(1),
    "AnswersAType": lambda: Decision,
    "AnswersNoWords": NoWords,
    "AnswersIndexExits": lambda: Index(SystemExit(0)),
    "AnswersIndexBase": lambda: Index(OwnBase()),
    "AnswersGenerator": _endless,
    "AnswersAFuture": lambda: asyncio.sleep(0) if False else asyncio.Future(loop=asyncio.new_event_loop()),
    "DecidesNothing": lambda: Decision(None),
    "DecidesNoTarget": lambda: Decision(Action.OWN_TARGET),
    "DecidesWrongTarget": lambda: Decision(Action.OWN_TARGET, target=10**9),
    "DecidesMinusTarget": lambda: Decision(Action.OWN_TARGET, target=-1),
    "DecidesTextTarget": lambda: Decision(Action.OWN_TARGET, target="0"),
    "ValuesNeverEnd": lambda: Decision(0, q_values=_endless()),
    "ValuesTooMany": lambda: Decision(0, q_values=[0.0] * 10**6),
    "ValuesTooFew": lambda: Decision(0, q_values=[0.0]),
    "ValuesTexts": lambda: Decision(0, q_values=["a", "b", "c", "d"]),
    "ValuesHuge": lambda: Decision(0, q_values=[10**400] * 4),
    "ValuesExit": lambda: Decision(0, q_values=Index(SystemExit(0))),
    "ValuesNested": lambda: Decision(0, q_values=np.zeros((4, 4))),
    "ValuesComplex": lambda: Decision(0, q_values=[1j] * 4),
    "EpsilonHuge": lambda: Decision(0, epsilon=10**400),
    "EpsilonText": lambda: Decision(0, epsilon="much"),
    "EpsilonNone": lambda: Decision(0, epsilon=None),
    "EpsilonRaises": lambda: Decision(0, epsilon=Index(RuntimeError())),
    "ExploredArray": lambda: Decision(0, explored=np.array([1, 2])),
    "ExploredExits": lambda: Decision(0, explored=Index(SystemExit(0))),
    "ValueArray": lambda: Decision(0, value=np.zeros(3)),
    "ValueText": lambda: Decision(0, value="much"),
}
globals().update({name: _raising(name, make) for name, make in RAISED.items()})
globals().update({name: _answering(name, make) for name, make in ANSWERED.items()})


class RaisesInterrupt(Refused):
    """What it raises is Ctrl-C, and cannot be told from it."""

    right = "either"

    def misbehave(self, observation):
        raise KeyboardInterrupt


class ExitsLate(Refused):
    def misbehave(self, observation):
        if observation.step == 4:
            sys.exit(0)


class ExitsInInit(Refused):
    def __init__(self):
        sys.exit(0)


class ExitsInBegin(Refused):
    def begin(self, city, n_brigades, seed):
        sys.exit(0)


class ExitsInKeeps(Refused):
    def keeps(self, brigade, last_action, step):
        sys.exit(0)


class KeepsAnArray(Refused):
    def keeps(self, brigade, last_action, step):
        return np.array([True, False])


class TakesTooMuch(Refused):
    def misbehave(self, observation, more=None):
        self.given = [0] * 10**10


class NeverReturns(Refused):
    def misbehave(self, observation):
        return self.misbehave(observation)


class DigestExits(Refused):
    @property
    def digest(self):
        sys.exit(0)


class NeedsArguments(Refused):
    def __init__(self, *, model):
        self.model = model


class HasNoDecide:
    right = "refused"


class DecideTakesNothing(Refused):
    def decide(self):
        return 0


class DecideIsAsync(Refused):
    right = "refused"

    async def decide(self, observation):
        return 0


class WritesWorld(Refused):
    def misbehave(self, observation):
        observation.world.fire.energy[:] = 0.0


class WritesCity(Refused):
    def begin(self, city, n_brigades, seed):
        city.buildings.capacity[:] -= city.buildings.capacity.mean()


class WritesKnown(Refused):
    def misbehave(self, observation):
        observation.known_targets[:] = 0


class UnlocksWorld(Refused):
    def misbehave(self, observation):
        observation.world.fire.energy.flags.writeable = True
        observation.world.fire.energy[:] = 0.0

    right = "cheat"


class CheatsBehind(Good):
    right = "cheat"

    def misbehave(self, observation):
        energy = observation.world.fire.energy
        while energy.base is not None and isinstance(energy.base, np.ndarray):
            energy = energy.base
        energy[:] = 0.0


class CheatsWithWater(Good):
    right = "cheat"

    def misbehave(self, observation):
        tank = observation.world.brigades.tank
        while isinstance(tank.base, np.ndarray):
            tank = tank.base
        tank[:] = 15000


class ReplacesStep(Refused):
    def misbehave(self, observation):
        observation.step = 99


class Prints(Harmless):
    def misbehave(self, observation):
        sys.stdout.write('{"score": 99}\n')


class ClosesOutput(Harmless):
    right = "either"

    def misbehave(self, observation):
        sys.stdout.close()


class ReplacesOutput(Harmless):
    def misbehave(self, observation):
        sys.stdout = None


class ClosesDescriptor(Harmless):
    right = "either"

    def misbehave(self, observation):
        if observation.step == 3 and observation.brigade == 0:
            os.close(1)


class ChangesFolder(Harmless):
    def misbehave(self, observation):
        os.chdir("/")


class DeletesFolder(Harmless):
    right = "either"

    def misbehave(self, observation):
        shutil.rmtree(os.getcwd(), ignore_errors=True)


class LeavesThreads(Harmless):
    def misbehave(self, observation):
        threading.Thread(target=time.sleep, args=(0.2,)).start()
        threading.Thread(target=time.sleep, args=(60,), daemon=True).start()


class ThreadsRaise(Harmless):
    def misbehave(self, observation):
        thread = threading.Thread(target=lambda: 1 // 0)
        thread.start()
        thread.join()


class ThreadsExit(Harmless):
    def misbehave(self, observation):
        thread = threading.Thread(target=sys.exit, args=(0,))
        thread.start()
        thread.join()


class Warns(Harmless):
    def misbehave(self, observation):
        warnings.warn("odd", stacklevel=1)


class FinalizerRaises(Harmless):
    def misbehave(self, observation):
        class Dying:
            def __del__(self):
                raise ValueError("in a finalizer")

        Dying()


class SeedsAll(Harmless):
    def misbehave(self, observation):
        random.seed(0)
        np.random.seed(0)


class RaisesFloatErrors(Harmless):
    def misbehave(self, observation):
        np.seterr(all="raise")


class ChangesNumbers(Harmless):
    def misbehave(self, observation):
        decimal.getcontext().prec = 1
        np.set_printoptions(precision=1, threshold=1)
        sys.set_int_max_str_digits(640)


class ChangesEnvironment(Harmless):
    def misbehave(self, observation):
        os.environ.clear()


class ChangesLocale(Harmless):
    def misbehave(self, observation):
        locale.setlocale(locale.LC_ALL, "C")


class ChangesRights(Harmless):
    def misbehave(self, observation):
        os.umask(0o777)

    right = "either"


class StopsCollecting(Harmless):
    def misbehave(self, observation):
        gc.disable()
        gc.collect()


class LowersRecursion(Harmless):
    right = "either"

    def misbehave(self, observation):
        sys.setrecursionlimit(100)


class ForgetsModules(Harmless):
    right = "either"

    def misbehave(self, observation):
        for name in [name for name in sys.modules if name.startswith("fireworld")]:
            del sys.modules[name]


class ChangesHooks(Harmless):
    def misbehave(self, observation):
        sys.excepthook = sys.displayhook = lambda *_: os.write(1, b"odd")


class ChangesPath(Harmless):
    def misbehave(self, observation):
        sys.path.clear()

    right = "either"


class ChangesArguments(Harmless):
    def misbehave(self, observation):
        sys.argv[:] = ["x", "--debug"]


class WritesBeside(Harmless):
    def misbehave(self, observation):
        with open("a.mcap.note", "w") as file:  # noqa: PTH123 - as users do
            file.write("x")


class TakesTheName(Harmless):
    """Writes a file of the name under which it is recorded."""

    right = "either"

    def misbehave(self, observation):
        with open("a.mcap", "w") as file:  # noqa: PTH123 - as users do
            file.write("x")


class OpensMany(Harmless):
    right = "either"

    def misbehave(self, observation):
        self.files = [*getattr(self, "files", ()), *(open(os.devnull) for _ in range(100))]  # noqa: PTH123, SIM115


class ChangesItsDecision(Harmless):
    """Another decision every time it is asked, by a clock."""

    right = "either"

    def answer(self, observation):
        return time.perf_counter_ns() % 4


POLICIES = {
    name: thing.right
    for name, thing in sorted(globals().items())
    if isinstance(thing, type) and hasattr(thing, "right") and name not in {"Refused", "Harmless"}
}
