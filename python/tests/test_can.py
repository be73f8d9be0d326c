"""The protocol, against frames that the drive's own code made and judged."""

import subprocess
from pathlib import Path

import pandas as pd
import pytest

from tractive.can import Protocol, Receiver, Sender, candump, crc8h2f, crc_of
from tractive.runs import rig

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module", params=["round-trip.talk", "zs9.talk"])
def talk(request, tmp_path_factory):
    out = tmp_path_factory.mktemp("talk")
    system = ["--system", "zs9"] if request.param.startswith("zs9") else []
    script = ROOT / "rig" / "scripts" / request.param
    subprocess.run([*rig(), "talk", *system, str(script), "--on", "host", "--out", str(out)], check=True, cwd=ROOT, capture_output=True)
    return out


def test_the_check_value_is_the_standards():
    assert crc8h2f(b"123456789") == 0xDF
    assert crc8h2f(bytes(4)) == 0x12


def test_the_protocols_description_is_the_guides():
    assert (ROOT / "docs/tractive.dbc").read_bytes() == (ROOT / "python/tractive/tractive.dbc").read_bytes()


def test_every_frame_of_the_drive_is_taken_and_tells_what_the_rig_decodes(talk):
    receiver, motion = Receiver(), []
    count = 0
    for t_s, identifier, data, direction in candump(talk / "frames.log"):
        if direction != "R":
            continue
        name, found = receiver.take(identifier, data)
        assert isinstance(found, dict), f"{t_s} {name}: {found}"
        count += 1
        if name in ("MOTION", "ZS9_MOTOR_1"):
            motion.append((t_s, found["speed_rpm"], found["torque_nm"]))
    assert count > 1000 and receiver.lost == 0
    told = pd.read_csv(talk / "telemetry.csv")
    speed = "speed_rpm" if "speed_rpm" in told else "speed1_rpm"
    # A row is written with each STATUS: the newest MOTION before it.
    pairs = pd.merge_asof(
        told[["t_s", speed]].dropna(), pd.DataFrame(motion, columns=["t_s", "found", "torque"]), on="t_s", allow_exact_matches=False
    ).dropna()
    assert len(pairs) > 100 and (pairs[speed] - pairs["found"]).abs().max() < 1e-3
    assert pairs["found"].abs().max() > 500


def test_the_same_signals_make_the_same_bytes(talk):
    protocol, count = Protocol(), 0
    for _, identifier, data, direction in candump(talk / "frames.log"):
        if direction != "T":
            continue
        message = protocol.message(identifier)
        signals = {name: value for name, value in message.decode(data, decode_choices=False).items() if name not in ("crc", "counter")}
        assert protocol.encode(message.name, data[1] & 0xF, signals) == data
        count += 1
    assert count > 100


def test_a_sender_is_heard_and_what_is_wrong_is_not():
    sender, receiver = Sender(), Receiver()
    frames = [sender.frame("COMMAND", enable=1, torque_nm=-123.4) for _ in range(6)]
    assert frames[0]["arbitration_id"] == 0x101
    name, found = receiver.take(**_words(frames[0]))
    assert (name, found["enable"], found["torque_nm"]) == ("COMMAND", 1, pytest.approx(-123.4))
    assert receiver.take(**_words(frames[0]))[1] == "repeated"
    assert isinstance(receiver.take(**_words(frames[3]))[1], dict) and receiver.lost == 2
    assert receiver.take(**_words(frames[2]))[1] == "disordered"
    broken = bytearray(frames[4]["data"])
    broken[3] ^= 1
    assert receiver.take(0x101, bytes(broken))[1] == "corrupted"
    assert receiver.take(0x102, frames[4]["data"])[1] == "corrupted", "under another message's identifier"
    assert receiver.take(0x101, frames[4]["data"][:7])[1] == "truncated"
    assert receiver.take(0x7FF, bytes(8))[1] == "unknown"
    assert crc_of(frames[5]["data"], 1) == frames[5]["data"][0]


def test_bad_signals_are_named():
    with pytest.raises(ValueError, match="torque_mn"):
        Sender().frame("COMMAND", torque_mn=1)
    with pytest.raises(ValueError, match="torque_nm"):
        Sender().frame("COMMAND", torque_nm=3001)


@pytest.fixture(scope="module")
def low_voltage(tmp_path_factory):
    out = tmp_path_factory.mktemp("dbc") / "low.dbc"
    subprocess.run([*rig(), "dbc", "--machine", "pmsm-48v-1kw", "--out", str(out)], check=True, cwd=ROOT, capture_output=True)
    return Protocol(out)


def test_another_machines_file_has_other_steps_and_they_are_not_misread(low_voltage):
    usual = Protocol()
    for protocol, other, torque_nm in [(low_voltage, usual, 1.234), (usual, low_voltage, 123.4)]:
        sender = Sender(protocol)
        frames = [_words(sender.frame("COMMAND", enable=1, torque_nm=torque_nm)) for _ in range(3)]
        own, foreign = Receiver(protocol), Receiver(other)
        assert own.take(**frames[0])[1]["torque_nm"] == pytest.approx(torque_nm)
        assert foreign.take(**frames[0])[1] == "scaled otherwise"
    with pytest.raises(ValueError, match="torque_nm"):
        Sender(low_voltage).frame("COMMAND", torque_nm=31)
    with pytest.raises(ValueError, match="scale"):
        Sender(low_voltage).frame("COMMAND", scale=0)


def _words(frame):
    return {"identifier": frame["arbitration_id"], "data": frame["data"]}
