// The C interface for haptic loops: errors become codes and one line, nothing is thrown across it.
#include "tpmkit/haptics.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <utility>

#include "tpm/base/text.hpp"
#include "tpm/haptics/session/loop_contact.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/version.hpp"

struct tpm_haptics_contact {
  tpm_haptics_contact(const char* file, const tpm::haptics::LoopContactOptions& options)
      : contact(file, options) {}
  tpm::haptics::LoopContact contact;
};

namespace {

using tpm::haptics::ServoFlag;
using tpm::haptics::StopCause;

void say(char* message, std::size_t room, std::string_view text) noexcept {
  if (message == nullptr || room == 0) return;
  const std::size_t length = std::min(room - 1, text.size());
  std::copy_n(text.data(), length, message);
  message[length] = '\0';
}

// Sizes of the structs of the first version, the least that there are.
constexpr std::size_t kFirstOptions = offsetof(tpm_haptics_options, device_file);
constexpr std::size_t kFirstInfo = offsetof(tpm_haptics_info, hands_N_per_m);
constexpr std::size_t kFirstState = offsetof(tpm_haptics_state, missed);

/// A struct of a caller that was compiled for another version of this library is read as far as
/// both know it.
template <class Struct>
bool known(const Struct& given, std::size_t least) noexcept {
  return given.version >= 1 && given.size >= least && given.size <= 65536;
}

/// Copies as much of a filled struct as the caller has room for; size and version stay the
/// caller's.
template <class Struct>
void hand_over(const Struct& filled, Struct& given) noexcept {
  const std::size_t head = offsetof(Struct, version) + sizeof given.version;
  const std::size_t bytes = std::min<std::size_t>(given.size, sizeof filled);
  std::memcpy(reinterpret_cast<char*>(&given) + head,  // NOLINT: plain data, by its bytes
              reinterpret_cast<const char*>(&filled) + head, bytes - head);  // NOLINT
}

struct Cause {
  StopCause servo;
  int ours;
  const char* text;
};

constexpr Cause kCauses[] = {
    {StopCause::none, TPM_HAPTICS_RUNNING, "running"},
    {StopCause::finished, TPM_HAPTICS_FINISHED, "finished"},
    {StopCause::position_not_finite, TPM_HAPTICS_POSITION_NOT_FINITE, "position not finite"},
    {StopCause::position_jump, TPM_HAPTICS_POSITION_JUMPED, "position jumped"},
    {StopCause::force_not_finite, TPM_HAPTICS_FORCE_NOT_FINITE, "force not finite"},
    {StopCause::overrun_storm, TPM_HAPTICS_LATE, "too many periods missed"},
    {StopCause::not_in_place, TPM_HAPTICS_NOT_IN_PLACE, "tool not in place"},
    {StopCause::outside_validity, TPM_HAPTICS_OUTSIDE_VALIDITY, "model outside validity"},
    {StopCause::energy, TPM_HAPTICS_ENERGY, "energy given to the hand"},
    {StopCause::oscillation, TPM_HAPTICS_OSCILLATION, "oscillation"},
    {StopCause::damping, TPM_HAPTICS_TOO_MUCH_DAMPING, "damped for too long"},
};

int cause_of(StopCause cause) noexcept {
  for (const Cause& known : kCauses) {
    if (known.servo == cause) return known.ours;
  }
  return TPM_HAPTICS_OTHER;
}

std::uint32_t flags_of(std::uint32_t row) noexcept {
  constexpr std::pair<std::uint32_t, std::uint32_t> kSame[] = {
      {tpm::haptics::kTouching, TPM_HAPTICS_TOUCHING},
      {tpm::haptics::kForceLimited | tpm::haptics::kRampingIn, TPM_HAPTICS_FORCE_LIMITED},
      {tpm::haptics::kSlipping, TPM_HAPTICS_SLIPPING},
      {tpm::haptics::kDamped, TPM_HAPTICS_DAMPED},
      {tpm::haptics::kBeyondModel, TPM_HAPTICS_BEYOND_MODEL},
      {tpm::haptics::kWaiting, TPM_HAPTICS_WAITING},
      {tpm::haptics::kOutOfReach, TPM_HAPTICS_OUT_OF_REACH},
      {tpm::haptics::kInTissue, TPM_HAPTICS_IN_TISSUE},
      {tpm::haptics::kMoving, TPM_HAPTICS_MOVING}};
  std::uint32_t flags = 0;
  for (const auto& [servo, ours] : kSame) {
    if ((row & servo) != 0) flags |= ours;
  }
  return flags;
}

template <std::size_t N>
void copy_text(std::string_view text, char (&to)[N]) noexcept {
  say(to, N, text);
}

tpm::haptics::LoopContactOptions options_of(const tpm_haptics_options* given) {
  tpm::haptics::LoopContactOptions options;
  if (given == nullptr) return options;
  // An option that this library does not know yet must not be ignored.
  if (!known(*given, kFirstOptions) || given->version > TPM_HAPTICS_VERSION ||
      given->size > sizeof(tpm_haptics_options)) {
    throw tpm::Error(tpm::ExitCode::usage, "options", "size or version is not one of this library",
                     "TPM_HAPTICS_OPTIONS_INIT");
  }
  tpm_haptics_options said = TPM_HAPTICS_OPTIONS_INIT;
  std::memcpy(&said, given, given->size);  // what the caller does not have stays the default
  options.rate_Hz = said.rate_Hz;
  options.longest_s = said.longest_s;
  options.start_gate = said.no_start_gate == 0;
  options.accept_unstable = said.accept_unstable != 0;
  const std::string device(said.device, strnlen(said.device, sizeof said.device));
  if (!device.empty()) options.device = device;
  if (said.device_file != nullptr) options.device_file = said.device_file;
  return options;
}

/// Runs what may throw; answers the code, and says why in `message`.
template <class Work>
int guarded(char* message, std::size_t room, Work&& work) noexcept {
  say(message, room, "");
  try {
    work();
    return TPM_HAPTICS_OK;
  } catch (const tpm::Error& error) {
    say(message, room, tpm::base::with_arguments_for_options(error.what()));
    return static_cast<int>(error.code());
  } catch (const std::bad_alloc&) {
    say(message, room, "no memory");
    return TPM_HAPTICS_ENVIRONMENT;
  } catch (const std::exception& error) {
    say(message, room, error.what());
    return TPM_HAPTICS_ENVIRONMENT;
  }
}

int not_given(char* message, std::size_t room) noexcept {
  say(message, room, "a null pointer; expected a file name and a place for the contact");
  return TPM_HAPTICS_USAGE;
}

/// Sets the force to 0, if a place for it was given, and returns the code of a wrong call.
int no_force(double* force_N) noexcept {
  if (force_N != nullptr) std::fill_n(force_N, 3, 0.0);
  return TPM_HAPTICS_USAGE;
}

}  // namespace

extern "C" {

const char* tpm_haptics_version(void) {
  return tpm::version().data();  // a literal
}

int tpm_haptics_open(const char* file, const tpm_haptics_options* options,
                     tpm_haptics_contact** contact, char* message, size_t message_size) {
  if (contact != nullptr) *contact = nullptr;
  if (file == nullptr || contact == nullptr) return not_given(message, message_size);
  return guarded(message, message_size, [&] {
    *contact = std::make_unique<tpm_haptics_contact>(file, options_of(options)).release();
  });
}

int tpm_haptics_step(tpm_haptics_contact* contact, const double position_m[3], double force_N[3]) {
  return tpm_haptics_step_after(contact, 0, position_m, force_N);
}

int tpm_haptics_step_after(tpm_haptics_contact* contact, uint32_t missed,
                           const double position_m[3], double force_N[3]) {
  if (contact == nullptr || position_m == nullptr || force_N == nullptr) return no_force(force_N);
  constexpr std::uint32_t kMost = 1U << 20U;  // far above what stops a contact
  Eigen::Vector3d force;
  const StopCause cause = contact->contact.step(Eigen::Map<const Eigen::Vector3d>(position_m),
                                                force, static_cast<int>(std::min(missed, kMost)));
  std::copy_n(force.data(), 3, force_N);
  return cause == StopCause::none ? TPM_HAPTICS_OK : TPM_HAPTICS_STOPPED;
}

int tpm_haptics_step_at(tpm_haptics_contact* contact, double t_s, const double position_m[3],
                        double force_N[3]) {
  if (contact == nullptr || position_m == nullptr || force_N == nullptr) return no_force(force_N);
  Eigen::Vector3d force;
  const StopCause cause =
      contact->contact.step_at(t_s, Eigen::Map<const Eigen::Vector3d>(position_m), force);
  std::copy_n(force.data(), 3, force_N);
  if (cause == StopCause::none) return TPM_HAPTICS_OK;
  return cause == tpm::haptics::LoopContact::kBadTime ? TPM_HAPTICS_USAGE : TPM_HAPTICS_STOPPED;
}

int tpm_haptics_reset(tpm_haptics_contact* contact) {
  if (contact == nullptr) return TPM_HAPTICS_USAGE;
  return guarded(nullptr, 0, [&] { contact->contact.reset(); });
}

int tpm_haptics_get_info(const tpm_haptics_contact* contact, tpm_haptics_info* info) {
  if (contact == nullptr || info == nullptr || !known(*info, kFirstInfo)) return TPM_HAPTICS_USAGE;
  const tpm::haptics::LoopContact& c = contact->contact;
  const tpm::haptics::SessionServo& servo = c.session().servo;
  const tpm::haptics::TissueShape& shape = c.loop().shape;
  tpm_haptics_info filled = TPM_HAPTICS_INFO_INIT;
  filled.period_s = c.period_s();
  filled.stiffness_N_per_m = c.rendering().stiffness_N_per_m;
  filled.stable_N_per_m = c.rendering().stable_N_per_m;
  filled.passive_N_per_m = c.rendering().passive_N_per_m;
  filled.force_limit_N = servo.force_limit_N;
  std::copy_n(servo.surface_m.data(), 3, filled.surface_m);
  std::copy_n(servo.push.data(), 3, filled.push);
  std::copy_n(c.loop().push.data(), 3, filled.scene_push);
  filled.sphere_radius_m = shape.radius_m;
  filled.tool_radius_m = shape.to_model ? shape.tool_radius_m : 0.0;
  filled.spheres = static_cast<std::uint64_t>(c.spheres());
  filled.contact_sphere = shape.contact;
  copy_text(c.loop().name, filled.model);
  filled.hands_N_per_m = c.rendering().hands_N_per_m;
  filled.delay_s = c.rendering().delay_s;
  hand_over(filled, *info);
  return TPM_HAPTICS_OK;
}

int tpm_haptics_get_state(tpm_haptics_contact* contact, tpm_haptics_state* state) {
  if (contact == nullptr || state == nullptr || !known(*state, kFirstState)) {
    return TPM_HAPTICS_USAGE;
  }
  const tpm::haptics::LoopContactState newest = contact->contact.state();
  tpm_haptics_state filled = TPM_HAPTICS_STATE_INIT;
  filled.time_s = newest.time_s;
  std::copy_n(newest.row.position_m, 3, filled.position_m);
  std::copy_n(newest.row.commanded_N, 3, filled.force_N);
  filled.tool_depth_m = newest.row.tool_depth_m;
  filled.surface_depth_m = newest.row.surface_depth_m;
  filled.model_force_N = newest.row.model_force_N;
  filled.model_error_N = newest.row.model_error_N;
  filled.flags = flags_of(newest.row.flags);
  filled.cause = cause_of(newest.row.stop);
  filled.missed = newest.missed;
  hand_over(filled, *state);
  return TPM_HAPTICS_OK;
}

int tpm_haptics_positions(tpm_haptics_contact* contact, double* positions_m, size_t spheres) {
  if (contact == nullptr || positions_m == nullptr ||
      spheres != static_cast<std::size_t>(contact->contact.spheres())) {
    return TPM_HAPTICS_USAGE;
  }
  contact->contact.positions(
      Eigen::Map<Eigen::Matrix3Xd>(positions_m, 3, contact->contact.spheres()));
  return TPM_HAPTICS_OK;
}

void tpm_haptics_close(tpm_haptics_contact* contact) {
  const std::unique_ptr<tpm_haptics_contact> closed(contact);
}

const char* tpm_haptics_cause_text(int cause) {
  for (const Cause& known : kCauses) {
    if (known.ours == cause) return known.text;
  }
  return "stopped for another cause";
}

}  // extern "C"
