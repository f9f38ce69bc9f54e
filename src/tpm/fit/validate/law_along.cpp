#include "tpm/fit/validate/law_along.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tpm/data/straight_pieces.hpp"
#include "tpm/fit/likelihood/delayed_rise.hpp"
#include "tpm/work/give_up.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::fit {
namespace {

// Of what central differences change. Of a closed form the error is its square; an organ's answer
// has an error of 1e-6 of the largest, which the difference must stand above.
constexpr double kStep = 1e-4, kStepOfOrgan = 1e-2;

Protocol history_of(Drive drive, const Recording& r, std::vector<Knot> knots) {
  if (knots.empty()) {
    for (std::size_t i = 0; i < r.time_s.size(); ++i) knots.push_back({r.time_s[i], r.drive[i]});
  }
  Protocol history(drive, std::move(knots), "measured history");
  history.set_equilibrium_at_start(true);
  return history;
}

/// The same history with other times and values.
template <typename Change>
Protocol changed(const Protocol& history, const Change& change) {
  std::vector<Knot> knots(history.knots().begin(), history.knots().end());
  for (Knot& knot : knots) knot = change(knot);
  Protocol result(history.drive(), std::move(knots), history.name());
  result.set_equilibrium_at_start(history.equilibrium_at_start());
  return result;
}

/// Times later by an amount, of a sample within a motion within it still.
std::vector<double> within(const Protocol& motion, std::vector<double> times_s, double later_s) {
  for (double& t : times_s) {
    if (t <= motion.end_s()) t = std::clamp(t + later_s, motion.start_s(), motion.end_s());
  }
  return times_s;
}

}  // namespace

bool is_load(Quantity q) noexcept {
  return q == Quantity::load || q == Quantity::contact_force || q == Quantity::stress;
}

PreparedRecording as_load_imposed(const PreparedRecording& recording) {
  PreparedRecording turned = recording;
  Recording& r = turned.recording;
  if (is_load(r.drive_quantity)) return turned;
  std::swap(r.drive, r.response);
  std::swap(r.drive_quantity, r.response_quantity);
  r.response_sd.clear();
  turned.phases.drive_jitter_sd = recording.phases.noise_sd_estimate;
  turned.phases.noise_sd_estimate = recording.phases.drive_jitter_sd;
  return turned;
}

LawAlong::LawAlong(const LawFile& law, const PreparedRecording& recording, const OrganOfLaw* organ,
                   std::vector<Knot> motion, std::vector<DelayedRise> rises)
    : law_(law),
      recording_(recording.recording),
      own_model_(organ != nullptr ? nullptr : std::make_shared<LawModel>(law.spec)),
      organ_(organ),
      model_(organ != nullptr ? static_cast<const Model*>(organ) : own_model_.get()),
      coordinates_(fitted_coordinates(law, Placement::own)),
      load_imposed_(is_load(recording_.drive_quantity)),
      rises_(std::move(rises)),
      to_s_(recording.to_s),
      straight_(history_of(load_imposed_ ? Drive::force : Drive::displacement, recording_,
                           std::move(motion))),
      whole_(with_delays(straight_, rises_)),
      motion_(whole_) {
  if (!load_imposed_) {
    require_quantities_of(law, recording);
  } else if (recording_.response_quantity != law.spec.drive) {
    throw bad_input(fmt::format("recording '{}'", recording.name),
                    fmt::format("{} under a load", quantity_name(recording_.response_quantity)),
                    fmt::format("{}, as the law answers", quantity_name(law.spec.drive)));
  }
  if (organ_ != nullptr) {
    if (load_imposed_) {
      throw bad_input(fmt::format("recording '{}'", recording.name),
                      "creep, which an organ is not compared with",
                      "an imposed depth; or the law.json that was put on the organ");
    }
    motion_ = driven(rises_);
  }
  const std::vector<LawParameter> parameters = law_parameters(law.spec);
  const LawParameter& contact = parameters[parameters.size() - 2];
  const double value = law.values[law.values.size() - 2];
  const bool known =
      std::ranges::find(coordinates_.place, parameters.size() - 2) != coordinates_.place.end();
  const bool own = has_own_slack(law);
  contact_of_law_ =
      !load_imposed_ && !own && !belongs_to_recording(law.spec, contact) && (known || value != 0.0);
  if (own) leave_out(coordinates_, parameters.size() - 2);
}

Protocol LawAlong::driven(std::vector<DelayedRise> rises) const {
  Protocol motion = with_delays(straight_, rises);
  if (organ_ == nullptr) return motion;
  return followed_by_organ(history_until(motion, std::min(to_s_, motion.end_s())));
}

Response LawAlong::respond(const Protocol& motion, const std::vector<double>& times_s,
                           double contact, Want want) const {
  std::vector<double> values = law_.values;
  values[values.size() - 2] = load_imposed_ ? 0.0 : contact;
  values.back() = 0.0;
  if (!load_imposed_ || contact == 0.0) return model_->respond(motion, times_s, values, want);
  return model_->respond(changed(motion,
                                 [&](Knot k) {
                                   return Knot{k.time_s, std::max(k.value - contact, 0.0)};
                                 }),
                         times_s, values, want);
}

LawAlong::At LawAlong::at(double contact) const {
  const Response response =
      respond(motion_, recording_.time_s, contact, Want::values_and_sensitivity);
  std::vector<double> values = law_.values;
  values[values.size() - 2] = contact;
  At result{response.value, coordinate_slopes(response, coordinates_, values), {}};
  if (!load_imposed_) {
    result.by_contact = response.sensitivity.col(response.sensitivity.cols() - 2);
    if (organ_ != nullptr && !organ_->times_follow()) follow_times(result, values);
    return result;
  }
  const double step = kStep * motion_.peak();
  const auto beside = [&](double by) {
    return along(changed(motion_, [&](Knot k) { return Knot{k.time_s, k.value - by}; }), contact);
  };
  result.by_contact = (beside(step) - beside(-step)) / (2.0 * step);
  return result;
}

/// Bonds that keep the law's relaxation times would have had those of another law. An organ is
/// fitted to answer as its law does, so it follows the law's times as the law itself.
void LawAlong::follow_times(At& at, std::vector<double> values) const {
  values.back() = 0.0;
  const bool series = law_.spec.form == BranchForm::series;  // all of it moves the times
  const std::vector<LawParameter> parameters = law_parameters(law_.spec);
  const Response of_law =
      LawModel(law_.spec).respond(motion_, recording_.time_s, values, Want::values_and_sensitivity);
  const Eigen::MatrixXd by_law = coordinate_slopes(of_law, coordinates_, values);
  for (std::size_t k = 0; k < coordinates_.place.size(); ++k) {
    const LawParameter& p = parameters[coordinates_.place[k]];
    if (p.nuisance || !(series || p.name.starts_with("tau"))) continue;
    const auto column = static_cast<Eigen::Index>(k);
    at.by_law.col(column) = by_law.col(column);
  }
}

Eigen::VectorXd LawAlong::along(const Protocol& motion, double contact, double later_s) const {
  return respond(motion, within(motion, recording_.time_s, later_s), contact, Want::values).value;
}

Eigen::VectorXd LawAlong::by_depth_scale(double contact) const {
  const double step = organ_ != nullptr ? kStepOfOrgan : kStep;
  const auto with = [&](double factor) {
    return along(changed(motion_,
                         [&](Knot k) {
                           return Knot{k.time_s, contact + factor * (k.value - contact)};
                         }),
                 contact);
  };
  return (with(1.0 + step) - with(1.0 - step)) / (2.0 * step);
}

Eigen::VectorXd LawAlong::by_time_scale(double contact) const {
  // The same samples, each later by its share: the response at sample i stays sample i.
  const double step = organ_ != nullptr ? kStepOfOrgan : kStep;
  const double start_s = recording_.time_s.front();
  const auto with = [&](double factor) {
    const auto scaled = [&](double t) { return start_s + factor * (t - start_s); };
    std::vector<double> times = within(motion_, recording_.time_s, 0.0);
    for (double& t : times) t = scaled(t);
    return respond(changed(motion_,
                           [&](Knot k) {
                             return Knot{scaled(k.time_s), k.value};
                           }),
                   times, contact, Want::values)
        .value;
  };
  return (with(1.0 + step) - with(1.0 - step)) / (2.0 * step);
}

Eigen::VectorXd LawAlong::by_time_shift(double contact) const {
  const double part = organ_ != nullptr ? 0.5 : 1e-2;
  const double step = part * median_step(recording_.time_s);
  // The motion comes later; the samples stay.
  return (along(motion_, contact, -step) - along(motion_, contact, step)) / (2.0 * step);
}

Eigen::VectorXd LawAlong::by_delay(std::size_t rise, double contact) const {
  constexpr double kPart = 0.1;  // of the time between the samples
  const DelayedRise& own = rises_.at(rise);
  const double lasts_s = own.end_s - own.begin_s;
  const auto delayed = [&](double by_s) {
    std::vector<DelayedRise> rises = rises_;
    rises[rise].delay_s = by_s;
    return along(driven(std::move(rises)), contact);
  };
  const double early_s = std::max(own.delay_s - kPart * lasts_s, -0.5 * lasts_s);
  const double late_s = std::min(own.delay_s + kPart * lasts_s, 0.5 * lasts_s);
  return (delayed(late_s) - delayed(early_s)) / (late_s - early_s);
}

std::vector<LawAlong::Refinement> LawAlong::refinements(double contact) const {
  if (organ_ == nullptr) return {};
  Refinement pieces{"straight pieces of the motion", 2.0, {}};
  for (const double coarser : {1.0, 2.0, 4.0}) {
    Protocol motion = followed_by_organ(whole_, contact, coarser * kMotionWithin);
    pieces.values.push_back(along(history_until(motion, motion_.end_s()), contact));
  }
  Refinement tolerances{"tolerance of the organ's balance", 10.0, {along(motion_, contact)}};
  for (const double coarser : {10.0, 100.0}) {
    const OrganOfLaw coarse = organ_->at_tolerance(coarser * OrganModel::kTolerance);
    std::vector<double> values = law_.values;
    values[values.size() - 2] = contact;
    values.back() = 0.0;
    tolerances.values.push_back(
        coarse.respond(motion_, recording_.time_s, values, Want::values).value);
  }
  return {std::move(pieces), std::move(tolerances)};
}

std::vector<Eigen::VectorXd> LawAlong::by_filling(const OtherFillings& others,
                                                  double contact) const {
  if (organ_ == nullptr || others.organs.empty()) return {};
  std::vector<double> values = law_.values;
  values[values.size() - 2] = contact;
  values.back() = 0.0;
  const auto answer = [&](const OrganOfLaw& organ, const Protocol& motion) {
    return Eigen::VectorXd(organ.respond(motion, recording_.time_s, values, Want::values).value);
  };
  const double deepest = motion_.peak() - contact;
  const double scale = law_.fitted_to && deepest > 0.0 ? *law_.fitted_to / deepest : 1.0;
  const Protocol calibrated = changed(motion_, [&](Knot k) {
    return Knot{k.time_s, contact + scale * (k.value - contact)};
  });
  std::vector<Eigen::VectorXd> all;
  const std::string gave_way = gave_up([&] {
    const Eigen::VectorXd target = answer(*organ_, calibrated);
    all.push_back(answer(*organ_, motion_));
    for (const auto& other : others.organs) {
      const Eigen::VectorXd force = answer(*other, calibrated);
      const auto known = target.array().isFinite() && force.array().isFinite();
      const double product = known.select(target.array() * force.array(), 0.0).sum();
      const double square = known.select(force.array().square(), 0.0).sum();
      all.push_back(product / square * answer(*other, motion_));
    }
  });
  if (!gave_way.empty()) all.clear();
  return all;
}

}  // namespace tpm::fit
