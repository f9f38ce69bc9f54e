/* tpmkit/haptic_device.h: a haptic device of your own, as a plugin of the program `tpm`.
 *
 * A plugin is a shared library that exports one function,
 *
 *     const tpm_device_plugin *tpm_device_plugin_get(void);
 *
 * and is tried and used so:
 *
 *     tpm hil devices --plugin ./my_device.so
 *     tpm hil run session.json --device plugin --plugin ./my_device.so
 *
 * Units are SI. One thread uses an open device; cut_forces alone may be called from another. read,
 * write, status, hand, stop and cut_forces are called in the servo loop: they must not allocate, lock,
 * throw, or wait for longer than a fraction of a period. Positions and forces are in the coordinates of
 * the device; forces act on the hand.
 *
 * Functions return a tpm_device_answer. Those with `message` write one line of text with the fault and
 * its remedy; they are not called in the loop.
 */
#ifndef TPMKIT_HAPTIC_DEVICE_H
#define TPMKIT_HAPTIC_DEVICE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Version of the structs below; the first member of each is its size, the second this version. */
#define TPM_DEVICE_PLUGIN_VERSION 1u
/** Room of every message, with the closing 0. */
#define TPM_DEVICE_MESSAGE 256

enum tpm_device_answer {
  TPM_DEVICE_OK = 0,
  TPM_DEVICE_FAILED = 1,    /**< status, or the message, says why */
  TPM_DEVICE_OLD_VALUE = 2, /**< read: the position is that of an earlier call. Counted, no error */
  TPM_DEVICE_SATURATED = 3  /**< write: the motors clipped the force. Counted, no error */
};

/** Why forces are off: tpm_device_status.forces_off. */
enum tpm_device_forces_off {
  TPM_DEVICE_FORCES_ON = 0,
  TPM_DEVICE_OFF_BUTTON = 1,
  TPM_DEVICE_OFF_VELOCITY = 2,
  TPM_DEVICE_OFF_WATCHDOG = 3,
  TPM_DEVICE_OFF_SOFTWARE = 4,
  TPM_DEVICE_OFF_UNPLUGGED = 5,
  TPM_DEVICE_OFF_DEAD_MAN = 6
};

/** Limits of the device. A session that exceeds them is refused. State measured values; list assumed
 * ones in `assumptions`. */
typedef struct tpm_device_limits {
  double force_N;            /**< > 0, at most 50 */
  double reach_m;            /**< radius of the workspace, > 0, at most 1 */
  double stiffness_N_per_m;  /**< largest that may be rendered, > 0 */
  double damping_N_s_per_m;  /**< largest that may be rendered, >= 0 */
  double slew_N_per_s;       /**< largest rise of the force, > 0 */
  double least_ramp_in_s;    /**< forces grow to their limit over at least so long, >= 0.1 */
  double friction_N_s_per_m; /**< least viscous friction of the device, 0 to 10; passivity relies on it */
  int32_t delay_periods;     /**< from a command to its force, >= 0 */
} tpm_device_limits;

/** One device that can be opened. Texts end with 0; `serial` and `firmware` may be empty. */
typedef struct tpm_device_description {
  uint32_t size;
  uint32_t version;
  char name[64];          /**< as its maker writes it */
  char serial[32];
  char firmware[32];
  char assumptions[512];  /**< numbers that nobody has measured, one line each; may be empty */
  uint32_t hardware;      /**< 1: it has motors and encoders; 0: it is simulated */
  uint32_t has_gripper;
  tpm_device_limits limits;
} tpm_device_description;

/** Settings of the device before a session. */
typedef struct tpm_device_preparation {
  uint32_t size;
  uint32_t version;
  double period_s;     /**< of the loop */
  double max_force_N;  /**< the device must never be asked for more */
  double watchdog_s;   /**< cut the forces after this time without a command */
  uint32_t may_move;   /**< 1: the device may move by itself to initialise */
  uint32_t real_time;  /**< 1: the loop keeps the clock, always for a device that says `hardware`; 0: its cycles
                            follow each other without waiting, and a simulated device must not count the time of
                            the clock */
} tpm_device_preparation;

typedef struct tpm_device_status {
  uint32_t size;
  uint32_t version;
  int32_t forces_off;  /**< tpm_device_forces_off */
  int32_t error;       /**< of your library, 0: none */
  char error_text[64];
} tpm_device_status;

typedef struct tpm_device_hand {
  uint32_t size;
  uint32_t version;
  float gripper_m;   /**< opening; NaN: there is none */
  uint32_t buttons;  /**< a bit for each that is pressed */
  float grip[4];     /**< orientation of the grip, a unit quaternion w, x, y, z; NaN, as it is handed over: none */
} tpm_device_hand;

/** The functions of a plugin. All are required except hand and enable_forces. Members are added at
 * the end only; a plugin that was compiled before one was added states a smaller size. */
typedef struct tpm_device_plugin {
  uint32_t size;
  uint32_t version;
  const char *name;  /**< of the plugin, with its version */
  /** Number of devices present; below 0: unknown, the message states why. */
  int (*count)(char *message);
  /** Describes one of them without opening it. */
  int (*describe)(int index, tpm_device_description *description, char *message);
  /** Opens one of them; forces are off. */
  int (*open)(int index, void **device, char *message);
  /** Initialises it; forces stay off. A plugin without enable_forces switches them on here, at zero, and is
   * then prepared as the last thing before the loop. */
  int (*prepare)(void *device, const tpm_device_preparation *preparation, char *message);
  int (*read)(void *device, double position_m[3]);
  int (*write)(void *device, const double force_N[3]);
  int (*status)(void *device, tpm_device_status *status);
  int (*hand)(void *device, tpm_device_hand *hand);
  /** Zero force, forces off. May be called more than once. */
  void (*stop)(void *device);
  /** Switches forces off as far as possible while another thread is stuck in a call. */
  void (*cut_forces)(void *device);
  /** Releases the device; called once, after stop. */
  void (*close)(void *device);
  /** Switches forces on, at zero. Called from the thread of the loop as the last thing before its first
   * cycle: start the watchdog here. NULL, or a `size` that ends before it: prepare does this. */
  int (*enable_forces)(void *device, char *message);
} tpm_device_plugin;

/** The functions that a plugin exports. The struct lives as long as the library is loaded. */
const tpm_device_plugin *tpm_device_plugin_get(void);

#ifdef __cplusplus
}
#endif
#endif
