"""Runs, their files, and what is exported of them."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import tractive

HERE = Path(__file__).resolve().parent


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    return tractive.run("sweep", "--to", "300", out=tmp_path_factory.mktemp("sweep"))


def test_a_run_is_its_files(sweep):
    lines = (sweep.folder / "trace.csv").read_text().splitlines()
    assert len(sweep.trace) == len(lines) - 1
    assert list(sweep.trace.columns) == lines[0].split(",")[1:]
    last = dict(zip(lines[0].split(","), lines[-1].split(",")))
    assert sweep.trace["te_nm"].iloc[-1] == pytest.approx(float(last["te_nm"]))
    assert set(sweep.trace["fault"]) == {""} and "async" in set(sweep.trace["mode"])
    assert sweep.summary["scenario"] == "sweep" and sweep.figures["fault"] == ""
    assert sweep.recorder is None and len(sweep.verdicts) > 2


def test_the_line_voltage_is_made_of_the_edges(sweep):
    times_s = np.linspace(0.5, 0.6, 2001)
    volts = sweep.line_voltage(times_s)
    assert set(np.round(volts)) == {-1500, 0, 1500}
    at, levels = sweep.levels("u")
    assert np.all(np.diff(levels) != 0), "each edge changes the level"


def test_a_bound_that_is_not_kept_and_bad_usage_say_what():
    with pytest.raises(tractive.FallsShort, match="t90") as short:
        tractive.run("full-step", "--udc", "1000", strict=True)
    assert short.value.run.verdicts["verdict"].eq("falls short").any()
    with pytest.raises(ValueError, match="--tu"):
        tractive.run("sweep", "--tu", "3")
    with pytest.raises(FileNotFoundError, match="no run"):
        tractive.load(HERE)


def test_what_is_exported_comes_back(sweep, tmp_path):
    pyarrow = pytest.importorskip("pyarrow.parquet")
    reader = pytest.importorskip("mcap.reader")
    files = [tmp_path / "sweep.parquet", tmp_path / "sweep.mcap"]
    words = [sys.executable, "-m", "tractive", "export", str(sweep.folder), "--parquet", str(files[0]), "--mcap", str(files[1])]
    subprocess.run(words, check=True)
    table = pyarrow.read_table(files[0])
    assert table["te_nm"].to_numpy() == pytest.approx(sweep.trace["te_nm"].to_numpy())
    assert json.loads(table.schema.metadata[b"tractive"])["scenario"] == "sweep"
    with files[1].open("rb") as file:
        messages = [(channel.topic, json.loads(message.data)) for _, channel, message in reader.make_reader(file).iter_messages()]
    traced = [row["te_nm"] for topic, row in messages if topic == "/trace"]
    assert traced == pytest.approx(sweep.trace["te_nm"].to_list())
    assert sum(topic == "/edges" for topic, _ in messages) == len(sweep.edges)


def test_the_notebook_draws_figure_9():
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    notebook = nbformat.read(HERE.parent / "notebooks" / "figure9.ipynb", as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells), "it is kept without outputs"
    done = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(HERE.parent)}}).execute()
    outputs = [output for cell in done.cells for output in cell.get("outputs", [])]
    pictures = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) == 2
    said = "".join(output.get("text", "") for output in outputs)
    assert all(mode in said for mode in ("sync15", "sync12", "mid7", "mid3", "square")), said
