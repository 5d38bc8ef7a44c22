"""Policies of the tests, put into the folder where a test works: some of them fail in step 5."""

import os
import signal

from fireworld.policy.protocol import Action, Decision


class Near:
    """Without a fault."""

    def decide(self, observation):
        if observation.step == 5 and observation.brigade == 1:
            self.at_step_5()
        return Decision(Action.NEAREST_TO_ME)

    def at_step_5(self):
        pass


class Values(Near):
    """Also says why."""

    def decide(self, observation):
        return Decision(observation.step % 4, q_values=(0.5, 1.5, 2.5, observation.step), explored=True, epsilon=0.25)


class Failing(Near):
    def at_step_5(self):
        raise RuntimeError("lost the\nthread")


class Wrong(Near):
    def decide(self, observation):
        return Decision(7) if observation.step == 5 else Decision(0)


class NeverReady(Near):
    def begin(self, city, n_brigades, seed):
        raise RuntimeError("no model")


class Interrupted(Near):
    def at_step_5(self):
        signal.raise_signal(signal.SIGINT)


class InterruptedTwice(Near):
    def at_step_5(self):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)


class Killed(Near):
    def at_step_5(self):
        os.kill(os.getpid(), signal.SIGKILL)
