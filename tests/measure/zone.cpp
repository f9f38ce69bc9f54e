// Prints the numbers of reports/haptics/report.md, "A sphere that moves in space": whether another
// contact model than the zone serves an organ at 1 kHz to 1 % of the peak force:
//     measure_zone SPHERES DEPTH STEPS       such as 10000 "2 mm" 100
// The sphere moves at random up to that depth, and half of it aside.
// The reference is the whole network in double precision, two steps a period against one,
// extrapolated; its own error is printed beside.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "program.hpp"
#include "tpm/accuracy/contact_reference.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/contact/condensed/condensed.hpp"
#include "tpm/contact/servo_network.hpp"
#include "tpm/contact/zone_network.hpp"
#include "tpm/files/json.hpp"
#include "tpm/organ/scene/scene.hpp"

using namespace tpm;
using namespace tpm::organ;
using namespace tpm::contact;
using namespace tpm::accuracy;

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

constexpr double kPeriod_s = 1e-3;

files::Json scene_of(int spheres) {
  files::Json scene = files::parse_json(R"({
    "organ": {"kind": "liver", "filling": "solid", "shape": {"width": "200 mm"}},
    "bonds": {"spacing_law": "continuum"},
    "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "15e3 Pa s"},
    "anchors": [{"kind": "far_side", "fraction": 0.3}]})",
                                        "measure_zone");
  scene["organ"]["count"] = spheres;
  return scene;
}

std::string words_of(const ContactReference& reference, ContactModel& model,
                     const ContactMotion& motion, double built_s) {
  model.reset();
  double largest_N = 0.0;
  Eigen::Index valid = 0;
  std::vector<double> took_s;
  for (Eigen::Index i = 0; i < motion.steps(); ++i) {
    const auto start = Clock::now();
    const ContactAnswer now = model.step(motion.displacement_m.col(i));
    took_s.push_back(seconds_since(start));
    valid += now.valid ? 1 : 0;
    largest_N = std::max(largest_N, (now.force_N - reference.force_N.col(i)).norm());
  }
  std::ranges::sort(took_s);
  const std::size_t late =
      static_cast<std::size_t>(took_s.end() - std::ranges::upper_bound(took_s, kPeriod_s));
  return fmt::format("{:.2f} | {:.1f} | {:.1f} | {} | {} of {} | {:.1f}",
                     100.0 * largest_N / reference.peak_N(), 1e6 * took_s[took_s.size() / 2],
                     1e6 * took_s[took_s.size() * 99 / 100], late, valid, motion.steps(), built_s);
}

template <class Make>
void print_model(const std::string& name, const ContactReference& reference,
                 const ContactMotion& motion, const Make& make) {
  try {
    const auto start = Clock::now();
    const std::unique_ptr<ContactModel> model = make();
    const double built_s = seconds_since(start);
    fmt::print("| {} | {} |\n", name, words_of(reference, *model, motion, built_s));
  } catch (const Error& error) {
    fmt::print("| {} | refused: {} | | | | | |\n", name, error.what());
  }
  std::fflush(stdout);
}

void print_scene(int spheres, double depth_m, Eigen::Index steps) {
  const double aside_m = 0.5 * depth_m;
  const Tissue tissue = parse_tissue(scene_of(spheres), "measure_zone", {});
  const Constraints constraints = tissue.constraints();
  const std::size_t contact = tissue.network.organ.contact.value();
  const Positions& rest = tissue.network.organ.position;
  const Eigen::Vector3d into = -tissue.network.organ.normal.col(static_cast<Eigen::Index>(contact));
  const BondSystem bonds(tissue.network, tissue.materials);
  const ContactMotion motion =
      random_motion_in_space(contact_axes(into), depth_m, aside_m, steps, 3, kPeriod_s);
  const auto start = Clock::now();
  const ContactReference reference = fine_reference({bonds, rest, constraints, contact}, motion, 1);
  fmt::print(
      "\n{} spheres, {} mm deep: peak {:.4g} N, reference known to {:.2g} % in {:.0f} s\n\n"
      "| model | largest error, % of the peak | step p50, us | p99, us | steps above 1 ms | "
      "valid | built in s |\n| --- | ---: | ---: | ---: | ---: | ---: | ---: |\n",
      tissue.network.organ.size(), significant(1e3 * depth_m, 3), reference.peak_N(),
      100.0 * reference.error_N / reference.peak_N(), seconds_since(start));
  print_model("condensed", reference, motion, [&] {
    return std::make_unique<CondensedContact>(
        build_condensed(bonds, rest, constraints, contact, into,
                        {.depth_m = depth_m, .tangential_m = aside_m, .period_s = kPeriod_s}));
  });
  for (const int rings : {1, 2, 3}) {
    print_model(fmt::format("zone of {} rings", rings), reference, motion, [&] {
      return std::make_unique<ZoneNetwork>(bonds, rest, constraints, contact, into,
                                           ZoneNetworkOptions{.period_s = kPeriod_s,
                                                              .rings = rings,
                                                              .linear_depth_m = 0.4 * depth_m,
                                                              .frozen_depth_m = 0.5 * depth_m,
                                                              .deepest_m = 1.25 * depth_m,
                                                              .aside_m = 1.5 * aside_m});
    });
  }
  print_model("whole network", reference, motion, [&] {
    return std::make_unique<ServoNetwork>(bonds, rest, constraints, contact, into,
                                          ServoNetworkOptions{.period_s = kPeriod_s,
                                                              .frozen_depth_m = 0.5 * depth_m,
                                                              .deepest_m = 1.25 * depth_m,
                                                              .aside_m = 1.5 * aside_m});
  });
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(argc, argv, 3, 3, "usage: measure_zone SPHERES DEPTH STEPS",
                        [](const std::vector<std::string>& words) {
                          print_scene(std::stoi(words[0]),
                                      parse_quantity(words[1], Dimension::length, "DEPTH"),
                                      std::stoi(words[2]));
                        });
}
