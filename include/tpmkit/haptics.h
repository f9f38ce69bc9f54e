/* tpmkit/haptics.h: a soft tissue felt by a haptic loop of your own, in plain C.
 *
 * Open a contact from a session (schemas/hil.schema.json) or a law (schemas/law.schema.json; `tpm fit`
 * writes law.json), step it once in every period of your servo loop, close it:
 *
 *     tpm_haptics_contact *contact;
 *     char why[TPM_HAPTICS_MESSAGE];
 *     tpm_haptics_options options = TPM_HAPTICS_OPTIONS_INIT;
 *     options.device_file = "device.json";  // what `tpm hil identify` measured on your device
 *     if (tpm_haptics_open("session.json", &options, &contact, why, sizeof why) != TPM_HAPTICS_OK) ...
 *     for (;;) {
 *       ...read position_m from your device, and the time t_s from your clock...
 *       tpm_haptics_step_at(contact, t_s, position_m, force_N);
 *       ...send force_N to your device...
 *     }
 *     tpm_haptics_close(contact);
 *
 * Units are SI. Positions and forces are in the coordinates of the device: the session says where the
 * tissue begins (`surface`) and which way is into it (`push`). Forces act on the hand.
 *
 * Threads: one thread steps. One other may call tpm_haptics_get_state and tpm_haptics_positions. Make
 * all other calls outside these loops. Contacts are independent of each other.
 *
 * A step neither allocates nor locks nor throws. It includes what `tpm hil run` does for
 * safety: one-sided contact, limits of the force and of its rise, passivity control, and a stop if the
 * rendering delivers energy to the hand or oscillates. It does not know the limits of your device and
 * does not replace them.
 *
 * Binary interface: every struct begins with its size and the version it was compiled for; the library
 * reads and writes no more than that size. Members are added at the end only. Symbols carry the version
 * TPMKIT_HAPTICS_1, later ones TPMKIT_HAPTICS_2; one that changes its meaning gets a new version and keeps
 * the old one.
 */
#ifndef TPMKIT_HAPTICS_H
#define TPMKIT_HAPTICS_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(_WIN32)
#define TPM_HAPTICS_API
#else
#define TPM_HAPTICS_API __attribute__((visibility("default")))
#endif

/** Version of the structs below. */
#define TPM_HAPTICS_VERSION 1u
/** Size that is sufficient for any message. */
#define TPM_HAPTICS_MESSAGE 512

/** Result of a call. 1 to 5 are the exit codes of the program `tpm`. */
enum tpm_haptics_code {
  TPM_HAPTICS_OK = 0,
  TPM_HAPTICS_REFUSED = 1,     /**< the rendering would be unstable, or beyond the device's limits */
  TPM_HAPTICS_USAGE = 2,       /**< a null pointer, a struct of unknown size or version, a bad option */
  TPM_HAPTICS_BAD_INPUT = 3,   /**< a file or a value in it */
  TPM_HAPTICS_NUMERICAL = 4,   /**< a solver gave up */
  TPM_HAPTICS_ENVIRONMENT = 5, /**< a file that cannot be read; no memory */
  TPM_HAPTICS_STOPPED = 6      /**< the contact has stopped; the force is zero until it is reset */
};

/** Why a contact has stopped: tpm_haptics_state.cause. */
enum tpm_haptics_cause {
  TPM_HAPTICS_RUNNING = 0,
  TPM_HAPTICS_FINISHED = 1,             /**< the history of spring-pots is full (options.longest_s) */
  TPM_HAPTICS_POSITION_NOT_FINITE = 2,
  TPM_HAPTICS_POSITION_JUMPED = 3,      /**< faster than 5 m/s */
  TPM_HAPTICS_FORCE_NOT_FINITE = 4,
  TPM_HAPTICS_LATE = 5,                 /**< the loop missed periods in too many calls */
  TPM_HAPTICS_NOT_IN_PLACE = 6,         /**< the tool was never in free air and at rest */
  TPM_HAPTICS_OUTSIDE_VALIDITY = 7,     /**< forces were outside the validity of the model for too long */
  TPM_HAPTICS_ENERGY = 8,               /**< the rendering delivered energy to the hand */
  TPM_HAPTICS_OSCILLATION = 9,
  TPM_HAPTICS_OTHER = 10,
  TPM_HAPTICS_TOO_MUCH_DAMPING = 11     /**< damping had to be added in too many steps */
};

/** Events of a step, bits of tpm_haptics_state.flags. */
enum tpm_haptics_flag {
  TPM_HAPTICS_TOUCHING = 1u << 0,
  TPM_HAPTICS_FORCE_LIMITED = 1u << 1, /**< by the session's limit, or while it grows to it */
  TPM_HAPTICS_SLIPPING = 1u << 2,      /**< the force rose faster than it may */
  TPM_HAPTICS_DAMPED = 1u << 3,        /**< by the passivity controller */
  TPM_HAPTICS_BEYOND_MODEL = 1u << 4,  /**< the force is outside the validity of the model; it is faded out */
  TPM_HAPTICS_WAITING = 1u << 5,       /**< for the tool to be in free air, in reach and at rest */
  TPM_HAPTICS_OUT_OF_REACH = 1u << 6,  /**< what it waits for */
  TPM_HAPTICS_IN_TISSUE = 1u << 7,     /**< what it waits for */
  TPM_HAPTICS_MOVING = 1u << 8         /**< what it waits for */
};

/** A tissue at the tool. */
typedef struct tpm_haptics_contact tpm_haptics_contact;

/** Options for opening a contact. TPM_HAPTICS_OPTIONS_INIT sets the defaults. */
typedef struct tpm_haptics_options {
  uint32_t size;
  uint32_t version;
  double rate_Hz;            /**< of your loop, 500 to 4000; 0: that of the file, or 1000 */
  double longest_s;          /**< of a law file: spring-pots keep their history so long; default 600 */
  uint32_t no_start_gate;    /**< 1: forces do not wait until the tool is in free air and at rest */
  uint32_t accept_unstable;  /**< 1: open what would be unstable; refused but for "virtual" */
  char device[32];           /**< whose limits apply, as `tpm hil run --device` but for "replay"; "": that of
                                  device_file, else omega7; "virtual": nothing has motors, as in a test of your
                                  loop */
  const char *device_file;   /**< limits, delay and friction measured on your device (`tpm hil identify`,
                                  schemas/device.schema.json). NULL, or a file without a measured delay: a device
                                  with motors counts as 20 ms late and free of friction, and a tissue above
                                  49 N/m (at 1 kHz) is refused. A device that tpm does not know, or of a plugin,
                                  states all its limits in the file */
} tpm_haptics_options;

#define TPM_HAPTICS_OPTIONS_INIT \
  { (uint32_t)sizeof(tpm_haptics_options), TPM_HAPTICS_VERSION, 0.0, 600.0, 0u, 0u, {0}, NULL }

/** Properties that do not change while a contact is open. */
typedef struct tpm_haptics_info {
  uint32_t size;
  uint32_t version;
  double period_s;             /**< of a step */
  double stiffness_N_per_m;    /**< largest instantaneous stiffness along the push */
  double stable_N_per_m;       /**< largest that is stable with an operator's arm on the device */
  double passive_N_per_m;      /**< largest that is passive with every operator */
  double force_limit_N;
  double surface_m[3];         /**< where the tissue begins, device coordinates */
  double push[3];              /**< into the tissue, unit vector, device coordinates */
  double scene_push[3];        /**< the same in the coordinates of the scene */
  double sphere_radius_m;      /**< of the spheres that are drawn */
  double tool_radius_m;        /**< of a ball that moves in space; 0: the tool moves along the push */
  uint64_t spheres;            /**< that tpm_haptics_positions writes, 1 or more */
  uint64_t contact_sphere;     /**< the one that the tool meets, from 0 */
  char model[128];             /**< description of the model */
  double hands_N_per_m;        /**< largest stiffness that is safe in six hands (docs/safety.md) */
  double delay_s;              /**< of your device, that counts */
} tpm_haptics_info;

#define TPM_HAPTICS_INFO_INIT \
  { (uint32_t)sizeof(tpm_haptics_info), TPM_HAPTICS_VERSION, 0.0, 0.0, 0.0, 0.0, 0.0, \
    {0.0}, {0.0}, {0.0}, 0.0, 0.0, 0u, 0u, {0}, 0.0, 0.0 }

/** The newest step. */
typedef struct tpm_haptics_state {
  uint32_t size;
  uint32_t version;
  double time_s;           /**< of the contact, missed periods included */
  double position_m[3];    /**< of the tool */
  double force_N[3];       /**< on the hand */
  double tool_depth_m;     /**< along the push, from the surface at rest; negative in the air */
  double surface_depth_m;  /**< of the tissue under the tool */
  double model_force_N;    /**< of the tissue against the push, before limits */
  double model_error_N;    /**< estimate of how far that is from the full network's */
  uint32_t flags;          /**< tpm_haptics_flag */
  int32_t cause;           /**< tpm_haptics_cause */
  uint64_t missed;         /**< periods without a step so far */
} tpm_haptics_state;

#define TPM_HAPTICS_STATE_INIT \
  { (uint32_t)sizeof(tpm_haptics_state), TPM_HAPTICS_VERSION, 0.0, {0.0}, {0.0}, 0.0, 0.0, 0.0, 0.0, \
    0u, 0, 0u }

/** Version of the library, such as "0.1.0". */
TPM_HAPTICS_API const char *tpm_haptics_version(void);

/** Opens a contact. It takes from milliseconds (a law) to a minute (an organ that is planned).
 * @param file a session or a law
 * @param options NULL: the defaults, those of an Omega.7 on which nothing was measured
 * @param contact set to the contact, or to NULL
 * @param message may be NULL; one line of text that says what is wrong, empty if nothing is
 * @param message_size its room, with the closing 0; TPM_HAPTICS_MESSAGE is enough
 */
TPM_HAPTICS_API int tpm_haptics_open(const char *file, const tpm_haptics_options *options,
                                     tpm_haptics_contact **contact, char *message,
                                     size_t message_size);

/** One period of the loop. No allocation, lock or exception.
 * @param position_m of the tool
 * @param force_N on the hand; zero unless the answer is TPM_HAPTICS_OK
 * @returns TPM_HAPTICS_OK, TPM_HAPTICS_STOPPED, or TPM_HAPTICS_USAGE for a null pointer
 */
TPM_HAPTICS_API int tpm_haptics_step(tpm_haptics_contact *contact, const double position_m[3],
                                     double force_N[3]);

/** The same after `missed` periods without a step; the tissue is advanced through them too. A loop that
 * misses some in more calls than the session allows (limits/late_cycles: 100 of 1000), also while the contact
 * waits to begin, or more than the tissue can make up for (8 periods a call) is stopped: TPM_HAPTICS_LATE. */
TPM_HAPTICS_API int tpm_haptics_step_after(tpm_haptics_contact *contact, uint32_t missed,
                                           const double position_m[3], double force_N[3]);

/** One call of your loop at the time `t_s` of your clock. The number of periods since the last call follows
 * from the time: a loop that runs at another rate than the contact, or that is late, lives through the same
 * time as the tissue. A faster loop receives the force of the last period in between; a slower one misses
 * periods: up to the limits of tpm_haptics_step_after the force is that of its time, above them it is stopped
 * with TPM_HAPTICS_LATE. The mean rate counts: a call lives through one period as long as the tissue stays
 * within 1.25 periods of the clock, so the intervals of a loop of the right rate may vary, by up to 80 % of a
 * period. Use either this or the two above.
 * @param t_s seconds of a clock that does not jump (CLOCK_MONOTONIC), rising from call to call; its origin
 *        does not matter, its size is 1e10 at most: above that a double does not tell a hundredth of a period
 * @returns as tpm_haptics_step; TPM_HAPTICS_USAGE with a zero force for a time that is not finite, is larger,
 *          lies before that of the last call, or is the same in more than 100 calls in a row
 */
TPM_HAPTICS_API int tpm_haptics_step_at(tpm_haptics_contact *contact, double t_s,
                                        const double position_m[3], double force_N[3]);

/** Returns to rest; a stopped contact runs again. It allocates, so do not call it in the loop. No other
 * thread may use the contact meanwhile. */
TPM_HAPTICS_API int tpm_haptics_reset(tpm_haptics_contact *contact);

/** Fills `info`. `size` and `version` must be set (TPM_HAPTICS_INFO_INIT). */
TPM_HAPTICS_API int tpm_haptics_get_info(const tpm_haptics_contact *contact, tpm_haptics_info *info);

/** Fills the newest state; never waits. For the thread that draws.
 * `size` and `version` must be set (TPM_HAPTICS_STATE_INIT). */
TPM_HAPTICS_API int tpm_haptics_get_state(tpm_haptics_contact *contact, tpm_haptics_state *state);

/** Writes the centres of all spheres, x, y, z of each, in the coordinates of the scene. The contact
 * sphere is that of the last step; the others are updated 25 times a second. For the thread that draws.
 * @param positions_m room for 3 * spheres numbers
 * @param spheres as tpm_haptics_info.spheres says
 */
TPM_HAPTICS_API int tpm_haptics_positions(tpm_haptics_contact *contact, double *positions_m,
                                          size_t spheres);

/** Closes a contact; NULL is allowed. */
TPM_HAPTICS_API void tpm_haptics_close(tpm_haptics_contact *contact);

/** A cause in words, such as "energy given to the hand". */
TPM_HAPTICS_API const char *tpm_haptics_cause_text(int cause);

#ifdef __cplusplus
}
#endif
#endif
