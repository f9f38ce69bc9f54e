/* A haptic loop in C on the paper's liver: `haptic_loop configs/hil_liver.json` prints
 *
 *   model: condensed: 424 spheres seen from sphere 71
 *   largest force 0.2292 N at 4.000 mm, of 5000 steps
 *   a step: p50 0.25 us, p99 0.50 us, largest 25.25 us
 *
 * (times differ between machines). There is no device here: the tool follows a line, down at 4 mm/s
 * to a depth of 4 mm, and stays there. Put the calls of your device where it says so, and name the
 * file that `tpm hil identify` wrote of it: `haptic_loop SESSION_OR_LAW device.json`.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <tpmkit/haptics.h>

enum { STEPS = 5000 };

static double now_us(void) {
  struct timespec t;
  timespec_get(&t, TIME_UTC);
  return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

static int by_size(const void* a, const void* b) {
  const double x = *(const double*)a, y = *(const double*)b;
  return (x > y) - (x < y);
}

/* Depth of the tool below the surface: at rest in the air for 0.5 s, then down. */
static double depth_m(double time_s) {
  const double air = -2e-3, speed = 4e-3, deepest = 4e-3;
  const double depth = air + speed * (time_s > 0.5 ? time_s - 0.5 : 0.0);
  return depth < deepest ? depth : deepest;
}

int main(int argc, char** argv) {
  static double took_us[STEPS];
  char why[TPM_HAPTICS_MESSAGE];
  tpm_haptics_contact* contact;
  tpm_haptics_info info = TPM_HAPTICS_INFO_INIT;
  tpm_haptics_state state = TPM_HAPTICS_STATE_INIT;
  double largest_N = 0.0, at_m = 0.0;

  if (argc != 2 && argc != 3) {
    fprintf(stderr, "haptic_loop SESSION_OR_LAW [DEVICE_FILE]\n");
    return TPM_HAPTICS_USAGE;
  }
  tpm_haptics_options options = TPM_HAPTICS_OPTIONS_INIT;
  if (argc == 3) {
    options.device_file = argv[2];
  } else {
    strcpy(options.device, "virtual"); /* nothing has motors here */
  }
  const int opened = tpm_haptics_open(argv[1], &options, &contact, why, sizeof why);
  if (opened != TPM_HAPTICS_OK) {
    fprintf(stderr, "haptic_loop: %s\n", why);
    return opened;
  }
  tpm_haptics_get_info(contact, &info);
  printf("model: %s\n", info.model);

  for (int i = 0; i < STEPS; ++i) {
    const double depth = depth_m(i * info.period_s);
    double position_m[3], force_N[3]; /* here: read the position from your device */
    for (int k = 0; k < 3; ++k) position_m[k] = info.surface_m[k] + depth * info.push[k];
    const double begin_us = now_us();
    const double t_s = i * info.period_s; /* here: CLOCK_MONOTONIC when the position was read */
    const int answer = tpm_haptics_step_at(contact, t_s, position_m, force_N);
    took_us[i] = now_us() - begin_us; /* here: send the force to your device */
    tpm_haptics_get_state(contact, &state);
    if (answer != TPM_HAPTICS_OK) break;
    const double push_back_N =
        -(force_N[0] * info.push[0] + force_N[1] * info.push[1] + force_N[2] * info.push[2]);
    if (push_back_N > largest_N) largest_N = push_back_N, at_m = depth;
  }
  tpm_haptics_close(contact);
  if (state.cause != TPM_HAPTICS_RUNNING) {
    fprintf(stderr, "haptic_loop: stopped: %s\n", tpm_haptics_cause_text(state.cause));
    return TPM_HAPTICS_STOPPED;
  }
  qsort(took_us, STEPS, sizeof took_us[0], by_size);
  printf("largest force %.4f N at %.3f mm, of %d steps\n", largest_N, 1e3 * at_m, STEPS);
  printf("a step: p50 %.2f us, p99 %.2f us, largest %.2f us\n", took_us[STEPS / 2],
         took_us[STEPS * 99 / 100], took_us[STEPS - 1]);
  return 0;
}
