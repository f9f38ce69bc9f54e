// What a rheologist's file says: strains, lengths and kept steps, and what a fit of it prints.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "fitted_parameter.hpp"
#include "one_law.hpp"
#include "run_in.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/fit/groups/young_moduli.hpp"
#include "tpm/fit/likelihood/exchange_order.hpp"
#include "tpm/fit/select/material_function.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// Ramp over 2 s to 0.05 and hold; stress of 2 kPa and 3 kPa with 3 s.
double strain_at(double t) {
  return 0.05 * std::min(t / 2.0, 1.0);
}

Eigen::VectorXd stress_of(const std::vector<double>& times_s) {
  LawSpec spec = parse_law_name("linear-1", "test");
  spec.drive = Quantity::strain;
  spec.response = Quantity::stress;
  spec.reference = 1.0;
  std::vector<double> strain;
  for (const double t : times_s) strain.push_back(strain_at(t));
  const std::vector<double> values{2000.0, 3000.0, 3.0, 0.0, 0.0};
  return LawModel(spec)
      .respond(measured_history(Drive::displacement, times_s, strain), times_s, values,
               Want::values)
      .value;
}

std::vector<double> every(double step, int count) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) times.push_back(step * i);
  return times;
}

/// A tension test as a machine writes it.
/// @param drive of a strain, in the unit of the column
std::string tension_csv(const std::string& header, double drive, double stress) {
  const std::vector<double> times = every(0.1, 151);
  const Eigen::VectorXd answer = stress_of(times);
  std::string text = header;
  for (std::size_t i = 0; i < times.size(); ++i) {
    text += fmt::format("{:.12g},{:.12g},{:.12g}\n", times[i], drive * strain_at(times[i]),
                        stress * answer[static_cast<Eigen::Index>(i)]);
  }
  return text;
}

}  // namespace

TEST_CASE("A strain is recognised by its title, with its unit in any row", "[rheometer]") {
  const test::TempFolder folder;
  struct Written {
    const char* header;
    double drive, stress;
  };
  for (const Written& w : std::vector<Written>{
           {"Tension test\n\nTime,Strain,Stress\ns,%,kPa\n", 100.0, 1e-3},
           {"(s),(%),(kPa)\nTime,Strain,Stress\nTension test\n\n", 100.0, 1e-3},
           {"time [s],strain [-],stress [Pa]\n", 1.0, 1.0},
           {"t [s],\xCE\xB3 [-],\xCF\x84 [Pa]\n", 1.0, 1.0},
           {"time [s],shear strain [%],shear stress [mmHg]\n", 100.0, 1.0 / 133.322387415},
           {"Zeit [s],Dehnung [%],Spannung [kPa]\n", 100.0, 1e-3}}) {
    INFO(w.header);
    write_file(folder / "t.csv", tension_csv(w.header, w.drive, w.stress));
    const Recording r = read_recording_file(folder / "t.csv").recording;
    CHECK(r.drive_quantity == Quantity::strain);
    CHECK(r.response_quantity == Quantity::stress);
    CHECK_THAT(r.drive.back(), WithinRel(0.05, 1e-9));
    CHECK_THAT(r.response.back(), WithinRel(stress_of(every(0.1, 151)).tail(1)[0], 1e-9));
  }
  write_file(folder / "t.csv", tension_csv("time [s],strain,stress [Pa]\n", 1.0, 1.0));
  CHECK_THROWS_WITH(read_recording_file(folder / "t.csv"), Contains("column 2 'strain'") &&
                                                               Contains("has no unit") &&
                                                               Contains("--unit \"strain=%\""));
  // A strain rate is no strain.
  write_file(folder / "t.csv", tension_csv("time [s],strain rate [1/s],stress [Pa]\n", 1.0, 1.0));
  CHECK(read_recording_file(folder / "t.csv").recording.drive.empty());
}

TEST_CASE("A length needs the length at rest, a force the cross section", "[rheometer]") {
  const test::TempFolder folder;
  // 20 mm long, 12 mm^2: its length in mm is 20 + 20 strain.
  std::string text = "time [s],length [mm],force [N]\n";
  const std::vector<double> times = every(0.1, 151);
  const Eigen::VectorXd stress = stress_of(times);
  for (std::size_t i = 0; i < times.size(); ++i) {
    text += fmt::format("{:.12g},{:.12g},{:.12g}\n", times[i], 20.0 * (1.0 + strain_at(times[i])),
                        12e-6 * stress[static_cast<Eigen::Index>(i)]);
  }
  write_file(folder / "t.csv", text);
  ImportOptions options;
  CHECK_THROWS_WITH(
      read_recording_file(folder / "t.csv", options),
      Contains("column 2 'length': a length of the specimen") && Contains("--rest-length"));
  options.rest_length_m = 0.02;
  CHECK_THROWS_WITH(read_recording_file(folder / "t.csv", options),
                    Contains("column 3 'force': a force beside a strain or relative length") &&
                        Contains("--area"));
  options.area_m2 = 12e-6;
  const RecordingFile file = read_recording_file(folder / "t.csv", options);
  CHECK(file.recording.drive_quantity == Quantity::relative_length);
  CHECK_THAT(file.recording.drive.back(), WithinRel(1.05, 1e-9));
  CHECK_THAT(file.recording.response.back(), WithinRel(stress.tail(1)[0], 1e-9));
  CHECK_THAT(columns_words(file.findings),
             Contains("mm to relative_length by a length at rest of 20 mm"));

  write_file(folder / "d.csv", tension_csv("time [s],extension [mm],stress [Pa]\n", 20.0, 1.0));
  CHECK_THROWS_WITH(read_recording_file(folder / "d.csv"),
                    Contains("a displacement beside a stress") && Contains("--rest-length"));
  ImportOptions drawn;
  drawn.rest_length_m = 0.02;
  const Recording r = read_recording_file(folder / "d.csv", drawn).recording;
  CHECK(r.drive_quantity == Quantity::strain);
  CHECK_THAT(r.drive.back(), WithinRel(0.05, 1e-9));
}

TEST_CASE("A strain or a stress that is kept makes a modulus or a compliance", "[rheometer]") {
  const test::TempFolder folder;
  std::string relaxation = "time [s],shear strain [%],shear stress [Pa]\n";
  std::string creep = "time [s],strain [-],stress [kPa]\n";
  for (int i = 0; i < 60; ++i) {
    const double t = 0.01 * std::pow(10.0, i * 4.0 / 59.0);
    relaxation += fmt::format("{:.12g},2,{:.12g}\n", t, 20.0 + 60.0 * std::exp(-t / 2.0));
    creep += fmt::format("{:.12g},{:.12g},0.5\n", t, 0.5 - 0.375 * std::exp(-t / 8.0));
  }
  write_file(folder / "g.csv", relaxation);
  write_file(folder / "j.csv", creep);
  const auto g = find_material_function(folder / "g.csv", {});
  const auto j = find_material_function(folder / "j.csv", {});
  REQUIRE(g);
  REQUIRE(j);
  CHECK(g->kind() == "relaxation modulus");
  CHECK(j->kind() == "creep compliance");
  CHECK_THAT(g->read_as, Contains("stress over the strain that is kept"));
  SelectionOptions options = test::only({"linear-1"});
  options.setup.starts = 6;
  // 20/0.02 and 60/0.02 Pa; J = 1e-3 - 0.75e-3 exp(-t/8) is the same solid.
  for (const auto& function : {*g, *j}) {
    const Selection s = select_law(function, options);
    const FitResult& fit = s.candidates[s.recommended].fit;
    CHECK_THAT(estimate_of(fit, "k_inf"), WithinRel(1000.0, 1e-4));
    CHECK_THAT(estimate_of(fit, "k1"), WithinRel(3000.0, 1e-4));
    CHECK_THAT(estimate_of(fit, "tau1"), WithinRel(2.0, 1e-4));
  }
}

TEST_CASE("A strain is fitted from its file alone, by linear and power kernels", "[rheometer]") {
  const test::TempFolder folder;
  write_file(folder / "shear.csv",
             tension_csv("time [s],shear strain [%],shear stress [kPa]\n", 100.0, 1e-3));
  const test::ProgramRun run = test::run_in(folder, "fit shear.csv --format json");
  INFO(run.said);
  REQUIRE(run.code == 0);
  const Json json = parse_json(run.said, "said");
  CHECK(json.at("recommended") == "linear-1");
  for (const Json& law : json.at("laws")) {
    const auto name = law.at("law").get<std::string>();
    CHECK_THAT(name, !Catch::StartsWith("hertz") && !Contains("elastic") && !Contains("relaxing"));
  }
  for (const Json& p : json.at("fit").at("parameters")) {
    if (p.at("name") == "k1") {
      CHECK(p.at("SI_unit") == "Pa");
      CHECK_THAT(p.at("estimate_SI").get<double>(), WithinRel(3000.0, 1e-4));
    }
  }
  // The tables stand beside the JSON, and the configuration can be rerun.
  for (const char* name : {"laws.csv", "parameters.csv", "samples.csv"}) {
    CHECK(std::filesystem::exists(folder.path() / "shear_fit" / name));
  }
  CHECK_THAT(read_file(folder.path() / "shear_fit" / "parameters.csv"),
             Catch::StartsWith("name,SI_unit,scale,bounds_SI_lower,bounds_SI_upper,estimate_SI,"
                               "standard_error_SI,interval_SI_lower,interval_SI_upper,") &&
                 Contains(",confidence_level"));
  CHECK(test::run_in(folder, "fit shear_fit/config.json").code == 0);
}

TEST_CASE("A compression that is counted negative names the options that help", "[rheometer]") {
  const test::TempFolder folder;
  write_file(folder / "c.csv", tension_csv("time [s],strain [%],stress [kPa]\n", -100.0, -1e-3));
  const test::ProgramRun refused = test::run_in(folder, "fit c.csv --no-draw");
  CHECK(refused.code == 3);
  CHECK_THAT(refused.said, Contains("the drive falls") && Contains("--negate-drive"));
  const test::ProgramRun run =
      test::run_in(folder, "fit c.csv --negate-drive --negate-response --format json");
  INFO(run.said);
  REQUIRE(run.code == 0);
  CHECK(parse_json(run.said, "said").at("recommended") == "linear-1");
  CHECK(test::run_in(folder, "fit c_fit/config.json").code == 0);
}

TEST_CASE("Columns that only their units tell make a spectrum or a modulus", "[rheometer]") {
  const test::TempFolder folder;
  std::string spectrum = "w [rad/s],G' [Pa],G'' [Pa]\n", polar = "f [Hz],|G*| [Pa],delta [deg]\n";
  std::string modulus = "t [s],G [Pa]\n", compliance = "time [s],J [1/Pa]\n";
  for (int i = 0; i < 20; ++i) {
    const double w = 0.01 * std::pow(10.0, i * 4.0 / 19.0);
    const double x = 2.0 * w;
    const double storage = 1000.0 + 3000.0 * x * x / (1.0 + x * x);
    const double loss = 3000.0 * x / (1.0 + x * x);
    spectrum += fmt::format("{:.12g},{:.12g},{:.12g}\n", w, storage, loss);
    polar += fmt::format("{:.12g},{:.12g},{:.12g}\n", 0.5 * w / std::numbers::pi,
                         std::hypot(storage, loss),
                         std::atan2(loss, storage) * 180.0 / std::numbers::pi);
    modulus += fmt::format("{:.12g},{:.12g}\n", w, 1000.0 + 3000.0 * std::exp(-w / 2.0));
    compliance += fmt::format("{:.12g},{:.12g}\n", w, 1e-3 - 0.75e-3 * std::exp(-w / 8.0));
  }
  for (const auto& [text, kind] : {std::pair(spectrum, "spectrum"),
                                   {polar, "spectrum"},
                                   {modulus, "relaxation modulus"},
                                   {compliance, "creep compliance"}}) {
    write_file(folder / "f.csv", text);
    INFO(text.substr(0, 40));
    const auto function = find_material_function(folder / "f.csv", {});
    REQUIRE(function);
    CHECK(function->kind() == kind);
    CHECK_THAT(function->read_as, StartsWith("read as ") && Contains("column 1"));
  }
}

TEST_CASE("Branches keep their names in fits and profiles", "[rheometer]") {
  const test::TempFolder folder;
  // Two branches an order of magnitude apart and noise that blurs them.
  std::string text = "time [s],G(t) [Pa]\n";
  Random random(3);
  for (int i = 0; i < 60; ++i) {
    const double t = 0.01 * std::pow(10.0, i * 4.0 / 59.0);
    const double g = 500.0 + 900.0 * std::exp(-t / 0.5) + 1100.0 * std::exp(-t / 4.0);
    text += fmt::format("{:.12g},{:.12g}\n", t, g * (1.0 + 0.02 * random.normal()));
  }
  write_file(folder / "g.csv", text);
  const Selection s =
      select_law(*find_material_function(folder / "g.csv", {}), test::only({"linear-2"}));
  const FitResult& fit = s.candidates[s.recommended].fit;
  CHECK(estimate_of(fit, "tau1") < estimate_of(fit, "tau2"));
  CHECK(fit.minima.front().low[3] < 2.0);
  // Each interval holds its own true value and not the other's.
  CHECK(*find(fit, "tau1").upper < 4.0);
  CHECK(*find(fit, "tau2").lower > 0.5);
  CHECK(find(fit, "tau1").profile.connected);
  CHECK(find(fit, "tau2").profile.connected);

  const ExchangeOrder order(fit.config);
  std::vector<double> natural{500.0, 1.0, 2.0, 7.0, 3.0};  // k_inf, k1, k2, tau1, tau2
  CHECK_FALSE(order.is_sorted(natural));
  order.sort(natural);
  CHECK(natural == std::vector<double>{500.0, 2.0, 1.0, 3.0, 7.0});
  CHECK(order.is_sorted(natural));
  std::vector<FitParameter> bounds;
  for (const EstimatedParameter& p : fit.config.parameters) bounds.push_back(p.fit);
  const auto around = order.bounds_around(bounds, 3, 3.0);
  CHECK(around[4].lower == 3.0);
  CHECK(around[4].upper == bounds[4].upper);
  CHECK(order.bounds_around(bounds, 1, 3.0)[4].lower == bounds[4].lower);
}

TEST_CASE("Indentations answer Young's modulus with its interval", "[rheometer]") {
  struct Probe {
    const char* law;
    ContactGeometry geometry;
    double stiffness;  ///< of E = 1 Pa at the reference, N/m
  };
  constexpr double kRadius = 5e-3, kNu = 0.45, kReference = 0.5e-3;
  const double lateral = 1.0 - kNu * kNu;
  ContactGeometry sphere, cone, punch;
  sphere.sphere_radius_m = punch.punch_radius_m = kRadius;
  cone.cone_half_angle_rad = std::numbers::pi / 3.0;
  for (ContactGeometry* g : {&sphere, &cone, &punch}) g->poisson_ratio = kNu;
  for (const Probe& probe : std::vector<Probe>{
           {"hertz-1", sphere, 4.0 / 3.0 / lateral * std::sqrt(kRadius * kReference)},
           {"power-1", cone, 2.0 / std::numbers::pi / lateral * std::sqrt(3.0) * kReference},
           {"linear-1", punch, 2.0 * kRadius / lateral}}) {
    INFO(probe.law);
    LawSpec spec = parse_law_name(probe.law, "test");
    spec.reference = kReference;
    CHECK_THAT(modulus_Pa(spec, probe.stiffness, probe.geometry).value(), WithinRel(1.0, 1e-12));
    // E = 4 kPa in the end and 6 kPa more at once, pressed in by 0.5 mm.
    Recording r;
    for (int i = 0; i < 200; ++i) {
      r.time_s.push_back(0.1 * i);
      r.drive.push_back(0.5e-3 * std::min(r.time_s.back() / 2.0, 1.0));
    }
    std::vector<double> values{4000.0 * probe.stiffness, 6000.0 * probe.stiffness, 3.0};
    if (spec.kernel == Kernel::power) values.push_back(2.0);
    values.insert(values.end(), {0.0, 0.0});
    const Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
    const Eigen::VectorXd f = LawModel(spec).respond(history, r.time_s, values, Want::values).value;
    Random random(11);
    for (const double force : f) {
      r.response.push_back(force + 2e-3 * f.maxCoeff() * random.normal());
    }
    const std::vector<PreparedRecording> one{prepare_recording("p.csv", r)};
    SetupOptions setup;
    setup.exponent = probe_exponent(probe.geometry);
    const FitResult fit =
        run_fit(recording_config(parse_law_name(probe.law, "test"), one, setup), data_sets(one));
    const YoungModuli all = young_moduli(fit, probe.geometry, false);
    REQUIRE(all.moduli.size() == 3);
    const double true_values[] = {4000.0, 6000.0, 10000.0};
    for (std::size_t i = 0; i < all.moduli.size(); ++i) {
      const YoungModulus& m = all.moduli[i];
      INFO(m.name << " " << m.estimate << ", " << *m.lower << " .. " << *m.upper);
      CHECK(m.unit == "Pa");
      CHECK_THAT(m.estimate, WithinRel(true_values[i], 0.03));
      CHECK(*m.lower < m.estimate);
      CHECK(m.estimate < *m.upper);
      CHECK(std::abs(m.estimate - true_values[i]) < 4.0 * *m.standard_error);
    }
    CHECK(all.moduli.back().name == "E_instantaneous");
    CHECK_THAT(to_terminal_text(all), Contains("Poisson's ratio 0.45 (given)") && Contains("kPa"));
    CHECK(all.remarks.empty());
  }
  sphere.sphere_radius_m = 0.4e-3;
  LawSpec deep = parse_law_name("hertz-1", "test");
  deep.reference = kReference;
  CHECK(geometry_remarks(deep, sphere, 1e-3).at(0).code == "deep_for_sphere");
  CHECK_THAT(geometry_remarks(deep, sphere, 1e-3).at(0).text,
             Contains("the depth of 1 mm is 2.5 of the sphere's radius (0.4 mm)"));
  // What the probe travelled before contact is no depth; without a fit the reference has to do.
  deep.reference = 5e-3;
  CHECK(geometry_remarks(deep, sphere, 0.02e-3).empty());
  CHECK_THAT(geometry_remarks(deep, sphere, std::nullopt).at(0).text,
             Contains("the depth of 5 mm"));
  ContactGeometry both = sphere;
  both.punch_radius_m = 1e-3;
  CHECK_THROWS_AS(modulus_Pa(deep, 1.0, both), Error);
}
