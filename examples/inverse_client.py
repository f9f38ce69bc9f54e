#!/usr/bin/env python3
"""A client of the Inverse service, or of `tpm hil serve`, in plain Python: pushes the hand with 0.5 N and prints it.

    tpm hil serve configs/hil_omega7.json &
    python3 examples/inverse_client.py --port 10001 --messages 1000
"""
import argparse, base64, json, os, socket

parser = argparse.ArgumentParser()
parser.add_argument("--port", type=int, default=10001)
parser.add_argument("--messages", type=int, default=1000)
parser.add_argument("--format", choices=["vector", "values"], default="vector", help="of a force: values before version 3.5")
options = parser.parse_args()

link = socket.create_connection(("127.0.0.1", options.port), timeout=5)
link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
key = base64.b64encode(os.urandom(16)).decode()
link.sendall((f"GET / HTTP/1.1\r\nHost: localhost:{options.port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
              f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n").encode())
stream = link.makefile("rb")
assert b" 101 " in b"".join(iter(stream.readline, b"\r\n"))

def receive():  # a text of one frame, not masked
    size = stream.read(2)[1]
    size = int.from_bytes(stream.read(2 if size == 126 else 8), "big") if size > 125 else size
    return json.loads(stream.read(size))

def send(message):  # a text of one frame, masked
    text, mask = json.dumps(message).encode(), os.urandom(4)
    size = bytes([0x80 | len(text)]) if len(text) < 126 else bytes([0x80 | 126]) + len(text).to_bytes(2, "big")
    link.sendall(b"\x81" + size + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(text)))

device = receive()["inverse3"][0]
print(device["device_id"], device["config"].get("simulated_device", "hardware"))
for i in range(options.messages):  # a state comes for each message, none without
    force = {options.format: {"x": 0.5, "y": 0, "z": 0}}
    send({"inverse3": [{"device_id": device["device_id"], "commands": {"set_cursor_force": force}}]})
    state = receive()["inverse3"][0]["state"]
print("position", state["cursor_position"], "m; force", state["current_cursor_force"], "N")
