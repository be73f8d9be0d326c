"""The drive's CAN protocol: signals after a DBC file, protected end to end after AUTOSAR's profile 2."""

from __future__ import annotations

import math
from importlib.resources import files
from pathlib import Path

import cantools

POLYNOMIAL = 0x2F
MAX_DELTA = 3
# The signal by which a message says in which steps it counts, where they are not the usual ones.
SCALE = "scale"


def _remainder(value: int) -> int:
    for _ in range(8):
        value = (value << 1) ^ (POLYNOMIAL if value & 0x80 else 0)
    return value & 0xFF


_TABLE = [_remainder(value) for value in range(256)]


def crc8h2f(data: bytes) -> int:
    """AUTOSAR's CRC8H2F of some bytes."""
    crc = 0xFF
    for byte in data:
        crc = _TABLE[crc ^ byte]
    return crc ^ 0xFF


def data_id(number: int, counter: int) -> int:
    """The byte that is checked but not sent, of the message with this number, at this counter."""
    return ((number & 0xF) << 4) | (counter ^ (8 if number & 0x10 else 0))


def crc_of(data: bytes, number: int) -> int:
    """The check value that a frame should have in its byte 0."""
    return crc8h2f(bytes(data[1:]) + bytes([data_id(number, data[1] & 0xF)]))


class Protocol:
    """The messages of both systems, in the steps of a machine: as `cargo rig dbc --machine DIR --out FILE` writes them, without a file those
    of the papers' machines."""

    def __init__(self, dbc=None):
        with (Path(dbc) if dbc else files(__package__).joinpath("tractive.dbc")).open() as text:
            self.messages = cantools.database.load(text, database_format="dbc")

    def message(self, name_or_id):
        """A message by its name or identifier. KeyError where there is none."""
        if isinstance(name_or_id, int):
            return self.messages.get_message_by_frame_id(name_or_id)
        return self.messages.get_message_by_name(name_or_id)

    @staticmethod
    def number(message) -> int:
        """The message's number, of which its data identifiers are made."""
        return int(message.dbc.attributes["DataIdNumber"].value)

    def encode(self, name: str, counter: int, signals: dict) -> bytes:
        """The eight bytes of a message; signals that are not named are 0. ValueError names one that is unknown or out of its range."""
        message = self.message(name)
        known = {signal.name for signal in message.signals} - {"crc", "counter", SCALE}
        if unknown := set(signals) - known:
            raise ValueError(f"{name}: {', '.join(sorted(unknown))}: must be of {', '.join(sorted(known))}")
        values = {signal.name: signal.minimum if signal.name == SCALE else 0 for signal in message.signals}
        values |= signals | {"crc": 0, "counter": counter & 0xF}
        # Of what shares its place by pages only the page's own is sent.
        page = next((values[signal.name] for signal in message.signals if signal.is_multiplexer), None)
        values = {
            signal.name: values[signal.name]
            for signal in message.signals
            if signal.multiplexer_ids is None or page in signal.multiplexer_ids
        }
        try:
            data = bytearray(message.encode(values, padding=False, strict=True))
        except cantools.database.errors.EncodeError as error:
            raise ValueError(f"{name}: {error}") from error
        data[0] = crc_of(data, self.number(message))
        return bytes(data)

    def decode(self, message, data: bytes) -> dict:
        """The signals of a frame, without CRC and counter; None where a value is not available."""
        raw = message.decode(bytes(data), decode_choices=False, scaling=False)
        scaled = message.decode(bytes(data), decode_choices=False)
        return {
            signal.name: None if _is_missing(signal, raw[signal.name]) else scaled[signal.name]
            for signal in message.signals
            if signal.name in raw and signal.name not in ("crc", "counter", SCALE)
        }

    @staticmethod
    def is_own(message, data: bytes) -> bool:
        """True if a frame is in the steps of this file: then no bit is set that no signal has, and `scale` is the file's."""
        bits = int.from_bytes(data, "little")
        for signal in message.signals:
            ones = (1 << signal.length) - 1
            if signal.name == SCALE and bits >> signal.start & ones != signal.minimum:
                return False
            bits &= ~(ones << signal.start)
        return bits == 0


def _is_missing(signal, raw) -> bool:
    """Not available: of a float not a number; of what has a range, the code beyond it that stands for it."""
    if signal.is_float:
        return math.isnan(raw)
    if signal.length < 8:
        return False
    missing = -(1 << (signal.length - 1)) if signal.is_signed else (1 << signal.length) - 1
    value = missing * signal.scale + signal.offset
    beyond = (signal.minimum is not None and value < signal.minimum) or (signal.maximum is not None and value > signal.maximum)
    return beyond and raw == missing


class Sender:
    """Frames to the drive, each message with its own counter."""

    def __init__(self, protocol: Protocol | None = None):
        self.protocol = protocol or Protocol()
        self.counters: dict[str, int] = {}

    def frame(self, name: str, **signals) -> dict:
        """The next frame of a message: arbitration_id and data, as python-can's Message takes them.

        The first frame of a message, and the first after a silence, only sets the drive's counter.
        """
        counter = self.counters.get(name, 0)
        data = self.protocol.encode(name, counter, signals)
        self.counters[name] = (counter + 1) & 0xF
        return {"arbitration_id": self.protocol.message(name).frame_id, "data": data}


class Receiver:
    """Frames from the drive, judged by CRC and counter.

    After more than two lost frames the next ones are rejected until the counter comes round: after a silence, make a new one.
    """

    def __init__(self, protocol: Protocol | None = None):
        self.protocol = protocol or Protocol()
        self.last: dict[int, int] = {}
        self.signals: dict[str, dict] = {}
        self.lost = 0

    def take(self, identifier: int, data: bytes) -> tuple[str, dict | str]:
        """A frame: its message's name with its signals, or with the reason why it is rejected.

        "scaled otherwise": the drive counts in the steps of another machine than this protocol's file.
        """
        try:
            message = self.protocol.message(identifier)
        except KeyError:
            return f"{identifier:03X}", "unknown"
        if len(data) != 8:
            return message.name, "truncated"
        if data[0] != crc_of(data, self.protocol.number(message)):
            return message.name, "corrupted"
        counter, last = data[1] & 0xF, self.last.get(identifier)
        delta = 1 if last is None else (counter - last) & 0xF
        if delta == 0:
            return message.name, "repeated"
        if delta > MAX_DELTA:
            return message.name, "disordered"
        self.last[identifier] = counter
        self.lost += delta - 1
        if not self.protocol.is_own(message, data):
            return message.name, "scaled otherwise"
        found = self.protocol.decode(message, data)
        self.signals.setdefault(message.name, {}).update(found)
        return message.name, found


def candump(path):
    """The frames of a log as candump and the rig write it: time in s, identifier, data, direction (T to the drive, R from it, or nothing)."""
    with open(path) as log:
        for line in log:
            words = line.split()
            if len(words) < 3:
                continue
            identifier, _, data = words[2].partition("#")
            yield float(words[0].strip("()")), int(identifier, 16), bytes.fromhex(data), "".join(words[3:4])
