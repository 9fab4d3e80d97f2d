"""A controller in virtual time whose text side is the network's server (targets/net/net_hub.h): several clients, of
whom one commands. Bytes of the tests are those of client 0."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

from c_library import LIB
from grbl_host import HEARD, HZ
from layouts import HOST
from remote_host import RemoteHosts

Hub, Access, Client = HOST.struct("net_hub"), HOST.struct("access"), HOST.struct("net_client")
Stream, StreamOps = HOST.struct("net_stream"), HOST.struct("net_stream_ops")
Ops, Sizes = HOST.struct("net_hub_ops"), HOST.struct("net_hub_sizes")
SLICE_S = 0.1
JOGS = HOST.enum("machine_state").MACHINE_JOG
CLIENTS = 3


def callback(record: Any, name: str, function: Any) -> Any:
    """As that field; text is an address, because ctypes would end it at a NUL and copy it."""
    kind = dict(record._fields_)[name]
    taken = [ctypes.c_void_p if one is ctypes.c_char_p else one for one in kind._argtypes_]
    return ctypes.cast(ctypes.CFUNCTYPE(kind._restype_, *taken)(function), kind)


def copied(target: int, data: bytes) -> int:
    ctypes.memmove(target, data, len(data))
    return len(data)


class HubHosts(RemoteHosts):
    """Room of the server: as on a chip with little memory. Clients at some places may be pendants."""

    def __init__(self, room: int = 2048, pendants: Sequence[int] = ()) -> None:
        self._sent, self._got = [b""] * CLIENTS, [b""] * CLIENTS
        self.stalled: set[int] = set()  # places that read nothing
        super().__init__()
        self._machine = LIB.host_machine(self._host)
        self._ops = Ops(
            put=callback(Ops, "put", self._put),
            hear=callback(Ops, "hear", self._hear),
            act=callback(Ops, "act", lambda _ctx: LIB.host_act(self._host)),
            event=callback(Ops, "event", lambda _ctx, what, who: None),
            left=callback(Ops, "left", lambda _ctx, waits: self.lose_sender(waits)),
            reads=callback(Ops, "reads", lambda _ctx: LIB.host_reads(self._host)),
            whose=callback(Ops, "whose", lambda _ctx: LIB.machine_whose(self._machine)),
            stops=callback(Ops, "stops", lambda _ctx: LIB.machine_stops(self._machine)),
            jogs=callback(Ops, "jogs", lambda _ctx: LIB.machine_state(self._machine) == JOGS),
            stopped_by_other=callback(Ops, "stopped_by_other", lambda _ctx: LIB.host_stopped_by_other(self._host)),
            room=callback(Ops, "room", lambda _ctx: LIB.machine_line_room(self._machine)),
            drop_unread=callback(Ops, "drop_unread", lambda _ctx: LIB.host_drop_unread(self._host)),
            busy=callback(Ops, "busy", lambda _ctx: LIB.host_is_busy(self._host)),
        )
        self._wires = StreamOps(
            read=callback(StreamOps, "read", self._read),
            write=callback(StreamOps, "write", self._write),
            close=callback(StreamOps, "close", lambda _stream: None),
        )
        self._access, self._hub = Access(open=True), Hub()
        sizes = Sizes(**{"clients": CLIENTS, "in": room, "out": 16384, "left": room})
        LIB.net_hub_init(ctypes.byref(self._hub), ctypes.byref(sizes), ctypes.byref(self._ops), None)
        self._hub.access = ctypes.pointer(self._access)
        for place in range(CLIENTS):
            kind = HOST.enum("net_pendant").NET_PENDANT_TERMINAL if place in pendants else 0
            made = Stream(ops=ctypes.pointer(self._wires), ctx=place + 1, peer=place + 1, pendant=kind)
            assert LIB.net_hub_connect(ctypes.byref(self._hub), ctypes.byref(made), b"client")

    def close(self) -> None:
        LIB.net_hub_close(ctypes.byref(self._hub))
        super().close()

    # ---- the server's surroundings ----

    def _put(self, _ctx: Any, data: int, count: int) -> int:
        return int(LIB.host_write(self._host, ctypes.string_at(data, count), count))

    def _hear(self, _ctx: Any, data: int, size: int) -> int:
        return copied(data, HEARD[: LIB.host_read(self._host, HEARD, size)])

    def _read(self, stream: int, data: int, size: int) -> int:
        place = self._place(stream)
        taken, self._sent[place] = self._sent[place][:size], self._sent[place][size:]
        return copied(data, taken)

    def _write(self, stream: int, data: int, count: int) -> int:
        place = self._place(stream)
        if place in self.stalled:
            return 0
        self._got[place] += ctypes.string_at(data, count)
        return count

    def _place(self, stream: int) -> int:
        return int(Stream.from_address(stream).ctx) - 1

    def _round(self) -> None:
        hub = ctypes.byref(self._hub)
        LIB.net_hub_tick(hub, round(self.time() * 1e6) % 2**32)
        for place in range(CLIENTS):
            LIB.net_hub_read(hub, ctypes.byref(self._hub.client[place]))
        LIB.net_hub_ask(hub)
        LIB.net_hub_feed(hub)
        LIB.net_hub_hear(hub)
        LIB.net_hub_flush(hub)

    # ---- clients ----

    def put(self, data: str) -> None:
        self.put_of(0, data)

    def put_of(self, place: int, data: str) -> None:
        self._sent[place] += data.encode("latin-1")
        self._round()

    def waits_of(self, place: int) -> int:
        """Bytes of its lines that wait in the server."""
        return int(self._hub.client[place].whole)

    def lose_client(self, place: int) -> None:
        """Its connection is broken off."""
        LIB.net_hub_lost(ctypes.byref(self._hub.client[place]))
        self._round()

    def heard(self) -> str:
        return self.heard_of(0)

    def heard_of(self, place: int) -> str:
        self._round()
        self._round()  # lines whose turn has come by what was just heard
        said, self._got[place] = self._got[place], b""
        self.monitor.check()
        return said.decode("latin-1")

    def send(self, data: str) -> str:
        """As that of Grbl, for lines that are done soon."""
        return self.after(0.01, data)

    def passes(self, seconds: float) -> None:
        """Let time pass; what is heard meanwhile stays with those who hear it."""
        for left_s in [SLICE_S] * round(seconds / SLICE_S) or [seconds]:
            LIB.host_input_follows(self._host, 0)
            LIB.host_run_until(self._host, LIB.host_time_ticks(self._host) + round(left_s * HZ))
            self._round()

    def after(self, seconds: float, data: str = "") -> str:
        self.put(data)
        said, end = "", LIB.host_time_ticks(self._host) + round(seconds * HZ)
        while True:
            left_s = (end - LIB.host_time_ticks(self._host)) / HZ
            said += super().after(max(0.0, min(SLICE_S, left_s)))
            if left_s <= SLICE_S:
                return said
