#pragma once
// Random scenes to be planned.
#include <fmt/format.h>

#include <cmath>
#include <string>

#include "tpm/base/random.hpp"
#include "tpm/plan/plan.hpp"

namespace tpm::test {
using namespace plan;

/// A scene and a request, both decided by a seed and a number: livers of 50 to 200 spheres in two
/// or three layers (one in ten a star); E1, E2, E' from 3 to 30 kPa, relaxation time from 1 ms to
/// 30 s, evenly in the logarithm; one sphere (three in four), a patch, or a ball (one in eight);
/// 0.05 to 8 mm deep in 0.1 to 3 s (one in eight: 20 to 200 mm/s), held, then let halfway back and
/// pushed again, or not; one in six under a load of 0.02 to 0.2 N that rises in 1 s. Tolerances
/// from 0.2 to 5 %, at a rate of 1 kHz (one in three), a wall budget of 1 s per s (one in three),
/// or without budget; one in six asks for the field.
class RandomPlan {
 public:
  RandomPlan(std::uint64_t seed, int number)
      : random_(seed * 1'000'003ULL + static_cast<std::uint64_t>(number)) {
    star_ = one_in(10);
    layers_ = one_in(3) ? 3 : 2;
    count_ = star_ ? 4 : static_cast<int>(even_log(50.0, 200.0));
    organ_seed_ = static_cast<int>(random_.below(1000));
    for (double& modulus : modulus_) modulus = even_log(3.0, 30.0);
    eta_ = even_log(1e-3, 30.0) * (modulus_[0] + modulus_[1]);
    contact_ = star_ ? 0 : one_in(8) ? 2 : one_in(8) ? 1 : 0;
    by_load_ = contact_ != 2 && one_in(6);
    peak_ = by_load_ ? even_log(0.02, 0.2) : even_log(0.05, 8.0);
    rise_s_ = by_load_ ? 1.0 : one_in(8) ? peak_ / even_log(20.0, 200.0) : even_log(0.1, 3.0);
    hold_s_ = even_log(1.0, 10.0) * rise_s_;
    again_ = one_in(2);
    request_.tolerance = even_log(0.002, 0.05);
    const std::size_t budget = random_.below(3);
    if (budget == 0) request_.budget.rate_Hz = 1000.0;
    if (budget == 1) request_.budget.wall_s_per_s = 1.0;
    if (one_in(6)) request_.measure.output = PlanOutput::field;
    request_.relevance = request_.changes = false;
  }

  [[nodiscard]] ExperimentScene scene() const {
    return parse_experiment(parse_json(text(), "random scene"), "random scene", {});
  }
  [[nodiscard]] const PlanRequest& request() const { return request_; }
  [[nodiscard]] std::string words() const {
    constexpr const char* kContacts[] = {"sphere", "patch", "ball"};
    return fmt::format("{} of {}, {:.3g} {} in {:.3g} s, tau {:.3g} s", kContacts[contact_], count_,
                       peak_, by_load_ ? "N" : "mm", rise_s_, eta_ / (modulus_[0] + modulus_[1]));
  }

 private:
  [[nodiscard]] bool one_in(std::size_t n) { return random_.below(n) == 0; }
  [[nodiscard]] double even_log(double least, double most) {
    return least * std::pow(most / least, random_.uniform());
  }

  [[nodiscard]] std::string text() const {
    std::string text = "{";
    text += star_ ? std::string(R"("organ": {"kind": "star", "spacing": "30 mm"})")
                  : fmt::format(
                        R"("organ": {{"kind": "liver", "count": {}, "layers": {}, "seed": {}}})",
                        count_, layers_, organ_seed_);
    text += fmt::format(
        R"(, "material": {{"E1": "{} kPa", "E2": "{} kPa", "Eprime": "{} kPa", "eta1": "{} kPa s"}})",
        modulus_[0], modulus_[1], modulus_[2], eta_);
    if (contact_ == 1) text += R"(, "contacts": [{"kind": "patch", "radius": "25 mm"}])";
    if (contact_ == 2) text += R"(, "contacts": [{"kind": "ball", "radius": "3 mm"}])";
    const char* key = by_load_ ? "load" : "depth";
    const char* unit = by_load_ ? "N" : "mm";
    double time = 0.0;
    const auto knot = [&](double share) {
      return fmt::format(R"({{"time": "{} s", "{}": "{} {}"}})", time, key, share * peak_, unit);
    };
    text += R"(, "protocol": {"kind": "knots", "knots": [)" + knot(0.0);
    time += rise_s_;
    text += ", " + knot(1.0);
    time += hold_s_;
    text += ", " + knot(1.0);
    if (again_) {
      time += 0.5 * rise_s_;
      text += ", " + knot(0.5);
      time += 2.0 * rise_s_;
      text += ", " + knot(0.9);
    }
    return text + "]}}";
  }

  Random random_;
  bool star_ = false, by_load_ = false, again_ = false;
  int layers_ = 2, count_ = 0, organ_seed_ = 0, contact_ = 0;
  double modulus_[3] = {}, eta_ = 0.0, peak_ = 0.0, rise_s_ = 0.0, hold_s_ = 0.0;
  PlanRequest request_;
};

}  // namespace tpm::test
