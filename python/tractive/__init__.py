"""Runs of tractive's rig as arrays, and the drive's CAN protocol."""

from .runs import FallsShort, Run, load, run

__all__ = ["FallsShort", "Run", "load", "run"]
