/* A haptic device of one's own as a plugin of tpm:
 *
 *     cc -shared -fPIC -I include examples/device_plugin.c -o device_plugin.so
 *     tpm hil devices --plugin ./device_plugin.so
 *
 * prints
 *
 *     ./device_plugin.so: example 1
 *     0        spring hand, SIMULATED DEVICE: --device plugin --index 0
 *              at most 10 N, 75 mm from the centre, 4000 N/m; friction 0.1 N s/m, 0 periods late
 *
 * The device is simulated: a hand without mass on a spring of 400 N/m that is moved down at 2 mm/s after
 * half a second, by 8 mm. Replace the bodies of read and write by the calls of your device.
 */
#define _POSIX_C_SOURCE 200809L /* clock_gettime */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <tpmkit/haptic_device.h>

static struct {
  double period_s, time_s, force_N[3], max_force_N, watchdog_s, last_command_s;
  int open, forces_on, real_time, watchdog_ran_out;
} hand;

static double now_s(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Forces go off when no command came in time. Your device does this in its electronics. */
static void look_at_watchdog(void) {
  if (!hand.real_time || !hand.forces_on) return;
  if (now_s() - hand.last_command_s < hand.watchdog_s) return;
  hand.forces_on = 0;
  hand.watchdog_ran_out = 1;
  memset(hand.force_N, 0, sizeof hand.force_N);
}

static int count(char *message) {
  (void)message;
  return 1;
}

static int describe(int index, tpm_device_description *d, char *message) {
  if (index != 0) {
    snprintf(message, TPM_DEVICE_MESSAGE, "there is one device, of index 0");
    return TPM_DEVICE_FAILED;
  }
  snprintf(d->name, sizeof d->name, "spring hand");
  snprintf(d->serial, sizeof d->serial, "1");
  snprintf(d->assumptions, sizeof d->assumptions, "the hand is a spring of 400 N/m without mass");
  d->hardware = 0;
  d->limits = (tpm_device_limits){.force_N = 10.0, .reach_m = 0.075, .stiffness_N_per_m = 4000.0,
                                  .damping_N_s_per_m = 20.0, .slew_N_per_s = 1000.0,
                                  .least_ramp_in_s = 0.1, .friction_N_s_per_m = 0.1, .delay_periods = 0};
  return TPM_DEVICE_OK;
}

static int open_device(int index, void **device, char *message) {
  if (index != 0 || hand.open) {
    snprintf(message, TPM_DEVICE_MESSAGE, "the device is open already");
    return TPM_DEVICE_FAILED;
  }
  memset(&hand, 0, sizeof hand);
  hand.open = 1;
  *device = &hand;
  return TPM_DEVICE_OK;
}

static int prepare(void *device, const tpm_device_preparation *p, char *message) {
  (void)device, (void)message;
  hand.period_s = p->period_s;
  hand.max_force_N = p->max_force_N;
  hand.watchdog_s = p->watchdog_s;
  hand.real_time = p->real_time != 0;
  return TPM_DEVICE_OK;
}

static int enable_forces(void *device, char *message) {
  (void)device, (void)message;
  hand.last_command_s = now_s();
  hand.forces_on = 1;
  return TPM_DEVICE_OK;
}

static int read_position(void *device, double position_m[3]) {
  (void)device;
  const double moving_s = hand.time_s < 0.5 ? 0.0 : hand.time_s > 4.5 ? 4.0 : hand.time_s - 0.5;
  position_m[0] = hand.force_N[0] / 400.0;
  position_m[1] = hand.force_N[1] / 400.0;
  position_m[2] = 2e-3 - 2e-3 * moving_s + hand.force_N[2] / 400.0;
  hand.time_s += hand.period_s;
  return TPM_DEVICE_OK;
}

static int write_force(void *device, const double force_N[3]) {
  (void)device;
  look_at_watchdog();
  if (!hand.forces_on) return TPM_DEVICE_FAILED;
  hand.last_command_s = now_s();
  const double size = sqrt(force_N[0] * force_N[0] + force_N[1] * force_N[1] + force_N[2] * force_N[2]);
  const double part = size > hand.max_force_N ? hand.max_force_N / size : 1.0;
  for (int k = 0; k < 3; ++k) hand.force_N[k] = part * force_N[k];
  return part < 1.0 ? TPM_DEVICE_SATURATED : TPM_DEVICE_OK;
}

static int status(void *device, tpm_device_status *s) {
  (void)device;
  look_at_watchdog();
  s->forces_off = hand.forces_on          ? TPM_DEVICE_FORCES_ON
                  : hand.watchdog_ran_out ? TPM_DEVICE_OFF_WATCHDOG
                                          : TPM_DEVICE_OFF_SOFTWARE;
  return TPM_DEVICE_OK;
}

static void stop(void *device) {
  (void)device;
  memset(hand.force_N, 0, sizeof hand.force_N);
  hand.forces_on = 0;
}

static void close_device(void *device) {
  (void)device;
  hand.open = 0;
}

static const tpm_device_plugin plugin = {
    .size = sizeof(tpm_device_plugin), .version = TPM_DEVICE_PLUGIN_VERSION, .name = "example 1",
    .count = count, .describe = describe, .open = open_device, .prepare = prepare,
    .read = read_position, .write = write_force, .status = status, .hand = NULL, .stop = stop,
    .cut_forces = stop, .close = close_device, .enable_forces = enable_forces};

__attribute__((visibility("default"))) const tpm_device_plugin *tpm_device_plugin_get(void) {
  return &plugin;
}
