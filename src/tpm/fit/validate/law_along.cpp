#include "tpm/fit/validate/law_along.hpp"

#include <algorithm>
#include <cmath>

#include "tpmkit/error.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::fit {
namespace {

// Of what central differences change: their error is its square.
constexpr double kStep = 1e-4;

Protocol motion_of(const std::vector<double>& time_s, const std::vector<double>& drive) {
  Protocol motion = measured_history(Drive::displacement, time_s, drive);
  motion.set_equilibrium_at_start(true);
  return motion;
}

}  // namespace

LawAlong::LawAlong(const LawFile& law, const PreparedRecording& recording)
    : law_(law),
      recording_(recording.recording),
      model_(law.spec),
      coordinates_(fitted_coordinates(law, Placement::own)) {
  require_quantities_of(law, recording);
  const std::vector<LawParameter> parameters = law_parameters(law.spec);
  const LawParameter& contact = parameters[parameters.size() - 2];
  const double value = law.values[law.values.size() - 2];
  const bool known =
      std::ranges::find(coordinates_.place, parameters.size() - 2) != coordinates_.place.end();
  contact_of_law_ = !belongs_to_recording(law.spec, contact) && (known || value != 0.0);
}

LawAlong::At LawAlong::at(double contact) const {
  std::vector<double> values = law_.values;
  values[values.size() - 2] = contact;
  values.back() = 0.0;
  const Response response = model_.respond(motion_of(recording_.time_s, recording_.drive),
                                           recording_.time_s, values, Want::values_and_sensitivity);
  return {response.value, coordinate_slopes(response, coordinates_, values),
          response.sensitivity.col(response.sensitivity.cols() - 2)};
}

Eigen::VectorXd LawAlong::along(const std::vector<double>& time_s, const std::vector<double>& drive,
                                double contact) const {
  std::vector<double> values = law_.values;
  values[values.size() - 2] = contact;
  values.back() = 0.0;
  std::vector<double> times = recording_.time_s;
  for (double& t : times) t = std::clamp(t, time_s.front(), time_s.back());
  return model_.respond(motion_of(time_s, drive), times, values, Want::values).value;
}

Eigen::VectorXd LawAlong::by_depth_scale(double contact) const {
  const auto with = [&](double factor) {
    std::vector<double> drive = recording_.drive;
    for (double& d : drive) d = contact + factor * (d - contact);
    return along(recording_.time_s, drive, contact);
  };
  return (with(1.0 + kStep) - with(1.0 - kStep)) / (2.0 * kStep);
}

Eigen::VectorXd LawAlong::by_time_scale(double contact) const {
  // The same samples, each later by its share: the response at sample i stays sample i.
  const auto with = [&](double factor) {
    std::vector<double> times = recording_.time_s;
    for (double& t : times)
      t = recording_.time_s.front() + factor * (t - recording_.time_s.front());
    std::vector<double> values = law_.values;
    values[values.size() - 2] = contact;
    values.back() = 0.0;
    return model_.respond(motion_of(times, recording_.drive), times, values, Want::values).value;
  };
  return (with(1.0 + kStep) - with(1.0 - kStep)) / (2.0 * kStep);
}

Eigen::VectorXd LawAlong::by_time_shift(double contact) const {
  const double step = 1e-2 * median_step(recording_.time_s);
  const auto with = [&](double later) {
    std::vector<double> times = recording_.time_s;
    for (double& t : times) t += later;
    return along(times, recording_.drive, contact);
  };
  return (with(step) - with(-step)) / (2.0 * step);
}

}  // namespace tpm::fit
