// Laws over frequency, in files, and exported: against simulated cycles, differences and parsers.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <sstream>

#include "expected_values.hpp"
#include "temp_folder.hpp"
#include "tpm/files/blocks/law_export.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpmkit/frequency_response.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/law_model.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::files;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

const std::vector<std::string> kSpectrumLaws{
    "linear",          "linear-2",     "linear-2-fluid",      "linear-2-series",
    "power-1-elastic", "hertz-1",      "linear-1-relaxing",   "linear-fspringpot",
    "linear-fmaxwell", "power-fzener", "linear-fkelvin_voigt"};

double plausible(const LawParameter& p, std::size_t place) {
  if (p.dimension == Dimension::stiffness) return 12.0 + 3.0 * static_cast<double>(place);
  if (p.dimension == Dimension::time) return 0.1 * std::pow(3.0, static_cast<double>(place));
  if (p.name == "exponent") return 1.7;
  if (p.name == "spacing") return 2e-3;
  return p.nuisance ? 0.0 : 0.4;
}

std::vector<double> plausible(const LawSpec& spec) {
  std::vector<double> values;
  for (const LawParameter& p : law_parameters(spec)) values.push_back(plausible(p, values.size()));
  return values;
}

/// Fourier coefficients of the last of many simulated cycles, from the law in time.
std::pair<double, double> simulated(const LawSpec& spec, const std::vector<double>& values,
                                    double frequency, double depth, double amplitude) {
  constexpr int kCycles = 40;
  constexpr int kSamples = 1000;  // per cycle
  std::vector<double> time;
  std::vector<double> drive;
  const double omega = 2.0 * std::numbers::pi * frequency;
  for (int i = 0; i <= kCycles * kSamples; ++i) {
    time.push_back(i / (frequency * kSamples));
    drive.push_back(depth + amplitude * std::sin(omega * time.back()));
  }
  Protocol protocol = measured_history(Drive::displacement, time, drive);
  protocol.set_equilibrium_at_start(true);
  const std::vector<double> last(time.end() - kSamples, time.end());
  const auto force = LawModel(spec).respond(protocol, last, values, Want::values).value;
  double sine = 0.0;
  double cosine = 0.0;
  for (int i = 0; i < kSamples; ++i) {
    sine += force[i] * std::sin(omega * last[static_cast<std::size_t>(i)]);
    cosine += force[i] * std::cos(omega * last[static_cast<std::size_t>(i)]);
  }
  const double scale = 2.0 / (kSamples * amplitude);
  return {scale * sine, scale * cosine};
}

LawFile some_law(const char* name) {
  LawFile law;
  law.spec = parse_law_name(name, "test");
  law.values = plausible(law.spec);
  return law;
}

/// All numbers of a text after `marker`, with anything between them.
std::vector<double> numbers_after(std::string text, const std::string& marker) {
  const auto at = text.find(marker);
  REQUIRE(at != std::string::npos);
  text = text.substr(text.find('\n', at) + 1);
  for (char& c : text) {
    if (c == ',') c = ' ';
  }
  std::istringstream stream(text);
  std::vector<double> numbers;
  for (double v = 0.0; stream >> v;) numbers.push_back(v);
  return numbers;
}

double tag(const std::string& text, const std::string& name) {
  const auto at = text.find("<" + name + ">");
  REQUIRE(at != std::string::npos);
  return std::stod(text.substr(at + name.size() + 2));
}

}  // namespace

TEST_CASE("small cycles in time have the storage and loss of the spectrum", "[spectrum]") {
  for (const char* name : {"linear-2", "linear-2-fluid", "linear-2-series", "linear-fzener",
                           "linear-fkelvin_voigt", "linear-1-elastic", "hertz-1"}) {
    const LawSpec spec = parse_law_name(name, "test");
    const auto values = plausible(spec);
    const bool linear = spec.kernel == Kernel::linear && spec.tension == Tension::none;
    const double frequency = 1.0;
    const std::vector<double> at{frequency};
    // Deep enough that a fluid, which relaxes, is never pulled: the offset of the depth jumps at 0.
    const double depth = 1e-3;
    const double amplitude = linear && spec.solid ? 1e-4 : 1e-7;
    if (!spec.solid) continue;
    const auto [storage, loss] = simulated(spec, values, frequency, depth, amplitude);
    const SpectrumResponse r = respond_spectrum(spec, values, at, depth, Want::values);
    const double size = std::hypot(r.storage[0], r.loss[0]);
    INFO(name);
    // 1000 chords for each cycle take away (2 pi/1000)^2/12 of a sine; fractional transients die as
    // a power of time.
    const double chord = 1.0 - std::pow(2.0 * std::numbers::pi / 1000.0, 2) / 12.0;
    const double tolerance = spec.fractional == Fractional::none ? 1e-5 : 1e-2;
    CHECK_THAT(storage, WithinAbs(chord * r.storage[0], tolerance * size));
    CHECK_THAT(loss, WithinAbs(chord * r.loss[0], tolerance * size));
  }
}

TEST_CASE("storage rises, loss is positive, derivatives agree with differences", "[spectrum]") {
  std::vector<double> frequency;
  for (int i = 0; i < 17; ++i) frequency.push_back(1e-4 * std::pow(3.0, i));
  for (const std::string& name : kSpectrumLaws) {
    const LawSpec spec = parse_law_name(name, "test");
    const auto values = plausible(spec);
    const auto ask = [&](const std::vector<double>& v, Want want) {
      return respond_spectrum(spec, v, frequency, 1.6e-3, want);
    };
    const SpectrumResponse r = ask(values, Want::values_and_sensitivity);
    INFO(name);
    CHECK(r.loss.minCoeff() >= 0.0);
    for (Eigen::Index i = 1; i < r.storage.size(); ++i) CHECK(r.storage[i] >= r.storage[i - 1]);
    for (std::size_t j = 0; j < values.size(); ++j) {
      const double width = std::max(values[j], 1e-3);
      const double step = 1e-5 * width;
      auto up = values;
      auto down = values;
      up[j] += step;
      down[j] -= step;
      const auto above = ask(up, Want::values);
      const auto below = ask(down, Want::values);
      const auto column = static_cast<Eigen::Index>(j);
      const double scale = std::max(r.storage.maxCoeff(), r.loss.maxCoeff()) / width;
      INFO(law_parameters(spec)[j].name);
      CHECK(((above.storage - below.storage) / (2.0 * step) - r.storage_by.col(column))
                .cwiseAbs()
                .maxCoeff() < 1e-7 * scale);
      CHECK(
          ((above.loss - below.loss) / (2.0 * step) - r.loss_by.col(column)).cwiseAbs().maxCoeff() <
          1e-7 * scale);
    }
  }
}

TEST_CASE("a spring-pot is a power of the frequency", "[spectrum]") {
  const std::vector<double> frequency{0.1, 1.0, 10.0};
  const auto r = respond_spectrum(parse_law_name("linear-fspringpot", "test"), {{5.0, 0.3, 0, 0}},
                                  frequency, {}, Want::values);
  for (Eigen::Index i = 1; i < 3; ++i) {
    CHECK_THAT(r.storage[i] / r.storage[i - 1], WithinRel(std::pow(10.0, 0.3), 1e-13));
  }
  CHECK_THAT(r.loss_tangent()[0], WithinRel(std::tan(0.15 * std::numbers::pi), 1e-13));
}

TEST_CASE("the paper's element over frequency is linear-1", "[spectrum]") {
  const TpmParameters p;
  const std::vector<double> frequency{0.01, 30.0, 500.0};
  const auto element = element_spectrum(to_vector(p), frequency, Want::values_and_sensitivity);
  const auto law = respond_spectrum(
      parse_law_name("linear-1", "test"),
      {{p.equilibrium_modulus_Pa(), p.relaxing_modulus_Pa(), p.relaxation_time_s(), 0, 0}},
      frequency, {}, Want::values);
  CHECK((element.storage - law.storage).norm() < 1e-12 * law.storage.norm());
  CHECK((element.loss - law.loss).norm() < 1e-12 * law.loss.norm());
  TpmParameters more = p;
  more.eta1_Pa_s *= 1.0 + 1e-6;
  const auto moved = element_spectrum(to_vector(more), frequency, Want::values);
  CHECK_THAT((moved.loss[1] - element.loss[1]) / (1e-6 * p.eta1_Pa_s),
             WithinRel(element.loss_by(1, kEta1), 1e-5));
}

TEST_CASE("law files go there and back, and faults are named", "[law file]") {
  const test::TempFolder folder;
  for (const std::string& name : kSpectrumLaws) {
    LawFile law = some_law(name.c_str());
    law.note = "a note";
    write_law(folder / "law.json", law);
    const LawFile back = read_law(folder / "law.json");
    CHECK(back.spec == law.spec);
    CHECK(back.values == law.values);
    CHECK(back.note == law.note);
  }
  const Json good = to_json(some_law("linear-1"));
  const auto refused = [&](const char* key, const Json& value, const char* word) {
    Json bad = good;
    bad["parameters"][key] = value;
    CHECK_THROWS_WITH(law_from_json(bad, "law.json"), Catch::Contains(word));
  };
  refused("k2_N_per_m", 1.0, "unknown parameter");
  refused("tau1_s", -1.0, "tau1 = -1");
  Json missing = good;
  missing["parameters"].erase("tau1_s");
  CHECK_THROWS_WITH(law_from_json(missing, "law.json"), Catch::Contains("no parameter 'tau1_s'"));
}

TEST_CASE("an incompressible law is exported with its shear modulus", "[export]") {
  const LawFile law = some_law("hertz-1");
  ExportOptions options;
  options.geometry.sphere_radius_m = 2e-3;
  options.geometry.poisson_ratio = 0.5;
  const double instant = prony_table(law.spec, law.values, {}).instant;
  const double shear = *modulus_Pa(law.spec, instant, options.geometry) / 3.0;
  const std::string abaqus = export_law(law, options);
  const auto elastic = numbers_after(abaqus, "*ELASTIC, MODULI=INSTANTANEOUS");
  CHECK(elastic.at(1) == 0.4995);
  CHECK_THAT(elastic.at(0) / (2.0 * (1.0 + elastic.at(1))), WithinRel(shear, 1e-9));
  CHECK_THAT(abaqus, Catch::Contains("Poisson's ratio is written as 0.4995"));
}

TEST_CASE("exported tables reproduce the relaxation", "[export]") {
  const std::vector<double> times{0.0, 0.05, 0.3, 1.0, 4.0, 30.0, 1e4};
  for (const char* name : {"linear-1", "linear-2", "linear-4", "hertz-1", "linear-2-series"}) {
    const LawFile law = some_law(name);
    ExportOptions options;
    options.geometry.sphere_radius_m = 2e-3;
    const double instant = prony_table(law.spec, law.values, {}).instant;
    const double modulus = *modulus_Pa(law.spec, instant, options.geometry);
    const auto compare = [&](auto curve) {
      for (const double t : times) {
        const double exact = modulus * relaxation_stiffness(law.spec, law.values, t) / instant;
        INFO(name << " at " << t);
        CHECK_THAT(curve(t), WithinRel(exact, 1e-6));
      }
    };
    const std::string abaqus = export_law(law, options);
    const auto elastic = numbers_after(abaqus, "*ELASTIC, MODULI=INSTANTANEOUS");
    const auto rows = numbers_after(abaqus, "*VISCOELASTIC, TIME=PRONY");
    compare([&](double t) {
      double g = 1.0;
      for (std::size_t i = 0; i < rows.size(); i += 3) g -= rows[i] * -std::expm1(-t / rows[i + 2]);
      return elastic[0] * g;
    });
    options.target = ExportTarget::febio;
    const std::string febio = export_law(law, options);
    compare([&](double t) {
      double g = 1.0;
      for (int i = 1; febio.find("<g" + std::to_string(i) + ">") != std::string::npos; ++i) {
        g += tag(febio, "g" + std::to_string(i)) *
             std::exp(-t / tag(febio, "t" + std::to_string(i)));
      }
      return g * tag(febio, "E");
    });
    options.target = ExportTarget::ansys;
    std::string ansys = export_law(law, options);
    const double ex = std::stod(ansys.substr(ansys.find("MP,EX,1,") + 8));
    ansys = ansys.substr(0, ansys.find(",BULK"));
    std::vector<double> terms;
    std::istringstream lines(ansys);
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with("TBDATA,")) continue;
      std::istringstream cells(line.substr(line.find(',', 7) + 1));
      for (std::string cell; std::getline(cells, cell, ',');) terms.push_back(std::stod(cell));
    }
    compare([&](double t) {
      double g = 1.0;
      for (std::size_t i = 0; i < terms.size(); i += 2)
        g += terms[i] * std::expm1(-t / terms[i + 1]);
      return ex * g;
    });
  }
}

TEST_CASE("fractional laws are exported with their error; what cannot be said is refused",
          "[export]") {
  for (const char* name :
       {"linear-fspringpot", "linear-fmaxwell", "linear-fkelvin_voigt", "linear-fzener"}) {
    const LawFile law = some_law(name);
    const PronyTable table = prony_table(law.spec, law.values, {0.01, 100.0, 0});
    INFO(name << " " << table.worst_relative_error);
    CHECK(table.fitted);
    CHECK(table.worst_relative_error < test::allowed_error("prony.fractional"));
    for (const double t : {0.01, 0.37, 100.0}) {
      const double exact = relaxation_stiffness(law.spec, law.values, t);
      CHECK_THAT(table.at(t), WithinRel(exact, 1.01 * table.worst_relative_error));
    }
    ExportOptions options;
    CHECK_THAT(export_law(law, options), Catch::Contains("largest relative error"));
  }
  ExportOptions options;
  options.target = ExportTarget::febio;
  CHECK_THROWS_WITH(export_law(some_law("linear-7"), options), Catch::Contains("7 terms"));
  CHECK_THROWS_WITH(export_law(some_law("linear-1-fluid"), options), Catch::Contains("a solid"));
  CHECK_THROWS_WITH(export_law(some_law("power-1"), options), Catch::Contains("power kernel"));
  CHECK_THROWS_WITH(export_law(some_law("linear-1-elastic"), options), Catch::Contains("tension"));
  options.relaxation_only = true;
  CHECK_THAT(export_law(some_law("linear-1-elastic"), options),
             Catch::Contains("left out: the elastic tension, ") &&
                 Catch::Contains("the contact is stiffer by it than what is exported"));
  CHECK_THAT(export_law(some_law("linear-1-relaxing"), options),
             Catch::Contains("left out: the shape of the tension, "));
  CHECK_THAT(export_law(some_law("power-1"), options),
             Catch::Contains("left out: the power kernel (exponent "));
  options.geometry.area_m2 = 1e-4;
  CHECK_THROWS_WITH(export_law(some_law("linear-1"), options), Catch::Contains("without a length"));
}

TEST_CASE("a modulus from a depth that is deep for the ball is exported with a warning",
          "[export]") {
  LawFile law = some_law("hertz-1");
  ExportOptions options;
  options.geometry.sphere_radius_m = 7.5e-3;
  law.spec.reference = 8e-3;
  for (const char* target : {"abaqus", "ansys", "febio", "json"}) {
    options.target = parse_export_target(target, "test");
    CHECK_THAT(
        export_law(law, options),
        Catch::Contains("WARNING: the depth of 8 mm is 1.07 of the sphere's radius (7.5 mm)"));
  }
  law.spec.reference = 0.5e-3;
  CHECK_THAT(export_law(law, options), !Catch::Contains("WARNING"));
}
