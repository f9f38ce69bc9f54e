#!/usr/bin/env python3
"""Clients that misbehave on `tpm hil serve`: prints a Markdown table of what each received and what the log says.

    tests/programs/inverse_strangers.py TPM [SESSION]

A second client asks for a state after each and receives exactly one. Exit code 1 if a row is not as expected. Frames
are written byte by byte here, after RFC 6455, with nothing of tpm.
"""
import base64
import json
import os
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TEXT, BINARY, CLOSE, PING, PONG, MORE = 1, 2, 8, 9, 10, 0
SOON_S = 60.0
KEY = base64.b64encode(bytes(range(16))).decode()


def frame(kind, payload=b"", final=True, reserved=0, mask=b"\x37\xfa\x21\x3d", announced=None):
    """A frame; `announced`: a length that is not the payload's, in eight bytes."""
    payload = payload.encode() if isinstance(payload, str) else payload
    head = bytes([(0x80 if final else 0) | reserved | kind])
    masked = 0x80 if mask else 0
    if announced is not None:
        head += bytes([masked | 127]) + struct.pack(">Q", announced)
    elif len(payload) < 126:
        head += bytes([masked | len(payload)])
    elif len(payload) < 65536:
        head += bytes([masked | 126]) + struct.pack(">H", len(payload))
    else:
        head += bytes([masked | 127]) + struct.pack(">Q", len(payload))
    return head + (mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload)) if mask else payload)


def upgrade(port, host=None, more="", key=KEY):
    keys = f"Sec-WebSocket-Key: {key}\r\n" if key else ""
    return (f"GET / HTTP/1.1\r\nHost: {host or f'localhost:{port}'}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"{keys}Sec-WebSocket-Version: 13\r\n{more}\r\n").encode()


class Client:
    def __init__(self, port, small=False):
        self.socket = socket.socket()
        if small:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self.socket.settimeout(SOON_S)
        self.socket.connect(("127.0.0.1", port))
        self.port, self.bytes = port, b""

    def opened(self):
        self.send(upgrade(self.port))
        self.head()
        self.device = json.loads(self.next()[1])["inverse3"][0]["device_id"]
        return self

    def send(self, data):
        self.socket.sendall(data)

    def say(self, text):
        self.send(frame(TEXT, text))

    def take(self, count):
        while len(self.bytes) < count:
            more = self.socket.recv(65536)
            if not more:
                raise EOFError
            self.bytes += more
        taken, self.bytes = self.bytes[:count], self.bytes[count:]
        return taken

    def head(self):
        while b"\r\n\r\n" not in self.bytes:
            more = self.socket.recv(65536)
            if not more:
                break
            self.bytes += more
        head, _, self.bytes = self.bytes.partition(b"\r\n\r\n")
        return head.decode().split("\r\n")[0]

    def next(self):
        """Kind and payload of the next frame of the server."""
        first, size = self.take(2)
        if size == 126:
            size, = struct.unpack(">H", self.take(2))
        elif size == 127:
            size, = struct.unpack(">Q", self.take(8))
        return first & 15, self.take(size)

    def state(self):
        kind, payload = self.next()
        if kind == CLOSE:
            raise Closed(struct.unpack(">H", payload[:2])[0], payload[2:].decode())
        assert kind == TEXT, kind
        device, = json.loads(payload)["inverse3"]
        return device["state"]

    def silent(self):
        self.socket.settimeout(0.2)
        try:
            return not self.bytes and self.socket.recv(1) == b"never"
        except TimeoutError:
            return True
        finally:
            self.socket.settimeout(SOON_S)


class Closed(Exception):
    def __str__(self):
        return f"closed with {self.args[0]}: {self.args[1]}"


class Server:
    def __init__(self, tpm, session):
        self.process = subprocess.Popen([tpm, "hil", "serve", session, "--port", "0", "--events-port", "0",
                                         "--duration", "3600 s"],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        first = self.process.stderr.readline()
        self.port = int(first.split("ws://localhost:")[1].split(",")[0])
        self.lines = []
        self.reader = threading.Thread(target=lambda: self.lines.extend(iter(self.process.stderr.readline, "")))
        self.reader.start()

    def log(self, since, wanted):
        until = time.monotonic() + SOON_S
        while time.monotonic() < until:
            lines = [l for l in self.lines[since:] if wanted in l]
            if lines or not wanted:
                return lines
            time.sleep(0.01)
        return []

    def end(self):
        self.process.send_signal(2)
        said = self.process.stdout.read()
        assert self.process.wait() == 0, "a signal is how a server ends, with a duration, too"
        self.reader.join()
        return said


def commands(device, what):
    return json.dumps({"inverse3": [{"device_id": device, "commands": what}]})


def force(client, form, vector):
    return commands(client.device, {"set_cursor_force": {form: vector}})


def of_state(client):
    """One state, and no second one. The force that a client had is not what it reports."""
    state = client.state()
    assert set(state["cursor_position"]) == set("xyz"), state
    assert client.silent(), "a second answer"
    return "one state"


def texts(text):
    def act(port, form):
        client = Client(port).opened()
        client.say(force(client, form, {"x": 0.5, "y": 0, "z": 0}))  # it drives
        client.state()
        client.say(text(client, form) if callable(text) else text)
        return of_state(client), client
    return act


def bytes_of(*frames):
    def act(port, form):
        client = Client(port).opened()
        for each in frames:
            client.send(each(client, form) if callable(each) else each)
        return of_state(client), client
    return act


def http(request):
    def act(port, form):
        client = Client(port)
        client.send(request(port))
        return client.head(), client
    return act


def half_a_frame(port, form):
    client = Client(port).opened()
    client.say(force(client, form, {"x": 1, "y": 0, "z": 0}))
    client.state()
    client.send(frame(TEXT, force(client, form, {"x": 1, "y": 0, "z": 0}))[:40])
    assert client.silent()
    client.socket.close()
    return "nothing", None


def silence(port, form):
    client = Client(port)
    rest = client.head()
    return rest or "closed", None


def ping(port, form):
    client = Client(port).opened()
    client.send(frame(PONG, b"unasked") + frame(PING, b"are you there"))
    assert client.next() == (PONG, b"are you there")
    assert client.silent()
    return "a pong with its bytes; none for a pong", client


def close(port, form):
    client = Client(port).opened()
    client.send(frame(CLOSE, struct.pack(">H", 1000)) + frame(TEXT, "{}"))
    return of_state(client), client


def hundred(port, form):
    time.sleep(1.0)  # clients of rows before have left
    all_ = [Client(port) for _ in range(100)]
    heads = []
    for client in all_:
        try:
            client.send(upgrade(port))
            heads.append(client.head())
        except OSError:
            heads.append("")
    opened = sum(head.startswith("HTTP/1.1 101") for head in heads)
    for client in all_:
        client.socket.close()
    assert opened == 7, heads  # beside the one that looks on
    told = sum(head.startswith("HTTP/1.1 503") for head in heads)
    closed = sum(head == "" for head in heads)
    assert told > 0 and opened + told + closed == 100, heads
    return f"{opened} are served beside one, the others are answered 503 or closed", None


def deaf(port, form):
    client = Client(port, small=True)
    client.send(upgrade(port))
    message = b"".join(frame(TEXT, "{}") for _ in range(100))
    try:
        for _ in range(20000):
            client.send(message)
    except OSError:
        pass
    client.socket.close()
    return "closed", None


def strong(port, form):
    client = Client(port).opened()
    largest = 0.0
    for _ in range(300):
        client.say(force(client, form, {"x": 1e3, "y": 0, "z": 1e6}))
        f = client.state()["current_cursor_force"]
        largest = max(largest, sum(f[k] ** 2 for k in "xyz") ** 0.5)
    assert largest <= 8.0 + 1e-9, largest
    return f"states, at most {largest:.3g} N", client


def pieces(client, form):
    text = force(client, form, {"x": 0, "y": 0, "z": 0}).encode()
    return (frame(TEXT, text[:10], final=False) + frame(PING, b"between") + frame(MORE, text[10:20], final=False) +
            frame(MORE, text[20:]))


def fragmented(port, form):
    client = Client(port).opened()
    for byte in pieces(client, form):
        client.send(bytes([byte]))
    assert client.next() == (PONG, b"between")
    return of_state(client), client


def place(x):
    return lambda c, form: ('{"inverse3":[{"device_id":"%s","commands":{"set_cursor_position":{"%s":{"x":%s,"y":0,"z":0}}}}]}'
                            % (c.device, "position" if form == "vector" else "values", x))


def setting(what):
    return lambda c, form: json.dumps({"inverse3": [{"device_id": c.device, "configure": what}]})


def two(client, form):
    one = {"set_cursor_force": {form: {"x": 1, "y": 0, "z": 0}}}
    return json.dumps({"inverse3": [{"device_id": client.device, "commands": one},
                                    {"device_id": "049D", "commands": {"set_cursor_force": {form: {"x": 1e5, "y": 0, "z": 0}}}}]})


# Name, act, what is to be received, what stands in its line of the log (empty: nothing does).
ROWS = [
    ("half a frame, then silence, then gone", half_a_frame, "nothing", "in the middle of a message"),
    ("a message in three fragments, byte by byte, a ping between", fragmented, "one state", ""),
    ("a pong and a ping", ping, "a pong", ""),
    ("a close frame, and a message after it", close, "closed with 1000", ""),
    ("a text that is not UTF-8", bytes_of(frame(TEXT, b'{"a":"\xff\xfe"}')), "closed with 1007", "not UTF-8"),
    ("a binary message", bytes_of(frame(BINARY, b"{}")), "one state", "message: "),
    ("reserved bits", bytes_of(frame(TEXT, "{}", reserved=0x40)), "closed with 1002", "reserved bits"),
    ("no mask", bytes_of(frame(TEXT, "{}", mask=b"")), "closed with 1002", "not masked"),
    ("an unknown opcode", bytes_of(frame(5, "{}")), "closed with 1002", "unknown opcode"),
    ("a fragment that continues nothing", bytes_of(frame(MORE, "{}")), "closed with 1002", "continues nothing"),
    ("a ping of 200 bytes", bytes_of(frame(PING, b"x" * 200)), "closed with 1002", "control frame"),
    ("2^63 bytes announced", bytes_of(frame(TEXT, announced=1 << 63)), "closed with 1002", "highest bit"),
    ("2^62 bytes announced", bytes_of(frame(TEXT, announced=1 << 62)), "closed with 1009", "too big"),
    ("100 connections at once", hundred, "7 are served", "others are refused"),
    ("GET with a foreign Host", http(lambda p: b"GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n"), "HTTP/1.1 403", "Host"),
    ("upgrade with a foreign Host", http(lambda p: upgrade(p, host="evil.example")), "HTTP/1.1 403", "Host"),
    ("upgrade with a foreign Origin", http(lambda p: upgrade(p, more="Origin: http://evil.example\r\n")), "HTTP/1.1 403", "Origin"),
    ("upgrade with the Origin null", http(lambda p: upgrade(p, more="Origin: null\r\n")), "HTTP/1.1 403", "Origin"),
    ("upgrade with the Host localhost, no port", http(lambda p: upgrade(p, host="localhost")), "HTTP/1.1 101", ""),
    ("upgrade without a key", http(lambda p: upgrade(p, key="")), "HTTP/1.1 400", "Key"),
    ("a body in chunks", http(lambda p: (f"POST /devices HTTP/1.1\r\nHost: localhost:{p}\r\nTransfer-Encoding: chunked"
                                         "\r\n\r\n2\r\n{}\r\n0\r\n\r\n").encode()), "HTTP/1.1 501", "chunks"),
    ("no request: 10 kB of bytes", http(lambda p: bytes(range(1, 251)) * 40), "HTTP/1.1 400", "no request"),
    ("a connection that asks for nothing", silence, "closed", "asks for nothing"),
    ("it reads nothing", deaf, "closed", "does not read"),
    ("1 MN, 1000 N", strong, "states, at most 8 N", ""),
    ("a place at infinity: 1e400", texts(place("1e400")), "one state", "number"),
    ("a place at infinity: Infinity", texts(place("Infinity")), "one state", "message: "),
    ("a place 2 m away", texts(place("2")), "one state", "asks for a place 2 m away"),
    ("a preset that nobody has", texts(setting({"preset": {"preset": "upside_down"}})), "one state", "asks for the preset upside_down; it stays"),
    ("a basis", texts(setting({"basis": {"permutation": "YXZ"}})), "one state", "asks for the basis YXZ; it stays XYZ"),
    ("a force gate", texts(setting({"force_gate": {"gain": 0.3}})), "one state", "asks for a force gate of 0.3; it stays 0"),
    ("a damping", texts(setting({"damping": {"scalar": 2}})), "one state", "asks for a damping of 2"),
    ("a mount", texts(setting({"mount": {"scale": {"x": 2, "y": 2, "z": 2}}})), "one state", "asks for mount, which is not here"),
    ("torques", texts(lambda c, f: commands(c.device, {"set_angular_torques": {}})), "one state", "asks for set_angular_torques, which is not here"),
    ("a force in words", texts(lambda c, f: force(c, f, {"x": "1", "y": "0", "z": "0"})), "one state", "is no number"),
    ("a force that is a list", texts(lambda c, f: force(c, f, [1, 2, 3])), "one state", "is no object"),
    ("a force that is null in z", texts(lambda c, f: force(c, f, {"x": 1, "y": 0, "z": None})), "one state", "has no z"),
    ("two devices, one of them unknown", texts(two), "one state", "not here"),
    ("an unknown device", texts(lambda c, f: commands("049D", {"set_cursor_force": {f: {"x": 9, "y": 9, "z": 9}}})),
     "one state", "not here"),
    ("a device_id that is a number", texts('{"inverse3":[{"device_id":7,"commands":{}}]}'), "one state", "is no text"),
    ("17 devices", texts(json.dumps({"inverse3": [{"device_id": "a"}] * 17})), "one state", "at most 16"),
    ("a key of 60 kB", texts('{"' + "k" * 60000 + '":1}'), "one state", ""),
    ("a key of 30 kB twice", texts('{"' + "k" * 30000 + '":1,"' + "k" * 30000 + '":2}'), "one state", "stands twice"),
    ("60,000 brackets", texts("[" * 60000), "one state", "nested"),
    ("10,000 objects within each other", texts('{"a":' * 10000 + "1" + "}" * 10000), "one state", "nested"),
    ("an empty text", texts(""), "one state", "message: "),
    ("no object", texts("7"), "one state", "no object"),
    ("control characters in its name", texts('{"session":{"configure":{"profile":{"name":"a\\u001b[2Jb"}}}}'), "one state", "not printable"),
]


def main():
    session = sys.argv[2] if len(sys.argv) > 2 else str(ROOT / "configs/hil_omega7.json")
    server = Server(sys.argv[1], session)
    looker = Client(server.port).opened()
    failed = 0
    print("| misbehaviour | format | received | lines of the log |\n| --- | --- | --- | --- |")
    for name, act, expected, line in ROWS:
        rows = {}
        for form in ("vector", "values"):
            before = len(server.lines)
            client = None
            try:
                received, client = act(server.port, form)
            except Closed as closed:
                received = str(closed)
            except (AssertionError, EOFError, OSError, TimeoutError) as error:
                received = f"{type(error).__name__} {error}"
            lines = server.log(before, line)
            if client is not None:
                client.socket.close()
            looker.say("{}")
            looked = of_state(looker)
            own = [l for l in lines if line] if line else [
                l for l in server.lines[before:] if "drives" not in l]
            right = expected in received and looked == "one state" and len(own) == (1 if line else 0)
            right = right and all(len(l) < 400 for l in own)
            failed += not right
            said = " / ".join(l.strip().split(": ", 2)[-1] for l in own)[:120].replace("|", "/") or "-"
            rows[form] = f"{received} | {said} |{'' if right else ' NOT AS EXPECTED: ' + expected}"
            time.sleep(0.05)
        if len(set(rows.values())) == 1:
            rows = {"both": rows["vector"]}
        for form, row in rows.items():
            print(f"| {name} | {form} | {row}", flush=True)
    looker.socket.close()
    print("\n" + server.end())
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
