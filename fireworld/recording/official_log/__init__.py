"""Logs that official RoboCup Rescue kernels wrote, made into recordings of fireworld's own format."""
