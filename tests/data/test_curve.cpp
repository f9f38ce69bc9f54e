#include <catch2/catch.hpp>
#include <cmath>

#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/files/import/pack.hpp"
#include "tpm/files/json.hpp"
#include "tpmkit/curve_file.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::files;
using Catch::Matchers::WithinRel;
using test::TempFolder;

namespace {

constexpr const char* kPoints = R"({
  "id": "c", "title": "t", "kind": "points", "observable": "contact_force",
  "time_origin": "end_of_ramp",
  "columns": {"depth_mm": {"quantity": "indentation_depth", "unit": "mm"},
              "time_s": {"quantity": "time", "unit": "s", "provenance": "assumed"},
              "force_mN": {"quantity": "contact_force", "unit": "mN"},
              "sd_mN": {"quantity": "contact_force", "unit": "mN", "bound": "sd"}}})";

constexpr const char* kRecording = R"({
  "id": "c", "title": "t", "kind": "recording", "observable": "stress", "provenance": "measured",
  "columns": {"time_min": {"quantity": "time", "unit": "min"},
              "stretch": {"quantity": "relative_length"},
              "stress_kPa": {"quantity": "stress", "unit": "kPa"}}})";

/// The message that loading this pair of files gives, without the folder; "" if it succeeds.
std::string error_of(const std::string& json, const std::string& csv) {
  const TempFolder folder;
  write_file(folder / "c.json", json);
  write_file(folder / "c.csv", csv);
  try {
    static_cast<void>(load_curve(folder / "c.csv"));
  } catch (const Error& error) {
    std::string message = error.what();
    const std::string path = folder / "";
    if (message.starts_with(path)) message.erase(0, path.size());
    return message;
  }
  return "";
}

}  // namespace

TEST_CASE("the relaxation data are the eight printed numbers, in SI, with assumed times") {
  const PointSet points = load_points("evren_relaxation");
  const std::vector<double> depth_mm = {2, 2, 4, 4, 6, 6, 8, 8};
  const std::vector<double> force_N = {0.32, 0.21, 0.62, 0.32, 0.88, 0.48, 1.72, 0.68};
  REQUIRE(points.data.size() == 8);
  for (std::size_t i = 0; i < 8; ++i) {
    INFO(i);
    const Datum& datum = points.data[i];
    CHECK_THAT(datum.depth_m.value(), WithinRel(depth_mm[i] * 1e-3, 1e-14));
    CHECK_THAT(datum.value.value(), WithinRel(force_N[i], 1e-15));
    CHECK(datum.time_s == (i % 2 == 0 ? 0.0 : 30.0));
    CHECK(datum.label == (i % 2 == 0 ? "peak" : "end"));
    CHECK(datum.provenance == Provenance::table);
    CHECK(datum.where == "Table " + std::to_string(1 + i / 2));
    CHECK(datum.line == static_cast<int>(i) + 2);
  }
  CHECK(points.observable == Observable::contact_force);
  CHECK(points.time_origin == TimeOrigin::end_of_ramp);
  CHECK(points.time_provenance == Provenance::assumed);
  CHECK_THAT(points.header.probe.diameter_m.value(), WithinRel(4e-3, 1e-15));
  CHECK(points.header.sha256 ==
        sha256_hex(read_file(share_dir() / "data" / "evren_relaxation.csv")));
}

TEST_CASE("the static and creep data are bands") {
  const PointSet fixed = load_points("evren_static");
  REQUIRE(fixed.data.size() == 4);
  CHECK(fixed.time_origin == TimeOrigin::none);
  CHECK(fixed.data[3].is_band());
  CHECK_FALSE(fixed.data[3].value.has_value());
  CHECK_FALSE(fixed.data[3].time_s.has_value());
  CHECK_THAT(fixed.data[3].lower.value(), WithinRel(0.23, 1e-15));
  CHECK_THAT(fixed.data[3].upper.value(), WithinRel(0.89, 1e-15));

  const PointSet creep = load_points("amy_creep");
  REQUIRE(creep.data.size() == 2);
  CHECK(creep.observable == Observable::indentation_depth);
  CHECK(creep.time_provenance == Provenance::assumed);
  CHECK(creep.data[0].load_N == 0.196);
  CHECK_FALSE(creep.data[0].depth_m.has_value());
  CHECK_THAT(creep.data[0].upper.value(), WithinRel(6.65e-3, 1e-14));
  CHECK(creep.data[1].time_s == 300.0);
}

TEST_CASE("derived literature values carry a formula that gives them") {
  const ValueSet amy = load_values("amy_abstract");
  const double area = amy.at("contact_area").value.value();
  const NamedValue& stress = amy.at("nominal_surface_stress");
  CHECK_THAT(0.196 / stress.lower.value(), WithinRel(area, 5e-3));
  CHECK_THAT(0.98 / stress.upper.value(), WithinRel(area, 5e-3));
  CHECK_THAT(2.0 * std::sqrt(area / M_PI), WithinRel(amy.at("punch_diameter").value.value(), 5e-3));
  CHECK(amy.at("punch_diameter").provenance == Provenance::derived);
  CHECK_FALSE(amy.at("nominal_strain").lower.has_value());
  CHECK_THAT(amy.at("nominal_strain").upper.value(), WithinRel(0.5, 1e-15));
  const ValueSet literature = load_values("literature_values");
  CHECK(literature.at("carter_elastic_modulus").value == 490e3);
  CHECK_THAT(literature.at("klatt_viscosity").plus_minus.value(), WithinRel(1.6, 1e-15));
  CHECK_THROWS_AS(literature.at("nobody"), Error);
}

TEST_CASE("a recording keeps its quantities and refuses to be taken for another") {
  const TempFolder folder;
  write_file(folder / "c.json", kRecording);
  write_file(folder / "c.csv", "time_min,stretch,stress_kPa\n0,0.95,1\n0.5,1.05,-2\n");
  const Recording recording = load_recording(folder / "c.json");
  CHECK(recording.time_s == std::vector<double>{0, 30});
  CHECK(recording.drive == std::vector<double>{0.95, 1.05});
  CHECK(recording.response == std::vector<double>{1000, -2000});
  CHECK(recording.drive_quantity == Quantity::relative_length);
  CHECK(recording.response_quantity == Quantity::stress);
  CHECK_THROWS_WITH(recording.force_N(), "c: the recording holds stress; expected contact_force");
  CHECK_THROWS_AS(recording.depth_m(), Error);
  CHECK_THROWS_WITH(load_points(folder / "c.csv"),
                    Catch::EndsWith("is a curve of kind recording; expected kind points"));
}

TEST_CASE("each fault of a curve file is told with its place") {
  const std::string head = "depth_mm,time_s,force_mN,sd_mN,provenance\n";
  CHECK(error_of(kPoints, head + "2,0,320,,table\n").empty());
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"2,0,x,,table\n", "c.csv:2: column 'force_mN': 'x' is not a finite number"},
      {"2,0,nan,,table\n", "c.csv:2: column 'force_mN': 'nan' is not a finite number"},
      {"-2,0,1,,table\n", "c.csv:2: column 'depth_mm': -2 is too small; expected at least 0"},
      {"2,-1,1,,table\n", "c.csv:2: column 'time_s': -1 is too small"},
      {"2,0,1,-1,table\n", "c.csv:2: column 'sd_mN': -1 is too small"},
      {"2,0,,,table\n", "c.csv:2: neither or both of a value and a band"},
      {",0,1,,table\n", "c.csv:2: no imposed indentation_depth"},
      {"2,0,1,,guess\n", "c.csv:2: column 'provenance': unknown provenance 'guess'"},
      {"2,0,1,table\n", "c.csv:2: 4 fields in this row; expected 5"},
  };
  for (const auto& [row, message] : cases) {
    INFO(row);
    CHECK_THAT(error_of(kPoints, head + row), Catch::StartsWith(message));
  }
  CHECK_THAT(error_of(kPoints, "depth_mm,time_s,force_mN,provenance\n2,0,1,table\n"),
             Catch::StartsWith("c.csv:1: no column 'sd_mN'"));
  CHECK_THAT(error_of(kPoints, "depth_mm,time_s,force_mN,sd_mN,force_N\n2,0,1,,1\n"),
             Catch::StartsWith("c.csv:1: column 'force_N' is not described"));
  CHECK_THAT(error_of(kPoints, "depth_mm,time_s,force_mN,sd_mN\n2,0,1,\n"),
             Catch::StartsWith("c.csv:1: no column 'provenance'"));
  CHECK_THAT(error_of(kRecording, "time_min,stretch,stress_kPa\n1,1,1\n1,1,1\n"),
             Catch::StartsWith("c.csv:3: column 'time_min': time 60 s does not follow 60 s"));
  CHECK_THAT(error_of(kRecording, "time_min,stretch,stress_kPa\n1,,1\n"),
             Catch::StartsWith("c.csv:2: column 'stretch': empty"));
}

TEST_CASE("each fault of a description is told with its key") {
  const auto with = [](const char* pointer, const Json& value) {
    Json json = parse_json(kPoints, "f");
    json[Json::json_pointer(pointer)] = value;
    return json.dump();
  };
  const auto fault = [](const std::string& json) {
    return error_of(json, "depth_mm,time_s,force_mN,sd_mN,provenance\n2,0,1,,table\n");
  };
  CHECK_THAT(fault(with("/kind", "curve")),
             Catch::StartsWith("c.json: key /kind: unknown curve 'curve'; expected one of "
                               "points, recording, spectrum, values"));
  CHECK_THAT(
      fault(with("/colums", 1)),
      Catch::StartsWith(
          "c.json: key /colums: unknown key (did you mean 'columns'?); expected one of id, title"));
  CHECK_THAT(
      fault(with("/columns/depth_mm/unti", "mm")),
      Catch::StartsWith(
          "c.json: key /columns/depth_mm/unti: unknown key (did you mean 'unit'?); expected one of "
          "quantity, unit"));
  CHECK_THAT(fault(with("/columns/depth_mm", Json::object())),
             Catch::StartsWith("c.json: key /columns/depth_mm/quantity: is missing; expected what "
                               "the column holds: one of time, indentation_depth"));
  CHECK_THAT(fault(with("/title", 7)),
             Catch::StartsWith(
                 "c.json: key /title: is of the wrong type: 7; expected a text that is not empty"));
  CHECK_THAT(fault(with("/columns/depth_mm/unit", "N")),
             Catch::StartsWith("c.json: key /columns/depth_mm: 'N' is a unit of force"));
  CHECK_THAT(fault(with("/columns/force_mN/unit", "N")),
             Catch::StartsWith("c.json: key /columns/force_mN: unit 'N' but the column is named"));
  CHECK_THAT(fault(with("/id", "d")),
             Catch::StartsWith("c.json: key /id: 'd' is not the file's name; expected 'c'"));
  CHECK_THAT(fault(with("/provenance", "table")), Catch::StartsWith("c.json: key /provenance"));
  CHECK_THAT(fault(with("/time_origin", "none")), Catch::StartsWith("c.csv: has times but"));
  CHECK_THAT(fault(with("/observable", "stress")),
             Catch::StartsWith("c.json: key /observable: 'stress' in a file of kind points"));
}

TEST_CASE("an unknown id names the known ones, and a CSV file alone asks for its description") {
  CHECK_THROWS_WITH(load_curve("evren"), Catch::Contains("evren_relaxation, evren_static"));
  const TempFolder folder;
  write_file(folder / "lonely.csv", "a,b\n1,2\n");
  CHECK_THROWS_WITH(load_curve(folder / "lonely.csv"),
                    Catch::EndsWith("has no description beside it; expected lonely.json (tpm data "
                                    "import writes one)"));
}

TEST_CASE("every shipped curve is sound and comes back from an HDF5 file as it was") {
  std::vector<Curve> curves;
  for (const CurveSummary& summary : list_curves()) curves.push_back(load_curve(summary.id));
  REQUIRE(curves.size() >= 5);
  Recording recording;
  recording.header.id = "zz_recording";
  recording.time_s = {0, 0.1};
  recording.drive = {0, 1e-3};
  recording.response = {0, 0.1 + 0.2};
  recording.response_sd = {0.01, 0.02};
  curves.emplace_back(recording);

  const TempFolder folder;
  pack_curves(folder / "all.h5", curves);
  const auto back = unpack_curves(folder / "all.h5");
  REQUIRE(back.size() == curves.size());
  for (std::size_t i = 0; i < curves.size(); ++i) {
    INFO(curve_header(curves[i]).id);
    CHECK(curve_header(back[i]).id == curve_header(curves[i]).id);
    CHECK(curve_header(back[i]).citation == curve_header(curves[i]).citation);
    CHECK(curve_header(back[i]).sha256 == curve_header(curves[i]).sha256);
    CHECK(curve_header(back[i]).probe.diameter_m == curve_header(curves[i]).probe.diameter_m);
    REQUIRE(back[i].index() == curves[i].index());
    REQUIRE(curve_size(back[i]) == curve_size(curves[i]));
  }
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const auto* was = std::get_if<PointSet>(&curves[i]);
    const auto* is = std::get_if<PointSet>(&back[i]);
    if (was == nullptr) continue;
    CHECK(is->observable == was->observable);
    CHECK(is->time_provenance == was->time_provenance);
    for (std::size_t k = 0; k < was->data.size(); ++k) {
      CHECK(is->data[k].depth_m == was->data[k].depth_m);
      CHECK(is->data[k].load_N == was->data[k].load_N);
      CHECK(is->data[k].value == was->data[k].value);
      CHECK(is->data[k].upper == was->data[k].upper);
      CHECK(is->data[k].provenance == was->data[k].provenance);
      CHECK(is->data[k].where == was->data[k].where);
    }
  }
  CHECK(std::get<Recording>(back.back()).response == recording.response);
  CHECK(std::get<Recording>(back.back()).force_sd_N() == recording.response_sd);
  const auto& amy = std::get<ValueSet>(back.front());
  CHECK(amy.at("contact_area").unit.symbol == "mm^2");
  CHECK(amy.at("contact_area").formula == load_values("amy_abstract").at("contact_area").formula);
}

TEST_CASE("packing the same curves twice gives the same bytes, and a failure leaves no file") {
  const TempFolder folder;
  const std::vector<Curve> curves = {load_curve("evren_static")};
  pack_curves(folder / "a.h5", curves);
  pack_curves(folder / "b.h5", curves);
  CHECK(read_file(folder / "a.h5") == read_file(folder / "b.h5"));
  CHECK_THROWS_AS(pack_curves(folder / "c.h5", {curves[0], curves[0]}), Error);
  {
    Hdf5Writer abandoned(folder / "d.h5");
    abandoned.numbers("/x", {1, 2});
  }
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    files += entry.is_regular_file() ? 1 : 0;
  }
  CHECK(files == 2);
}

TEST_CASE("packed curves are checked like files of text") {
  const TempFolder folder;
  const auto answer = [&](const Curve& curve) -> std::string {
    pack_curves(folder / "c.h5", {curve});
    try {
      (void)unpack_curves(folder / "c.h5");
    } catch (const Error& error) {
      return error.what();
    }
    return "taken";
  };
  Recording recording;
  recording.header.id = "r";
  recording.time_s = {0, 0.1, 0.2};
  recording.drive = {0, 1e-3, 2e-3};
  recording.response = {0, 0.1, 0.2};
  CHECK(answer(recording) == "taken");
  Recording wrong = recording;
  wrong.response[1] = std::nan("");
  CHECK_THAT(answer(wrong), Catch::Contains("/curves/r: force_N 1: not a number"));
  wrong = recording;
  wrong.time_s[2] = 0.1;
  CHECK_THAT(answer(wrong), Catch::Contains("time_s 2: time 0.1 s does not follow 0.1 s"));
  wrong = recording;
  wrong.response_sd = {0.1, -0.1, 0.1};
  CHECK_THAT(answer(wrong), Catch::Contains("force_sd_N 1: -0.1 is negative"));
  PointSet points = std::get<PointSet>(load_curve("evren_static"));
  CHECK(answer(points) == "taken");
  points.data[1].depth_m = -1e-3;
  CHECK_THAT(answer(points), Catch::Contains("indentation_depth 1: -0.001 is negative"));
  points.data[1].depth_m.reset();
  CHECK_THAT(answer(points), Catch::Contains("no imposed indentation_depth"));
  Spectrum spectrum;
  spectrum.header.id = "s";
  spectrum.frequency_Hz = {1, 1};
  spectrum.storage = spectrum.loss = {1, 1};
  CHECK_THAT(answer(spectrum), Catch::Contains("row 1: frequency 1 stands twice"));
  ValueSet values = load_values("amy_abstract");
  values.values[0].value = std::numeric_limits<double>::infinity();
  CHECK_THAT(answer(values), Catch::Contains("value 0: not a number"));
}

TEST_CASE("an HDF5 file cut at any place gives an error and never a crash") {
  const TempFolder folder;
  pack_curves(folder / "whole.h5", {load_curve("evren_static"), load_curve("amy_abstract")});
  const std::string whole = read_file(folder / "whole.h5");
  for (std::size_t part = 1; part < 16; ++part) {
    INFO(part);
    write_file(folder / "cut.h5", whole.substr(0, whole.size() * part / 16));
    CHECK_THROWS_AS(unpack_curves(folder / "cut.h5"), Error);
  }
  write_file(folder / "other.h5", "not HDF5 at all");
  CHECK_THROWS_WITH(unpack_curves(folder / "other.h5"), Catch::Contains("is not an HDF5 file"));
}
