"""Hooks: callbacks of a training that keep its curves in other tools, TensorBoard, MLflow or a file of JSON lines."""

from fireworld.training.hooks.hook import Hook, StopTraining
from fireworld.training.hooks.jsonl import JsonlCallback
from fireworld.training.hooks.mlflow import MLflowCallback
from fireworld.training.hooks.tensorboard import TensorBoardCallback

__all__ = ["Hook", "JsonlCallback", "MLflowCallback", "StopTraining", "TensorBoardCallback"]
