#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/column_title.hpp"
#include "tpm/files/import/header_words.hpp"
#include "tpm/files/import/import.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/files/json.hpp"
#include "tpmkit/curve_file.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::files;
using Catch::Matchers::WithinRel;
using test::TempFolder;

namespace {

std::string fixture(const std::string& name) {
  return std::string(TPM_TEST_SOURCE_DIR) + "/tests/fixtures/" + name;
}

/// What the command does with an imported curve, then what a user does with the result.
Curve written_and_loaded(ImportedCurve curve) {
  const TempFolder folder;
  curve.description.header.id = "c";
  curve.description.header.title = "t";
  write_file(folder / "c.csv", curve.csv);
  write_file(folder / "c.json", to_text(description_json(curve.description)));
  return load_curve(folder / "c.csv");
}

Recording import_recording(const std::string& path, const ImportOptions& options = {}) {
  auto curves = import_curves(path, options);
  REQUIRE(curves.size() == 1);
  return std::get<Recording>(written_and_loaded(std::move(curves.front())));
}

std::string finding(const ImportedCurve& curve, const std::string& what) {
  for (const ImportFinding& found : curve.findings) {
    if (found.what == what) return found.value;
  }
  return "(none)";
}

void check_values(const std::vector<double>& found, const std::vector<double>& expected) {
  REQUIRE(found.size() == expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    INFO(i);
    CHECK(std::abs(found[i] - expected[i]) <= 1e-12 * (1.0 + std::abs(expected[i])));
  }
}

ImportOptions figure(const char* x, const char* y) {
  ImportOptions options;
  options.x = parse_axis(x, "--x-quantity");
  options.y = parse_axis(y, "--y-quantity");
  return options;
}

}  // namespace

TEST_CASE("column titles in five languages, with units in any bracket") {
  CHECK(split_title("Force [N]").unit == "N");
  CHECK(split_title("Kraft in mN").name == "Kraft");
  CHECK(split_title("depth_mm").name == "depth");
  CHECK(split_title("Time / s").unit == "s");
  CHECK(split_title("Force (corrected)").name == "Force (corrected)");
  CHECK(split_title("Force (corrected)").unit.empty());
  CHECK(recognize_title("Temps d'essai")->role == ColumnRole::time);
  CHECK(recognize_title("Pr\xC3\xBC"
                        "fzeit")
            ->role == ColumnRole::time);
  CHECK(recognize_title("D\xC3\x89PLACEMENT")->role == ColumnRole::drive);
  CHECK(recognize_title("Forza")->quantity == Quantity::contact_force);
  CHECK(recognize_title("Spannung")->quantity == Quantity::stress);
  CHECK(recognize_title("Course traverse absolue")->rank >
        recognize_title("Course standard")->rank);
  CHECK_FALSE(recognize_title("Ecartement entre outils").has_value());
}

TEST_CASE("three header rows with French titles are understood without options") {
  const auto curves = import_curves(fixture("machine_french.csv"), {});
  REQUIRE(curves.size() == 1);
  CHECK(finding(curves[0], "header rows") == "3, sheet SYN-01");
  CHECK(finding(curves[0], "time") == "column 1 'Temps d'essai', s");
  CHECK(finding(curves[0], "indentation_depth") == "column 4 'Allongement', mm");
  CHECK(finding(curves[0], "not used") == "column 3 'Course traverse absolue'");
  CHECK(finding(curves[0], "sampling") == "every 0.1 s");
  CHECK(finding(curves[0], "peak") == "0.2 N at 0.5 s");
  const Recording recording = import_recording(fixture("machine_french.csv"));
  CHECK(recording.provenance == Provenance::measured);
  check_values(recording.time_s, {0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6});
  check_values(recording.depth_m(), {0, 1e-4, 2e-4, 3e-4, 4e-4, 5e-4, 5e-4});
  check_values(recording.force_N(), {0.001, 0.06, 0.01, 0.05, 0.08, 0.2, 0.15});
}

TEST_CASE("contact is the first sample from which the force stays up") {
  ImportOptions options;
  options.contact_force_N = 0.05;
  const Recording recording = import_recording(fixture("machine_french.csv"), options);
  // The single sample of 0.06 N at 0.1 s does not count.
  check_values(recording.time_s, {0, 0.1, 0.2, 0.3});
  check_values(recording.depth_m(), {0, 1e-4, 2e-4, 2e-4});
  CHECK(recording.force_N().front() == 0.05);
  options.contact_samples = 1;
  CHECK(import_recording(fixture("machine_french.csv"), options).force_N().front() == 0.06);
  options.contact_force_N = 5.0;
  CHECK_THROWS_WITH(import_curves(fixture("machine_french.csv"), options),
                    Catch::Contains("the force never stays at 5 N"));
}

TEST_CASE("semicolons, decimal commas, specimen data and tension-positive signs") {
  ImportOptions options;
  options.negate_drive = true;
  options.negate_response = true;
  const auto curves = import_curves(fixture("machine_german.txt"), options);
  CHECK(finding(curves.at(0), "separator") == "semicolon");
  CHECK(finding(curves.at(0), "decimal sign") == "comma");
  CHECK(finding(curves.at(0), "header rows") == "3");
  CHECK(finding(curves.at(0), "contact_force") == "column 2 'Standardkraft', mN, negated");
  const Recording recording = import_recording(fixture("machine_german.txt"), options);
  check_values(recording.force_N(), {0.01, 0.2505, 0.5});
  check_values(recording.depth_m(), {0, 1.25e-3, 2.5e-3});
}

TEST_CASE("UTF-16 exports and units in the names") {
  const std::string text = read_file(fixture("machine_units_in_names.tsv"));
  std::string utf16 = "\xFF\xFE";
  for (const char c : text) (utf16 += c) += '\0';
  const TempFolder folder;
  write_file(folder / "utf16.txt", utf16);
  const Recording plain = import_recording(fixture("machine_units_in_names.tsv"));
  const Recording wide = import_recording(folder / "utf16.txt");
  check_values(plain.depth_m(), {0, 1.5e-3, 1.5e-3});
  CHECK(wide.force_N() == plain.force_N());
  CHECK(wide.time_s == plain.time_s);
}

TEST_CASE("a relative length that counts the other way is turned about 1") {
  const TempFolder folder;
  const std::string path = folder / "compressed.csv";
  write_file(path, "Time [s],L [-],Stress [kPa]\n0,1,0\n1,0.9,-1\n2,0.8,-2\n3,0.8,-1.5\n");
  ImportOptions options;
  options.drive_quantity = Quantity::relative_length;
  options.drive_column = "L";
  options.negate_drive = true;
  options.negate_response = true;
  const Recording recording = import_recording(path, options);
  check_values(recording.drive, {1.0, 1.1, 1.2, 1.2});
  check_values(recording.response, {0.0, 1e3, 2e3, 1.5e3});
}

TEST_CASE("stress over relative length: what the file does not say has to be said") {
  ImportOptions options;
  CHECK_THROWS_WITH(
      import_curves(fixture("strip_no_units.csv"), options),
      Catch::Contains(
          "column 1 'Time', column 3 'F', column 4 'SD': have no unit; expected "
          "--unit \"Time=UNIT\" with a unit of time: s, ms, us, min, h; --unit \"F=UNIT\" "
          "with a unit of force: N, mN"));
  options.units = {{"Time", "s"}, {"3", "kPa"}, {"SD", "kPa"}};
  options.drive_column = "L";
  options.drive_quantity = Quantity::relative_length;
  const Recording recording = import_recording(fixture("strip_no_units.csv"), options);
  CHECK(recording.response_quantity == Quantity::stress);
  check_values(recording.drive, {0.95, 1.05, 1.05});
  check_values(recording.response, {-200, 1500, 1250});
  check_values(recording.response_sd, {100, 200, 300});
  options.units["Time"] = "mm";
  CHECK_THROWS_WITH(import_curves(fixture("strip_no_units.csv"), options),
                    Catch::Contains("'mm' is a unit of length; expected --unit \"Time=UNIT\""));
  options.drive_column = "M";
  CHECK_THROWS_WITH(import_curves(fixture("strip_no_units.csv"), options),
                    Catch::Contains("no column 'M'; expected column 1 'Time'"));
}

TEST_CASE("a column without a title is chosen by the name that messages give it") {
  const TempFolder folder;
  write_file(folder / "f.csv", "0,0,0\n1,1,10\n2,2,20\n3,2,15\n");
  ImportOptions options;
  options.time_column = "column 1";
  options.drive_column = "column 2";
  options.response_column = "column 3";
  options.units = {{"column 1", "s"}, {"2", "mm"}, {"column 3", "mN"}};
  const Recording recording = import_recording(folder / "f.csv", options);
  check_values(recording.drive, {0, 1e-3, 2e-3, 2e-3});
  check_values(recording.response, {0, 10e-3, 20e-3, 15e-3});
  options.response_column = "column 4";
  CHECK_THROWS_WITH(import_curves(folder / "f.csv", options),
                    Catch::Contains("no column 'column 4'; expected column 1, column 2, column 3"));
}

TEST_CASE("plain x and y are a recording without time") {
  const Recording recording = import_recording(fixture("plain_xy.csv"));
  CHECK(recording.time_s.empty());
  CHECK(recording.drive_quantity == Quantity::abscissa);
  CHECK(recording.response == std::vector<double>{2, 4, 6});
}

TEST_CASE("titles, units and blank rows stand in any order above the samples") {
  const std::string title = "Tensile test 7\n";
  const std::string blank = ",,\n";
  const std::string names = "Time,Stretch,Stress\n";
  const std::string units = "s,%,kPa\n";
  const std::string samples = "0,100,0\n1,105,2\n2,110,4\n";
  const TempFolder folder;
  std::vector<std::string> rows{title, blank, names, units};
  std::sort(rows.begin(), rows.end());
  int orders = 0;
  do {
    ++orders;
    write_file(folder / "f.csv", rows[0] + rows[1] + rows[2] + rows[3] + samples);
    INFO(rows[0] + rows[1] + rows[2] + rows[3]);
    const auto series = import_series(folder / "f.csv", {}).series;
    REQUIRE(series.at(0).columns.size() == 3);
    const ImportedColumn& stretch = series[0].columns[1];
    CHECK(stretch.unit.symbol == "%");
    CHECK(stretch.unit.to_si == 0.01);
    CHECK(series[0].columns[2].unit.to_si == 1e3);
  } while (std::next_permutation(rows.begin(), rows.end()));
  CHECK(orders == 24);
}

TEST_CASE("a unit that is not known stops the import, and none is suggested") {
  const TempFolder folder;
  const auto fault = [&folder](const std::string& text) -> std::string {
    write_file(folder / "f.csv", text + "0,0,0\n1,1,1\n");
    try {
      static_cast<void>(import_curves(folder / "f.csv", {}));
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  CHECK_THAT(
      fault("time [s],force [blob],depth [mm]\n"),
      Catch::Contains("column 2 'force': unknown unit 'blob'; expected --unit \"force=UNIT\" "
                      "with a unit of force"));
  CHECK_THAT(fault("time [s],force [mV],depth [mm]\n"),
             Catch::Contains("'mV' is a voltage, and the file has no calibration that makes it a "
                             "force; expected a calibrated column") &&
                 Catch::Contains("--unit \"force=N\""));
  CHECK_THAT(fault("time [s],force [N],depth [V]\n"),
             Catch::Contains("no calibration that makes it a length"));
  CHECK_THAT(fault("time,force,depth\ns,lbs,mm\n"), Catch::Contains("unknown unit 'lbs'"));
  CHECK_THAT(fault("time,force,stretch\n[s],[N],[pc]\n"), Catch::Contains("unknown unit 'pc'"));
  CHECK_THAT(fault("time [s],force (blob),depth [mm]\n"),
             Catch::Contains("column 2 'force (blob)': has no unit"));
  write_file(folder / "g.csv", "time [s],force [nN],depth [um]\n0,0,0\n1,2,3\n");
  const auto nano = import_series(folder / "g.csv", {}).series;
  CHECK(nano.at(0).columns.at(2).unit.to_si == 1e-9);
  CHECK(nano.at(0).columns.at(1).unit.to_si == 1e-6);
}

TEST_CASE("a spectrum may come as magnitude and phase, and over an angular frequency") {
  constexpr double kPi = 3.14159265358979323846;
  const TempFolder folder;
  // |G*| = 2 kPa at 30 degrees; 1/s of omega is rad/s.
  write_file(folder / "polar.csv",
             "omega [1/s],|G*| [kPa],delta [deg]\n1,2,30\n6.283185307179586,4,60\n");
  const auto polar = import_curves(folder / "polar.csv", {});
  CHECK(finding(polar.at(0), "converted") == "magnitude and phase to storage and loss");
  const auto spectrum = std::get<Spectrum>(written_and_loaded(polar.at(0)));
  check_values(spectrum.frequency_Hz, {0.5 / kPi, 1.0});
  check_values(spectrum.storage, {2e3 * std::sqrt(0.75), 2e3});
  check_values(spectrum.loss, {1e3, 4e3 * std::sqrt(0.75)});

  write_file(folder / "tangent.csv", "freq [Hz],G' [Pa],tan(\xCE\xB4)\n1,200,0.5\n2,300,0.1\n");
  const auto tangent =
      std::get<Spectrum>(written_and_loaded(import_curves(folder / "tangent.csv", {}).at(0)));
  check_values(tangent.storage, {200, 300});
  check_values(tangent.loss, {100, 30});
}

TEST_CASE("machine files that do not hold a recording are refused") {
  const TempFolder folder;
  const auto fault = [&folder](const std::string& text) -> std::string {
    write_file(folder / "f.csv", text);
    try {
      static_cast<void>(import_curves(folder / "f.csv", {}));
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const std::string head = "Time (s),Force (N),Depth (mm)\n";
  CHECK_THAT(fault(head), Catch::Contains("no row with two or more numbers"));
  CHECK_THAT(fault(head + "0,0,0\n0,1,1\n"), Catch::Contains("f.csv:3: time 0 s does not follow"));
  CHECK_THAT(fault(head + "0,0,0\n1,x,1\n"), Catch::Contains("f.csv:3: column 2 'Force': 'x'"));
  CHECK_THAT(fault(head + "0,0,0\n1,1,1\n2,2\n"), Catch::Contains("f.csv:4: 2 fields"));
  CHECK_THAT(fault("a (s),b (N),c\n0,0,0\n"), Catch::Contains("no column is recognised"));
}

TEST_CASE("a time stamp with its date is a time") {
  const TempFolder folder;
  write_file(folder / "f.csv",
             "Timestamp,Position (mm),Load (N)\n2026-03-04 23:59:59.500,0,0\n"
             "2026-03-05 00:00:00.500,1,2\n2026-03-05 00:00:01.500,2,3\n");
  const Recording r = read_recording_file(folder / "f.csv", {}).recording;
  REQUIRE(r.time_s.size() == 3);
  CHECK_THAT(r.time_s[1] - r.time_s[0], WithinRel(1.0, 1e-9));
  CHECK_THAT(r.time_s[2] - r.time_s[1], WithinRel(1.0, 1e-9));
}

TEST_CASE("a compliance beside the stress that was held is the response") {
  const TempFolder folder;
  write_file(folder / "f.csv",
             "Time [s],Shear stress [Pa],Compliance [1/Pa]\n0.1,100,2e-4\n0.2,100,3e-4\n");
  const Recording r = read_recording_file(folder / "f.csv", {}).recording;
  CHECK(r.response_quantity == Quantity::creep_compliance);
  CHECK(r.response == std::vector<double>{2e-4, 3e-4});
}

TEST_CASE("rows of a sample that was lost are left out, and it is said") {
  const TempFolder folder;
  write_file(folder / "f.csv",
             "Time (s),Force (N),Depth (mm)\n0,0,0\n1,NaN,1\n2,3,2\n3,,3\n4,5,4\n5,6,5\n");
  const RecordingFile file = read_recording_file(folder / "f.csv", {});
  CHECK(file.recording.time_s == std::vector{0.0, 2.0, 4.0, 5.0});
  CHECK(file.recording.response == std::vector{0.0, 3.0, 5.0, 6.0});
  CHECK_THAT(columns_words(file.findings),
             Catch::Contains("missing: 2 of 6 rows have an empty cell or NaN, from line 3 on"));
  write_file(folder / "d.csv",
             "Time (s),Force (N),Depth (mm)\n0,0,0\n1,---,1\n2,3,2\n3,null,3\n4,-5,4\n5,6,5\n");
  CHECK(read_recording_file(folder / "d.csv", {}).recording.response ==
        std::vector{0.0, 3.0, -5.0, 6.0});
  // A column that is mostly empty is none.
  write_file(folder / "g.csv", "Time (s),Force (N),Depth (mm)\n0,0,0\n1,nan,1\n2,nan,2\n");
  CHECK_THROWS_WITH(read_recording_file(folder / "g.csv", {}),
                    Catch::Contains("g.csv:3: column 2 'Force': 'nan'"));
}

TEST_CASE("where a lost sample leaves too few, file, row and column are named") {
  const TempFolder folder;
  const auto refusal = [&](const std::string& cell) {
    write_file(folder / "n.csv", "Time (s),Force (N),Depth (mm)\n0,0,0\n1,1,1\n2,2," + cell + "\n");
    return test::refusal_of([&] { (void)read_recording_file(folder / "n.csv", {}); });
  };
  for (const char* const none : {"nan", "NaN", "n/a", ""}) {
    CAPTURE(none);
    CHECK_THAT(
        refusal(none),
        Catch::Contains("n.csv: 2 samples (1 of 3 rows have an empty cell or NaN, from line 4 "
                        "on (column 3 'Depth'): left out); expected at least 3 rows"));
  }
  for (const char* const word : {"inf", "-inf", "hello", "1e999", "1,2"}) {
    CAPTURE(word);
    CHECK_THAT(refusal(word), Catch::Contains("n.csv:4: "));
  }
}

TEST_CASE("rows of one time stamp become their mean, and it is said") {
  const TempFolder folder;
  write_file(folder / "f.csv",
             "Time (s),Force (N),Depth (mm)\n0,0,0\n0,2,1\n1,3,2\n2,4,3\n2,5,4\n2,6,5\n");
  const RecordingFile file = read_recording_file(folder / "f.csv", {});
  CHECK(file.recording.time_s == std::vector{0.0, 1.0, 2.0});
  CHECK(file.recording.response == std::vector{1.0, 3.0, 5.0});
  CHECK_THAT(file.recording.drive[2], WithinRel(4e-3, 1e-14));
  CHECK_THAT(columns_words(file.findings),
             Catch::Contains("repeated times: 3 of 6 rows have the time of the row before"));
  // A clock that goes back stamps no rows alike: it is refused, with what to do.
  write_file(folder / "g.csv", "Time (s),Force (N),Depth (mm)\n0,0,0\n1,1,1\n0,2,2\n0,3,3\n");
  CHECK_THROWS_WITH(read_recording_file(folder / "g.csv", {}),
                    Catch::Contains("g.csv:4: time 0 s does not follow 1 s") &&
                        Catch::Contains("a file for each part before and after this line"));
}

TEST_CASE("rows that are not in the order of time are told from a clock that restarts") {
  const TempFolder folder;
  const std::string head = "Time (s),Force (N),Depth (mm)\n";
  write_file(folder / "f.csv", head + "5,5,5\n4,4,4\n3,3,3\n2,2,2\n1,1,1\n0,0,0\n");
  CHECK_THROWS_WITH(read_recording_file(folder / "f.csv", {}),
                    Catch::Contains("f.csv:3: time 4 s does not follow 5 s: the newest row comes "
                                    "first, from 5 s down to 0 s") &&
                        Catch::Contains("the rows sorted by their time"));
  write_file(folder / "g.csv",
             head + "0,0,0\n5,1,1\n1,2,2\n6,3,3\n2,4,4\n7,5,5\n3,6,6\n8,7,7\n4,8,8\n");
  CHECK_THROWS_WITH(read_recording_file(folder / "g.csv", {}),
                    Catch::Contains("the rows are not in the order of time, which goes back 4"));
}

TEST_CASE("WebPlotDigitizer CSV: one dataset, and several") {
  CHECK_THROWS_WITH(
      import_curves(fixture("wpd_single.csv"), {}),
      Catch::Contains("expected --x-quantity QUANTITY:UNIT, such as --x-quantity time:s"));
  ImportOptions options = figure("time:s", "contact_force:N");
  const Recording recording = import_recording(fixture("wpd_single.csv"), options);
  CHECK(recording.provenance == Provenance::digitized);
  CHECK(recording.drive.empty());
  check_values(recording.time_s, {0.5, 10.25, 30});

  options.depth_m = 4e-3;
  CHECK_THROWS_WITH(import_curves(fixture("wpd_single.csv"), options),
                    Catch::Contains("what the times count from is not known"));
  options.time_origin = TimeOrigin::end_of_ramp;
  const auto points = std::get<PointSet>(
      written_and_loaded(import_curves(fixture("wpd_single.csv"), options).at(0)));
  REQUIRE(points.data.size() == 3);
  CHECK(points.data[1].provenance == Provenance::digitized);
  CHECK_THAT(points.data[1].depth_m.value(), WithinRel(4e-3, 1e-12));
  CHECK_THAT(points.data[1].value.value(), WithinRel(0.25, 1e-12));

  const auto both =
      import_curves(fixture("wpd_datasets.csv"), figure("indentation_depth:mm", "contact_force:N"));
  REQUIRE(both.size() == 2);
  CHECK(both[0].name == "pig #1");
  const auto pig1 = std::get<PointSet>(written_and_loaded(both[0]));
  const auto pig2 = std::get<PointSet>(written_and_loaded(both[1]));
  CHECK(pig1.data.size() == 3);
  CHECK(pig2.data.size() == 2);
  CHECK_THAT(pig2.data[1].depth_m.value(), WithinRel(4e-3, 1e-12));
}

TEST_CASE("WebPlotDigitizer projects: values, pixels on a logarithmic axis, and the old layout") {
  ImportOptions options = figure("time:s", "stress:kPa");
  const auto curves = import_curves(fixture("wpd_project_v4.json"), options);
  REQUIRE(curves.size() == 2);  // the empty dataset is left out
  CHECK(finding(curves[0], "order") == "points were put in order of x");
  const auto values = std::get<Recording>(written_and_loaded(curves[0]));
  check_values(values.time_s, {0, 30});
  check_values(values.response, {320, 210});
  // Half-way along both axes: x = 20, y = sqrt(1 * 100).
  const auto pixels = std::get<Recording>(written_and_loaded(curves[1]));
  check_values(pixels.time_s, {0, 20});
  check_values(pixels.response, {1e3, 10e3});

  options.dataset = "pixels only";
  CHECK(import_curves(fixture("wpd_project_v4.json"), options).size() == 1);
  options.dataset = "nothing";
  CHECK_THROWS_WITH(import_curves(fixture("wpd_project_v4.json"), options),
                    Catch::Contains("no dataset 'nothing'; expected 'with values'"));
  options.dataset.clear();
  const Recording old = import_recording(fixture("wpd_project_v3.json"), options);
  check_values(old.response, {320, 210});
}

TEST_CASE("a rotated and skewed figure is calibrated exactly") {
  // x = 2 + 3 a and y = 5 + 7 b at the pixel (10, 20) + a (30, 4) + b (-6, 50).
  Json axes{{"name", "A"}, {"type", "XYAxes"}};
  const auto point = [](double a, double b, const char* dx, const char* dy) {
    return Json{{"px", 10 + 30 * a - 6 * b}, {"py", 20 + 4 * a + 50 * b}, {"dx", dx}, {"dy", dy}};
  };
  axes["calibrationPoints"] = {point(0, 0, "2", "0"), point(1, 0, "5", "0"),
                               point(0.5, 0, "0", "5"), point(0.5, 1, "0", "12")};
  const Json pixel = point(0.25, 0.75, "", "");
  const Json dataset{
      {"name", "d"}, {"axesName", "A"}, {"data", {Json{{"x", pixel["px"]}, {"y", pixel["py"]}}}}};
  const Json project{{"version", {4, 2}}, {"axesColl", {axes}}, {"datasetColl", {dataset}}};
  const TempFolder folder;
  write_file(folder / "p.json", project.dump());
  const Recording recording =
      import_recording(folder / "p.json", figure("time:s", "contact_force:N"));
  check_values(recording.time_s, {2 + 3 * 0.25});
  check_values(recording.response, {5 + 7 * 0.75});
}

TEST_CASE("Engauge: all curves on each line, and one block for each curve, are the same curves") {
  const ImportOptions options = figure("time:s", "contact_force:N");
  for (const char* name : {"engauge_wide.csv", "engauge_blocks.csv"}) {
    INFO(name);
    const auto curves = import_curves(fixture(name), options);
    REQUIRE(curves.size() == 2);
    CHECK(curves[0].name == "Curve1");
    const auto first = std::get<Recording>(written_and_loaded(curves[0]));
    const auto second = std::get<Recording>(written_and_loaded(curves[1]));
    check_values(first.time_s, {0, 2});
    check_values(first.response, {0.1, 0.3});
    check_values(second.time_s, {1, 2});
    check_values(second.response, {0.4, 0.5});
  }
}

TEST_CASE("imported numbers keep every digit of the file") {
  const TempFolder folder;
  write_file(folder / "f.csv",
             "Time (s),Force (N),Depth (mm)\n0.1,0.30000000000000004,1e-9\n"
             "0.2,0.1234567890123456,2\n");
  const auto curves = import_curves(folder / "f.csv", {});
  CHECK(curves.at(0).csv ==
        "time_s,depth_mm,force_N\n0.1,1e-09,0.30000000000000004\n0.2,2,0.1234567890123456\n");
}
