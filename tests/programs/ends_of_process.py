#!/usr/bin/env python3
"""However `tpm hil run` ends, forces go off: prints a Markdown table of ends and of what the device saw.

    tests/programs/ends_of_process.py BUILD [SESSION]

A session in real time receives each signal 0.3 s after forces are on, on the stand-in for the vendor's library
(BUILD/tests/stand_in_dhd) and on a device plugin. The plugin also crashes, exits and throws by itself in a call that
writes a force. The log is the device's own; of a process that a signal stops it is read while the process is stopped.
Exit code 1 if forces stay on where they need not: only SIGKILL leaves no time. Needs a C compiler.
"""
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OFF = ("forces_off", "cut_forces", "stop")
STOPS = (signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU)

PLUGIN = r"""
#define tpm_device_plugin_get example_get
#include "EXAMPLE"
#undef tpm_device_plugin_get
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>
void throw_it(void);
static int writes;
static void note(const char *what) {  /* as a signal handler may */
  const char *file = getenv("TPM_ENDS_LOG");
  FILE *f = fopen(file, "a");
  fprintf(f, "%s 0\n", what);
  fclose(f);
}
static int on(void *device, char *message) { note("thread_of_forces_on"); return enable_forces(device, message); }
static int ending_write(void *device, const double force_N[3]) {
  const char *end = getenv("TPM_ENDS_BY");
  if (end != NULL && ++writes == 1000) {
    if (!strcmp(end, "segv")) raise(SIGSEGV);
    if (!strcmp(end, "abort")) abort();
    if (!strcmp(end, "exit")) exit(3);
    if (!strcmp(end, "throw")) throw_it();
  }
  return write_force(device, force_N);
}
static void noted_stop(void *device) { note("stop"); stop(device); }
static void noted_cut(void *device) { note("cut_forces"); stop(device); }
static void noted_close(void *device) { note("close"); close_device(device); }
__attribute__((visibility("default"))) const tpm_device_plugin *tpm_device_plugin_get(void) {
  static tpm_device_plugin p;
  p = plugin;
  p.enable_forces = on; p.write = ending_write; p.stop = noted_stop; p.cut_forces = noted_cut; p.close = noted_close;
  return &p;
}
"""


def made_plugin(folder):
    (folder / "p.c").write_text(PLUGIN.replace("EXAMPLE", str(ROOT / "examples/device_plugin.c")))
    (folder / "t.cpp").write_text('#include <stdexcept>\nextern "C" void throw_it(void);\n'
                                  'void throw_it(void) { throw std::runtime_error("thrown by the plugin"); }\n')
    include = f"-I{ROOT / 'include'}"
    run = lambda *words: subprocess.run(words, check=True)
    run("cc", "-fPIC", "-fexceptions", include, "-c", folder / "p.c", "-o", folder / "p.o")
    run("c++", "-fPIC", "-c", folder / "t.cpp", "-o", folder / "t.o")
    run("c++", "-shared", folder / "p.o", folder / "t.o", "-lm", "-o", folder / "p.so")
    return folder / "p.so"


def events_of(log):
    return [line.split()[0] for line in log.read_text().splitlines() if line] if log.exists() else []


def ended(command, environment, log, send, switched_on):
    """Exit code, events after the end began, last words of tpm. `switched_on`: how often forces go on until then.

    None where the program ended before: on a machine that stalls, the check of a second refuses the session, or the session
    itself ends."""
    log.unlink(missing_ok=True)
    # Signals that stop a process do so in a group that somebody looks after: its parent, from another one.
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                               text=True, stdin=subprocess.DEVNULL,
                               preexec_fn=os.setpgrp if send in STOPS else None)
    until = time.monotonic() + 300
    while (events_of(log).count("thread_of_forces_on") < switched_on and process.poll() is None
           and time.monotonic() < until):
        time.sleep(0.01)
    if events_of(log).count("thread_of_forces_on") < switched_on:
        process.communicate(timeout=600)
        return None
    before = len(events_of(log))
    if send is not None:
        time.sleep(0.3)
        if set(events_of(log)[before:]) & set(OFF):  # a stall ended it before
            process.communicate(timeout=600)
            return None
        before = len(events_of(log))
        process.send_signal(send)
        if send in (signal.SIGPIPE, signal.SIGXFSZ):
            time.sleep(0.5)
            if process.poll() is None and not set(events_of(log)[before:]) & set(OFF):
                process.send_signal(signal.SIGINT)
                process.communicate()
                return None, [], "the session goes on"
    events = None
    if send in STOPS:
        os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WEXITED | os.WNOWAIT)
        events = events_of(log)[before:]  # while it is stopped
        process.send_signal(signal.SIGCONT)
    words = process.communicate(timeout=600)[1].strip().splitlines()
    code = process.returncode
    events = [e for e in (events_of(log)[before:] if events is None else events) if e in OFF + ("close",)]
    return 128 - code if code < 0 else code, events, words[-1] if words else "-"


def main():
    build = Path(sys.argv[1]).resolve()
    failed = False
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        session = json.loads(Path(sys.argv[2] if len(sys.argv) > 2 else ROOT / "configs/hil_omega7.json").read_text())
        session["limits"] = {**session.get("limits", {}), "watchdog": "16 ms", "cycle_timeout": "1 s", "late_cycles": 1000}
        session["indentations"] = {"depths": ["4 mm"], "rates": ["2 mm/s"], "hold": "5 s", "rest": "1 s"}
        session.pop("creep", None)
        session["surface"] = ["0 mm", "0 mm", "-5 mm"]  # the hand rests above it
        (folder / "s.json").write_text(json.dumps(session))
        (folder / "script").write_text(f"watchdog_by_clock 0\nevents {folder / 'log'}\n")
        log = folder / "log"
        environment = {**os.environ, "TPM_STAND_IN_SCRIPT": str(folder / "script"), "TPM_ENDS_LOG": str(log)}
        run = [str(build / "tpm"), "hil", "run", str(folder / "s.json"), "-o", str(folder / "r.tpmrec"), "--overwrite",
               "--clock", "real"]
        stand_in = run + ["--device", "omega7", "--dhd-library", str(build / "tests/stand_in_dhd/libstand_in_dhd_whole.so"),
                          "--device-file", str(ROOT / "tests/fixtures/stand_in_device.json")]
        plugin = run + ["--device", "plugin", "--plugin", str(made_plugin(folder))]
        print("| device | end | exit code | log of the device after it | last words of tpm |\n| --- | --- | --- | --- | --- |")
        # On the stand-in forces go on twice: the check of a second, and the session.
        tries = [("stand-in", stand_in, s, None) for s in
                 ("SIGHUP", "SIGQUIT", "SIGINT", "SIGTERM", "SIGUSR1", "SIGRTMIN", "SIGRTMAX", "SIGTSTP",
                  "SIGTTIN", "SIGTTOU", "SIGPIPE", "SIGXFSZ", "SIGSEGV", "SIGABRT", "SIGKILL")]
        tries += [("plugin", plugin, s, None) for s in ("SIGHUP", "SIGQUIT", "SIGPIPE", "SIGSEGV")]
        tries += [("plugin", plugin, None, end) for end in ("segv", "abort", "exit", "throw")]
        words = {"segv": "crashes in a call", "abort": "calls abort()", "exit": "calls exit(3)",
                 "throw": "throws an exception"}
        for device, command, name_of_signal, by in tries:
            own = {**environment, **({"TPM_ENDS_BY": by} if by else {})}
            send = getattr(signal, name_of_signal) if name_of_signal else None
            seen = None
            for _ in range(10):
                seen = seen or ended(command, own, log, send, 2 if device == "stand-in" else 1)
            if seen is None:
                sys.exit(f"{device}, {name_of_signal or words[by]}: no session of ten began; the machine is too busy")
            code, events, said = seen
            ok = code is None or name_of_signal == "SIGKILL" or any(e in OFF for e in events)
            failed |= not ok or code == 128  # 128 and no signal
            print(f"| {device} | {name_of_signal or words[by]} | {'-' if code is None else code} | "
                  f"{' '.join(events) or ('-' if code is None else 'nothing')} | "
                  f"{said.replace(str(folder) + '/', '').replace('|', '/')[:110]} |{'' if ok else ' FORCES STAY ON'}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
