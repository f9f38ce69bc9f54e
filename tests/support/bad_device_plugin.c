/* A plugin that is wrong in the one way that $TPM_BAD_PLUGIN says, for test_plugin_device.cpp. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tpmkit/haptic_device.h>

static int is(const char *way) {
  const char *said = getenv("TPM_BAD_PLUGIN");
  return said != NULL && strcmp(said, way) == 0;
}

static int count(char *message) {
  if (is("count")) {
    snprintf(message, TPM_DEVICE_MESSAGE, "the bus is\ndown");
    return -1;
  }
  return is("none") ? 0 : is("two") ? 2 : 1;
}

static int describe(int index, tpm_device_description *d, char *message) {
  (void)index, (void)message;
  if (is("describe")) return TPM_DEVICE_FAILED;
  snprintf(d->name, sizeof d->name, "bad");
  d->hardware = is("hardware") ? 1 : 0;
  d->limits.force_N = is("force") ? NAN : 10.0;
  d->limits.reach_m = 0.075;
  d->limits.stiffness_N_per_m = 4000.0;
  d->limits.slew_N_per_s = 1000.0;
  d->limits.least_ramp_in_s = is("ramp") ? 0.0 : 0.1;
  d->limits.friction_N_s_per_m = is("friction") ? 10.1 : 0.1;
  return TPM_DEVICE_OK;
}

static int open_device(int index, void **device, char *message) {
  (void)index, (void)device, (void)message;
  return TPM_DEVICE_FAILED;
}
static int prepare(void *d, const tpm_device_preparation *p, char *message) {
  (void)d, (void)p, (void)message;
  return TPM_DEVICE_FAILED;
}
static int read_position(void *d, double position_m[3]) {
  (void)d, (void)position_m;
  return TPM_DEVICE_FAILED;
}
static int write_force(void *d, const double force_N[3]) {
  (void)d, (void)force_N;
  return TPM_DEVICE_FAILED;
}
static int status(void *d, tpm_device_status *s) {
  (void)d, (void)s;
  return TPM_DEVICE_FAILED;
}
static void stop(void *d) { (void)d; }

const tpm_device_plugin *tpm_device_plugin_get(void) {
  static tpm_device_plugin plugin;
  memset(&plugin, 0, sizeof plugin);
  plugin.size = is("size") ? 8 : sizeof plugin;
  plugin.version = is("version") ? 2 : TPM_DEVICE_PLUGIN_VERSION;
  plugin.name = "bad";
  plugin.count = count;
  plugin.describe = describe;
  plugin.open = open_device;
  plugin.prepare = prepare;
  plugin.read = is("missing") ? NULL : read_position;
  plugin.write = write_force;
  plugin.status = status;
  plugin.stop = stop;
  plugin.cut_forces = is("missing") ? NULL : stop;
  plugin.close = stop;
  return is("nothing") ? NULL : &plugin;
}
