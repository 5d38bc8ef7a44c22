"""A training as a run of MLflow: parameters, metrics while the team learns, the team's file at the end."""

from __future__ import annotations

import hashlib
import json
import logging
import math
import os
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fireworld.arguments import path_of
from fireworld.errors import LibraryError, OutputError, expected
from fireworld.files import make_folder, write_file
from fireworld.policy.teams.team import write_team
from fireworld.training.hooks.hook import DONE, FAILED, STOPPED, Hook

if TYPE_CHECKING:
    from fireworld.training.method import Report
    from fireworld.training.training import Training

DATABASE: Final = "mlflow.db"
ARTIFACTS: Final = "artifacts"
SETTINGS: Final = {
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "2",
    "MLFLOW_HTTP_REQUEST_TIMEOUT": "10",
}
"""Of MLflow, unless they are set: nothing is sent to its makers, and a server that is gone soon counts as gone."""
METRICS_MAX: Final = 1000
"""Of one request."""
TEXT_MAX: Final = 5000
"""Characters of a tag."""
FLUSH_SECONDS: Final = 5.0
STATUS: Final = {DONE: "FINISHED", STOPPED: "KILLED", FAILED: "FAILED"}
IDENTITY: Final = "fireworld.training"


class MLflowCallback(Hook):
    """Writes parameters, every number of every report as a metric, and at the end the team file and the CSV log.

    A training that is continued continues its run, found by the tag `fireworld.training`.

    Args:
        store: the address of a server or a database, as in http://localhost:5000, or a folder, in which a database
            mlflow.db and a folder artifacts are made.
        experiment: its name.
        run_name: of this run; None: after the curriculum, the method and the seed.
    """

    def __init__(self, store: str | Path, *, experiment: str = "fireworld", run_name: str | None = None) -> None:
        self._folder = None if isinstance(store, str) and "://" in store else path_of("store", store)
        self._uri = str(store) if self._folder is None else f"sqlite:///{self._folder.absolute() / DATABASE}"
        self._store, self._experiment, self._run_name = str(store), experiment, run_name
        self._client: Any = None
        self._run = ""
        self._first = 0
        self._held: list[Any] = []
        self._flushed = 0.0

    @property
    def name(self) -> str:
        """MLflow and its store."""
        return f"MLflow {self._store}"

    def check(self, training: Training) -> None:
        """Raise LibraryError if MLflow is not installed, OutputError if there is a file instead of a folder."""
        del training
        needed = {"mlflow": "mlflow"} | ({"sqlalchemy": "SQLAlchemy", "alembic": "alembic"} if self._folder else {})
        for module, package in needed.items():
            if find_spec(module) is None:
                raise LibraryError(f"MLflow: {package} is not installed; try pip install 'fireworld[mlflow]'")
        if self._folder is not None and self._folder.exists() and not self._folder.is_dir():
            wanted = "the address of a store, or a folder"
            raise OutputError(expected(str(self._folder), "", wanted, "a file"))

    def begin(self, training: Training) -> None:
        """Begin a run, or find the one that the training has begun."""
        for key, value in SETTINGS.items():
            os.environ.setdefault(key, value)
        if self._folder is not None:
            make_folder(self._folder)
        from mlflow.tracking import MlflowClient

        for noisy in ("mlflow.store.db.utils", "alembic.runtime.migration"):
            logging.getLogger(noisy).setLevel(logging.WARNING)
        self._client = MlflowClient(tracking_uri=self._uri)
        self._held, self._first, self._flushed = [], 0, time.monotonic()
        experiment = self._experiment_id()
        identity = hashlib.sha256(json.dumps(training.trainer.identity, sort_keys=True).encode()).hexdigest()
        if training.continues and self._find(experiment, identity):
            return
        facts = training.parameters
        name = self._run_name or f"{facts['curriculum']} {facts['method']} seed {training.seed}"
        scenarios = ", ".join(one.name for stage in training.trainer.curriculum.stages for one in stage.scenarios)
        tags = {IDENTITY: identity, "fireworld.scenarios": scenarios[:TEXT_MAX]}
        self._run = self._client.create_run(experiment, run_name=name, tags=tags).info.run_id
        from mlflow.entities import Param

        self._client.log_batch(self._run, params=[Param(key, str(value)) for key, value in facts.items()])

    def write(self, training: Training, report: Report) -> None:
        """Hold the numbers of a report, and send them from time to time."""
        from mlflow.entities import Metric

        n, now_ms = training.n_reports - 1, int(time.time() * 1000)
        if n < self._first:
            return  # written before the training was interrupted
        numbers = {key: value for key, value in training.numbers(report).items() if math.isfinite(value)}
        if len(self._held) + len(numbers) > METRICS_MAX or time.monotonic() - self._flushed > FLUSH_SECONDS:
            self._flush()
        self._held += [Metric(key, value, now_ms, n) for key, value in numbers.items()]

    def end(self, training: Training) -> None:
        """Send the rest, the team with its digest, and how it ended."""
        self._flush()
        if training.team is not None:
            self._client.set_tag(self._run, "fireworld.team_digest", training.team.digest)
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / (training.path.name if training.path is not None else "team.npz")
                write_team(training.team, path)
                self._client.log_artifact(self._run, str(path))
                log = Path(folder) / "log.csv"
                write_file(log, training.table)
                self._client.log_artifact(self._run, str(log))
        self._client.set_terminated(self._run, status=STATUS[training.ending])

    def _experiment_id(self) -> str:
        found = self._client.get_experiment_by_name(self._experiment)
        if found is not None:
            return str(found.experiment_id)
        place = None if self._folder is None else (self._folder.absolute() / ARTIFACTS).as_uri()
        return str(self._client.create_experiment(self._experiment, artifact_location=place))

    def _find(self, experiment: str, identity: str) -> bool:
        """Find the run that an interrupted training has begun, and how far it is; return whether there is one."""
        wanted = f"tags.`{IDENTITY}` = '{identity}' and attributes.status != 'FINISHED'"
        order = ["attributes.start_time DESC"]
        runs = self._client.search_runs([experiment], wanted, max_results=1, order_by=order)
        if not runs:
            return False
        self._run = runs[0].info.run_id
        self._client.update_run(self._run, status="RUNNING")
        for key in runs[0].data.metrics:
            steps = [one.step for one in self._client.get_metric_history(self._run, key)]
            self._first = max([self._first, *[step + 1 for step in steps]])
        return True

    def _flush(self) -> None:
        if self._held:
            self._client.log_batch(self._run, metrics=self._held)
        self._held, self._flushed = [], time.monotonic()
