// JPK force files: written by Python's zipfile (tests/programs/write_jpk.py) from numbers whose
// forces and depths are known, and refused where they are not sound.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>

#include "jpk_archive.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/description.hpp"
#include "tpm/files/import/import.hpp"
#include "tpm/files/import/jpk_segment.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/files/json.hpp"
#include "tpm/files/zip_archive.hpp"
#include "tpmkit/curve_file.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::files;
using test::TempFolder;

namespace {

/// Writes a curve with Python and returns its path.
std::string written_by_python(const TempFolder& folder, const std::string& variant,
                              const std::string& csv = {}) {
  std::string path = folder / (variant + ".jpk-force");
  const std::string command = "python3 '" TPM_TEST_SOURCE_DIR "/tests/programs/write_jpk.py' '" +
                              path + "' " + variant + (csv.empty() ? "" : " '" + csv + "'");
  REQUIRE(std::system(command.c_str()) == 0);
  return path;
}

/// Sample i of the curve that write_jpk.py states: how many half volts the deflection lies above
/// the baseline, and the height of the cantilever.
struct Stated {
  double time_s, half_volts, height_m;
};

std::vector<Stated> stated_samples() {
  std::vector<Stated> samples;
  for (int i = 0; i < 8; ++i) samples.push_back({0.1 * i, std::max(0.0, i - 3.0), (20 - i) * 1e-6});
  for (int i = 0; i < 4; ++i) samples.push_back({0.8 + 0.5 * i, 4 - 0.5 * i, 13e-6});
  for (int i = 0; i < 4; ++i) samples.push_back({2.8 + 0.1 * i, 0.0, (15 + 2 * i) * 1e-6});
  return samples;
}

constexpr double kSpring = 0.05;        // N/m
constexpr double kPerHalfVolt = 50e-9;  // m: half a volt of 100 nm/V

void check_stated(const Recording& recording, double spring = kSpring) {
  const std::vector<Stated> samples = stated_samples();
  REQUIRE(recording.time_s.size() == samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    INFO(i);
    const double deflection_m = kPerHalfVolt * samples[i].half_volts;
    CHECK(std::abs(recording.time_s[i] - samples[i].time_s) < 1e-12);
    CHECK(std::abs(recording.force_N()[i] - spring * deflection_m) < 1e-20);
    CHECK(std::abs(recording.depth_m()[i] - (20e-6 - samples[i].height_m - deflection_m)) < 1e-16);
  }
}

std::string finding_of(const std::vector<ImportFinding>& findings, const std::string& what) {
  for (const ImportFinding& found : findings) {
    if (found.what == what) return found.value;
  }
  return "(none)";
}

std::vector<std::size_t> sizes(const std::vector<RecordedSegment>& segments) {
  std::vector<std::size_t> samples;
  for (const RecordedSegment& segment : segments) samples.push_back(segment.samples);
  return samples;
}

}  // namespace

TEST_CASE("a JPK force curve in three ways of storing it gives the forces and depths it states") {
  const TempFolder folder;
  for (const std::string variant : {"shared", "plain", "float"}) {
    INFO(variant);
    const RecordingFile file = read_recording_file(written_by_python(folder, variant));
    CHECK(file.recording.provenance == Provenance::measured);
    check_stated(file.recording);
    CHECK(finding_of(file.findings, "contact_force") ==
          "channel vDeflection, spring constant 0.05 N/m, sensitivity 100 nm/V, baseline -0.25 V "
          "subtracted");
    CHECK(finding_of(file.findings, "segments") ==
          "extend (8 samples, z-extend-force), pause (4 samples, constant-height-pause), retract "
          "(4 samples, z-retract-height)");
    CHECK(finding_of(file.findings, "recorded") == "2026-01-01 10:00:00.000 +0000");
  }
}

TEST_CASE("the description of an imported JPK curve holds its segments and how forces were made") {
  const TempFolder folder;
  auto curves = import_curves(written_by_python(folder, "shared"), {});
  REQUIRE(curves.size() == 1);
  CurveDescription& description = curves[0].description;
  description.header.id = "c";
  description.header.title = "t";
  write_file(folder / "c.csv", curves[0].csv);
  write_file(folder / "c.json", to_text(description_json(description)));
  check_stated(load_recording(folder / "c.csv"));
  const CurveDescription read = read_description(folder / "c.json");
  REQUIRE(read.segments.size() == 3);
  CHECK(read.segments[1].kind == "pause");
  CHECK(read.segments[1].control == "constant-height-pause");
  CHECK(sizes(read.segments) == std::vector<std::size_t>{8, 4, 4});
  CHECK(read.header.note.find("spring constant 0.05 N/m") != std::string::npos);
}

TEST_CASE("a curve without a spring constant needs one; one that is given replaces the file's") {
  const TempFolder folder;
  const std::string file = written_by_python(folder, "uncalibrated");
  CHECK_THROWS_WITH(read_recording_file(file), Catch::Contains("--spring-constant"));
  ImportOptions options;
  options.spring_constant_N_per_m = 0.2;
  check_stated(read_recording_file(file, options).recording, 0.2);
  const RecordingFile given = read_recording_file(written_by_python(folder, "shared"), options);
  check_stated(given.recording, 0.2);
  CHECK(finding_of(given.findings, "contact_force").find("0.2 N/m (given; 0.05 N/m in the file)") !=
        std::string::npos);
}

TEST_CASE("segments are chosen by kind, and contact cuts the first of them") {
  const TempFolder folder;
  const std::string file = written_by_python(folder, "shared");
  ImportOptions options;
  options.segments = {"pause", "extend"};
  auto curves = import_curves(file, options);
  CHECK(sizes(curves.at(0).description.segments) == std::vector<std::size_t>{8, 4});

  options.segments.clear();
  options.contact_force_N = 2e-9;  // first passed at sample 4, by 2.5 nN
  curves = import_curves(file, options);
  CHECK(sizes(curves.at(0).description.segments) == std::vector<std::size_t>{4, 4, 4});
  CHECK(finding_of(curves[0].findings, "contact").find("sample 5, force 2.5 nN") == 0);
  options.segments = {"retract"};
  CHECK_THROWS_WITH(import_curves(file, options), Catch::Contains("the force never stays"));
}

namespace {

std::string jpk_file(const TempFolder& folder, const test::ZipMembers& members) {
  std::string path = folder / "curve.jpk-force";
  write_file(path, test::zipped(members));
  return path;
}

/// The curve without the members of one segment.
test::ZipMembers without_segment(test::ZipMembers members, int number) {
  std::erase_if(members, [&](const auto& member) {
    return member.first.starts_with("segments/" + std::to_string(number) + "/");
  });
  return members;
}

/// The curve with other text in the properties of one segment.
test::ZipMembers with_property(test::ZipMembers members, int number, const std::string& from,
                               const std::string& to) {
  const std::string wanted = "segments/" + std::to_string(number) + "/segment-header.properties";
  for (auto& [name, bytes] : members) {
    if (name == wanted) bytes.replace(bytes.find(from), from.size(), to);
  }
  return members;
}

}  // namespace

TEST_CASE("a missing segment leaves a hole in the time, and is refused") {
  const TempFolder folder;
  const test::ZipMembers whole = test::jpk_curve({"extend", "pause", "retract"});
  const auto end_s = [&](const test::ZipMembers& members, std::vector<std::string> kinds = {}) {
    ImportOptions options;
    options.segments = std::move(kinds);
    return read_recording_file(jpk_file(folder, members), options).recording.time_s.back();
  };
  CHECK(end_s(whole) == 5.5);
  for (const auto& [kinds, expected] :
       std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{}, "segment 1 is not in the archive"},
           {{"extend", "retract"}, "segment 1 is not in the archive"}}) {
    CHECK_THROWS_WITH(
        end_s(without_segment(whole, 1), kinds),
        Catch::Contains(expected) && Catch::Contains("--segments on one side of it, of"));
  }
  CHECK(end_s(without_segment(whole, 1), {"extend"}) == 1.5);
  CHECK(end_s(without_segment(whole, 2)) == 3.5);
  CHECK_THROWS_WITH(end_s(without_segment(whole, 0)),
                    Catch::Contains("segment 0 is not in the archive: the approach is missing"));
  CHECK(end_s(without_segment(whole, 0), {"pause", "retract"}) == 3.5);

  const auto unrecorded = with_property(whole, 1, "num-points=4", "num-points=0");
  CHECK_THROWS_WITH(end_s(unrecorded), Catch::Contains("segment 1 (pause, 2 s) has no samples"));
  CHECK_THROWS_WITH(end_s(unrecorded, {"extend", "retract"}), Catch::Contains("has no samples"));
  CHECK_THROWS_WITH(end_s(unrecorded, {"pause"}), Catch::Contains("has no segment 'pause'"));
  CHECK(end_s(unrecorded, {"extend"}) == 1.5);
  CHECK(end_s(unrecorded, {"retract"}) == 1.5);
  CHECK(end_s(with_property(unrecorded, 1, "duration=2", "duration=0")) == 3.5);
  CHECK(end_s(with_property(whole, 2, "num-points=4", "num-points=0")) == 3.5);
  const auto without_approach = with_property(whole, 0, "num-points=4", "num-points=0");
  CHECK_THROWS_WITH(end_s(without_approach), Catch::Contains("segment 0 (extend, 2 s) has no"));
  CHECK(end_s(without_approach, {"pause", "retract"}) == 3.5);
}

TEST_CASE("the law fitted to a JPK force curve is the law that made it") {
  // Approach, contact at 1 s, ramp to 3 um in 1.5 s, hold: in closed form, with a little noise.
  const double k_inf = 0.02, k1 = 0.03, tau = 0.5, speed = 2e-6, ramp = 1.5;
  const TempFolder folder;
  Random random(1);
  std::ofstream csv(folder / "c.csv");
  csv.precision(12);
  for (int i = 0; i < 900; ++i) {
    const double t = 0.01 * i - 1.0;
    const double loading = std::clamp(t, 0.0, ramp);
    const double relaxing = k1 * speed * tau * (1.0 - std::exp(-loading / tau)) *
                            std::exp(-std::max(0.0, t - ramp) / tau);
    const double force = k_inf * speed * loading + relaxing + 1e-10 * random.normal();
    csv << 0.01 * i << ',' << speed * (std::min(t, ramp) + 1.0) << ',' << force << '\n';
  }
  csv.close();
  const std::string curve = written_by_python(folder, "shared", folder / "c.csv");
  const std::string out = folder / "fit.json";
  const std::string fit = std::string("\"") + TPM_TEST_PROGRAM + "\" fit \"" + curve +
                          "\" --laws linear-1 --no-draw --format json >\"" + out + "\"";
  REQUIRE(std::system(fit.c_str()) == 0);
  const Json answer = read_json(out);
  std::map<std::string, double> estimates;
  for (const Json& parameter : answer.at("fit").at("parameters")) {
    estimates[parameter.at("name")] = parameter.at("estimate_SI");
  }
  CHECK(estimates.at("k_inf") == Approx(k_inf).epsilon(0.005));
  CHECK(estimates.at("k1") == Approx(k1).epsilon(0.005));
  CHECK(estimates.at("tau1") == Approx(tau).epsilon(0.01));
}

TEST_CASE("Java properties: comments, escapes, continued lines and blocks that are shared") {
  const PropertyMap read = parse_properties(
      "# comment = no\n  ! neither\r\n\r\na=1\nb : 2\nc 3\nd\\=e=f\\:g\nlong=one \\\n   "
      "two\nempty=\n"
      "last=\\\\");
  CHECK(read == PropertyMap{{"a", "1"},
                            {"b", "2"},
                            {"c", "3"},
                            {"d=e", "f:g"},
                            {"long", "one two"},
                            {"empty", ""},
                            {"last", "\\"}});
  CHECK(parse_properties("a=1\\").at("a") == "1");
  CHECK(parse_properties("=x").at("") == "x");

  const PropertyMap shared{
      {"lcd-info.1.unit", "m"}, {"lcd-info.10.unit", "N"}, {"other.1.unit", "s"}};
  const JpkProperties properties(
      {{"channel.z.lcd-info.*", "1"}, {"channel.zz.lcd-info.*", "10"}, {"channel.z.own", "2"}},
      shared, "f");
  CHECK(properties.find("channel.z.unit") == "m");
  CHECK(properties.find("channel.zz.unit") == "N");
  CHECK(properties.number("channel.z.own") == 2.0);
  CHECK_FALSE(properties.find("channel.y.unit"));
  CHECK_THROWS_WITH(properties.text("channel.z.none"), Catch::Contains("f: key channel.z.none"));
}

TEST_CASE("a ZIP archive is read by name, stored or deflated, and any changed byte is noticed") {
  const test::ZipMembers members{
      {"b", std::string(100'000, 'x') + "end"}, {"a/c", "short"}, {"e", ""}};
  for (const int method : {0, Z_DEFLATED}) {
    const std::string bytes = test::zipped(members, method);
    const ZipArchive archive(bytes, "z");
    CHECK(archive.names() == std::vector<std::string>{"a/c", "b", "e"});
    for (const auto& [name, content] : members) CHECK(archive.read(name, 1 << 20) == content);
    CHECK_THROWS_WITH(archive.read("b", 1000), Catch::Contains("holds 100003 bytes"));
    CHECK_THROWS_WITH(archive.read("c", 1000), Catch::Contains("is not in the archive"));
  }
  const std::string whole = test::zipped({{"a", "four samples"}}, 0);
  // Cut off within the last bytes, minizip still finds everything: the content is what it was.
  constexpr std::size_t kEndOfDirectory = 22;
  for (std::size_t length = 0; length <= whole.size() - kEndOfDirectory; ++length) {
    INFO(length);
    const std::string cut = whole.substr(0, length);
    CHECK_THROWS_AS(ZipArchive(cut, "z").read("a", 100), Error);
  }
  int refused = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    for (const int bit : {0, 3, 7}) {
      std::string changed = whole;
      changed[i] = static_cast<char>(changed[i] ^ (1 << bit));
      try {
        const std::string read = ZipArchive(changed, "z").read("a", 100);
        CHECK(read == "four samples");
      } catch (const Error&) {
        ++refused;
      }
    }
  }
  CHECK(refused > 100);
}
