"""Runs of scenarios, and the files that they leave."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd


class FallsShort(Exception):
    """A run in which a bound was not kept or the drive tripped; `run` holds it."""

    def __init__(self, run: "Run", said: str):
        super().__init__(said)
        self.run = run


@dataclass
class Run:
    """The files of a run."""

    folder: Path

    @cached_property
    def summary(self) -> dict:
        """The contents of summary.json: version, machine, options, figures."""
        return json.loads((self.folder / "summary.json").read_text())

    @property
    def figures(self) -> dict:
        """The figures by name, each with its unit in the name."""
        return self.summary["figures"]

    @property
    def verdicts(self) -> pd.DataFrame:
        """The figures that are judged, each with its bound."""
        return pd.DataFrame(self.figures.get("verdicts", []))

    @cached_property
    def trace(self) -> pd.DataFrame:
        """The rows of trace.csv by time in s; names such as modes are categories."""
        return self._table("trace.csv")

    @cached_property
    def edges(self) -> pd.DataFrame:
        """The gates' edges at their exact times in s; empty where the run kept none."""
        if not (self.folder / "edges.csv").exists():
            return pd.DataFrame({"gate": [], "level": []})
        return self._table("edges.csv")

    @cached_property
    def recorder(self) -> pd.DataFrame | None:
        """The records that the flight recorder held of a fault; None without one."""
        return self._table("recorder.csv") if (self.folder / "recorder.csv").exists() else None

    def levels(self, leg: str) -> tuple[np.ndarray, np.ndarray]:
        """Times in s and levels of a leg from each on: 1 where the upper device is on, else 0."""
        of = self.edges[self.edges["gate"] == f"{leg}h"]
        return of.index.to_numpy(), of["level"].to_numpy()

    def line_voltage(self, times_s: np.ndarray, legs: str = "uv") -> np.ndarray:
        """The voltage between two legs at some times, in V: levels times the link's voltage."""
        times_s = np.asarray(times_s)
        link_v = np.interp(times_s, self.trace.index, self.trace["udc_v"])

        def level(leg: str) -> np.ndarray:
            at, levels = self.levels(leg)
            place = np.searchsorted(at, times_s, side="right")
            return np.concatenate([[0], levels])[place]

        return (level(legs[0]) - level(legs[1])) * link_v

    @property
    def switches(self) -> pd.DataFrame:
        """The changes of mode: time in s, from, to."""
        modes = self.trace["mode"].astype(str)
        begins = modes.ne(modes.shift()) & (np.arange(len(modes)) > 0)
        return pd.DataFrame({"t_s": self.trace.index[begins], "from": modes.shift()[begins], "to": modes[begins]})

    def _table(self, name: str) -> pd.DataFrame:
        path = self.folder / name
        # An empty name is a name: no fault.
        names = {column: "category" for column in ("mode", "fault", "scheme", "gate")}
        header = pd.read_csv(path, nrows=0).columns
        kinds = {column: kind for column, kind in names.items() if column in header}
        return pd.read_csv(path, dtype=kinds, keep_default_na=False, na_values={}).set_index("t_s")


def load(folder: str | os.PathLike) -> Run:
    """A run that is over, by its folder."""
    folder = Path(folder)
    if not (folder / "summary.json").is_file():
        raise FileNotFoundError(f"{folder}: holds no summary.json, so no run")
    return Run(folder)


def rig() -> list[str]:
    """The rig's program: what TRACTIVE_RIG names, or tractive-rig on the path, or cargo in the repository around the working folder."""
    if named := os.environ.get("TRACTIVE_RIG"):
        return [named]
    if found := shutil.which("tractive-rig"):
        return [found]
    if shutil.which("cargo"):
        return ["cargo", "rig"]
    raise FileNotFoundError("no rig: set TRACTIVE_RIG to its program, or install cargo and work in the repository")


def run(scenario: str, *options: str, out: str | os.PathLike | None = None, strict: bool = False) -> Run:
    """Runs a scenario on the host with options as on the command line, and returns its files.

    Without a folder for them a temporary one is made. A bound that is not kept raises FallsShort where `strict`; bad usage raises
    ValueError with the rig's words.
    """
    folder = Path(out) if out is not None else Path(tempfile.mkdtemp(prefix="tractive-"))
    words = [*rig(), "run", scenario, "--on", "host", "--json", "--out", str(folder), *map(str, options)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        raise ValueError(done.stderr.strip() or f"{' '.join(words)}: exit code {done.returncode}")
    result = load(folder)
    if strict and done.returncode == 1:
        short = [row["what"] for row in result.figures.get("verdicts", []) if row["verdict"] == "falls short"]
        raise FallsShort(result, "; ".join(short) or done.stderr.strip())
    return result
