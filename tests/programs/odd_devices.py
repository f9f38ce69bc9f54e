#!/usr/bin/env python3
"""Devices that are not what they say, under `tpm hil`: prints a Markdown table of what became of each session.

    tests/programs/odd_devices.py BUILD

The devices are plugins, made here of one C source: a hand of 0.4 kg on a spring of 100 N/m that comes down 6 mm, with a
watchdog by the clock. Exit code 1 if a row did not end as expected. Needs a C compiler.
"""
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

PLUGIN = r"""
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <tpmkit/haptic_device.h>
static double period_s = 1e-3, at_m[3], speed[3], seen_m[3], late_N[64][3], last_s, watchdog_s;
static int on, real_time, ran_out;
static long reads, writes;
static double number(const char *name, double otherwise) {
  const char *text = getenv(name);
  return text == NULL ? otherwise : atof(text);
}
static double now_s(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
static int count(char *message) { (void)message; return 1; }
static int describe(int index, tpm_device_description *d, char *message) {
  (void)index, (void)message;
  snprintf(d->name, sizeof d->name, "odd hand");
  snprintf(d->serial, sizeof d->serial, "1");
  d->hardware = (int)number("ODD_HARDWARE", 0);
  d->limits = (tpm_device_limits){.force_N = 10, .reach_m = 0.075, .stiffness_N_per_m = 4000, .damping_N_s_per_m = 20,
    .slew_N_per_s = 1000, .least_ramp_in_s = 0.1, .friction_N_s_per_m = number("ODD_SAYS_FRICTION", 0.2),
    .delay_periods = (int)number("ODD_SAYS_DELAY", 0)};
  return TPM_DEVICE_OK;
}
static int open_device(int index, void **device, char *message) {
  static int it;
  (void)index, (void)message;
  *device = &it;
  at_m[2] = 3e-3;
  return TPM_DEVICE_OK;
}
static int prepare(void *device, const tpm_device_preparation *p, char *message) {
  (void)device, (void)message;
  period_s = p->period_s, watchdog_s = p->watchdog_s, real_time = p->real_time != 0;
  return TPM_DEVICE_OK;
}
static int enable(void *device, char *message) {
  (void)device, (void)message;
  last_s = now_s(), on = 1;
  return TPM_DEVICE_OK;
}
static void look(void) {
  if (!real_time || !on || now_s() - last_s < watchdog_s) return;
  on = 0, ran_out = 1;
}
static int read_position(void *device, double p[3]) {
  (void)device;
  const int parts = 20, delay = (int)number("ODD_DELAY", 0);
  const double mass = 0.4, hand = number("ODD_HAND", 100), damper = number("ODD_FRICTION", 0.2) + number("ODD_ARM", 3);
  const double t = (double)reads * period_s, down = t < 1 ? 0 : t > 2 ? 1 : t - 1;
  const double *force = late_N[(writes + 63 - delay) % 64];
  for (int i = 0; i < parts; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double goal = k == 2 ? 3e-3 - 6e-3 * down : 0;
      speed[k] += (force[k] * on - hand * (at_m[k] - (hand > 0 ? goal : 0)) - damper * speed[k]) / mass * period_s / parts;
      at_m[k] += speed[k] * period_s / parts;
    }
  }
  const long from = (long)number("ODD_FROM", 1800), lasts = (long)number("ODD_LASTS", 0);
  const int now = reads >= from && reads < from + lasts;
  ++reads;
  const char *fault = getenv("ODD_FAULT");
  if (fault != NULL && now && !strcmp(fault, "nan")) { p[0] = p[1] = p[2] = nan(""); return TPM_DEVICE_OK; }
  if (fault == NULL || !now) for (int k = 0; k < 3; ++k) seen_m[k] = 1e-5 * round(1e5 * at_m[k]);
  memcpy(p, seen_m, sizeof seen_m);
  return fault != NULL && now && !strcmp(fault, "old") ? TPM_DEVICE_OLD_VALUE : TPM_DEVICE_OK;
}
static int write_force(void *device, const double force_N[3]) {
  (void)device;
  look();
  if (!on) return TPM_DEVICE_FAILED;
  last_s = now_s();
  memcpy(late_N[writes++ % 64], force_N, 3 * sizeof(double));
  return TPM_DEVICE_OK;
}
static int status(void *device, tpm_device_status *s) {
  (void)device;
  look();
  s->forces_off = on ? TPM_DEVICE_FORCES_ON : ran_out ? TPM_DEVICE_OFF_WATCHDOG : TPM_DEVICE_OFF_SOFTWARE;
  return TPM_DEVICE_OK;
}
static void stop(void *device) { (void)device; memset(late_N, 0, sizeof late_N); on = 0; }
static void close_device(void *device) { (void)device; }
static const tpm_device_plugin plugin = {.size = sizeof(tpm_device_plugin), .version = TPM_DEVICE_PLUGIN_VERSION,
  .name = "odd 1", .count = count, .describe = describe, .open = open_device, .prepare = prepare, .read = read_position,
  .write = write_force, .status = status, .hand = NULL, .stop = stop, .cut_forces = stop, .close = close_device,
  .enable_forces = enable};
/* Time passes in its calls: a test may drive it in virtual time, also where it says that it has motors. */
__attribute__((visibility("default"))) int tpm_stand_in_without_clock(void) { return 1; }
__attribute__((visibility("default"))) const tpm_device_plugin *tpm_device_plugin_get(void) { return &plugin; }
"""


def session(stiffness_N_per_m):
    """A law of that stiffness, 3 mm deep."""
    return {"title": "odd", "model": {"kind": "law", "law": {
        "law": "linear", "drive": "indentation_depth", "response": "contact_force", "reference_m": 0.003, "fitted_to_m": 0.004,
        "parameters": {"k_inf_N_per_m": stiffness_N_per_m}, "provenance": "assumed"}},
        "surface": ["0 mm", "0 mm", "0 mm"], "limits": {"late_cycles": 1000},
        "indentations": {"depths": ["3 mm"], "rates": ["3 mm/s"], "hold": "2 s", "rest": "0.5 s"}}


# What is odd, environment, stiffness in N/m, options, what its last words or its answer must hold.
REAL, VIRTUAL = ["--clock", "real"], ["--clock", "virtual"]
ROWS = [
    ("nothing: a watchdog of 8 ms by the clock", {}, 150, REAL, "end: finished"),
    ("hardware that nobody has measured", {"ODD_HARDWARE": "1"}, 150, REAL, "not measured on this device"),
    ("the same, with a soft tissue", {"ODD_HARDWARE": "1"}, 40, REAL, "end: finished"),
    ("`hardware` is 7", {"ODD_HARDWARE": "7"}, 150, REAL, "not measured on this device"),
    ("it says 100 N s/m of friction", {"ODD_SAYS_FRICTION": "100"}, 150, VIRTUAL, "friction_N_s_per_m is 100"),
    ("it says a negative friction", {"ODD_SAYS_FRICTION": "-1"}, 150, VIRTUAL, "friction_N_s_per_m is -1"),
    ("hardware says 5 N s/m of friction, nobody measured it", {"ODD_HARDWARE": "1", "ODD_SAYS_FRICTION": "5"}, 150, VIRTUAL,
     "friction 0 N s/m"),
    ("its forces are 10 ms late, it says 0", {"ODD_DELAY": "10", "ODD_ARM": "0.5"}, 380, VIRTUAL,
     "stopped: oscillation|stopped: energy"),
    ("the same, and it says 2 N s/m of friction", {"ODD_DELAY": "10", "ODD_ARM": "0.5", "ODD_SAYS_FRICTION": "2"}, 1000, VIRTUAL,
     "stopped: oscillation|stopped: energy"),
    ("its forces are 10 ms late, and it says so", {"ODD_DELAY": "10", "ODD_SAYS_DELAY": "10"}, 380, VIRTUAL, "refused|receive energy|unstable"),
    ("old positions for 15 ms", {"ODD_FAULT": "old", "ODD_LASTS": "15"}, 150, VIRTUAL, "end: finished"),
    ("old positions for 25 ms", {"ODD_FAULT": "old", "ODD_LASTS": "25"}, 150, VIRTUAL, "communication error"),
    ("positions that stand still for 20 ms, said to be new", {"ODD_FAULT": "still", "ODD_LASTS": "20"}, 150, VIRTUAL, "end: finished"),
    ("a position that is no number, once", {"ODD_FAULT": "nan", "ODD_LASTS": "1"}, 150, VIRTUAL, "position not finite"),
]


def main():
    build = Path(sys.argv[1]).resolve()
    tpm = str(build / "tpm")
    failed = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "p.c").write_text(PLUGIN)
        subprocess.run(["cc", "-std=c11", "-O2", "-shared", "-fPIC", f"-I{ROOT / 'include'}", folder / "p.c", "-o", folder / "odd.so",
                        "-lm"], check=True)
        plugin = ["--device", "plugin", "--plugin", str(folder / "odd.so")]
        plain = {k: v for k, v in os.environ.items() if not k.startswith("ODD_")}

        def row(what, words, environment, expected):
            nonlocal failed
            # By the clock other programs can stall a session, which is then ended by its watchdog.
            tries, most = 0, 10 if "real" in words else 1
            hits = []
            while not hits and tries < most:
                tries += 1
                done = subprocess.run([tpm, "hil", *words], env={**plain, **environment}, text=True, capture_output=True,
                                      stdin=subprocess.DEVNULL)
                said = (done.stderr + done.stdout).replace(str(folder) + "/", "").splitlines()
                hits = [l for l in said if any(e in l for e in expected.split("|"))]
                said = [l for l in said if "stopped" in l] or said
            failed += not hits
            shown = (hits or said or ["-"])[0].removeprefix("tpm: ").replace("|", "/")
            shown = shown if len(shown) <= 160 else shown[:157] + "..."
            print(f"| {what} | {done.returncode} | {shown} | {tries} |{'' if hits else ' NOT AS EXPECTED: ' + expected}", flush=True)

        print("| device | exit code | words of tpm | tries |\n| --- | --- | --- | --- |")
        for what, environment, stiffness, options, expected in ROWS:
            (folder / "s.json").write_text(json.dumps(session(stiffness)))
            row(f"{what}; {stiffness} N/m", ["run", str(folder / "s.json"), *plugin, *options, "-o", str(folder / "r.tpmrec"),
                                             "--overwrite"], environment, expected)
        # Measured: its hand lets go, and its delay is found without being told.
        late = {"ODD_HARDWARE": "1", "ODD_DELAY": "10"}
        file = str(folder / "odd.json")
        row("hardware, 10 ms late, is identified", ["identify", *plugin, "--duration", "8 s", "--clock", "virtual", "-o", file],
            {**late, "ODD_HAND": "0", "ODD_ARM": "0"}, "delay       10|delay       9.|delay       10.")
        for stiffness, expected in ((40, "end: "), (380, "receive energy|unstable")):
            (folder / "s.json").write_text(json.dumps(session(stiffness)))
            row(f"the same with its file; {stiffness} N/m", ["run", str(folder / "s.json"), *plugin, "--device-file", file, "--clock",
                                                            "virtual", "-o", str(folder / "r.tpmrec"), "--overwrite"], late, expected)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
