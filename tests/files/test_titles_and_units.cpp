// Titles and units as people and testing machines write them: read where the meaning is beyond
// doubt, refused with the option to type where they may be two things.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <string>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/column_title.hpp"
#include "tpm/files/import/header_words.hpp"
#include "tpm/files/import/reading_options.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/files/unit_words.hpp"

using namespace tpm;
using namespace tpm::files;
using Catch::Contains;
using Catch::Matchers::WithinRel;

namespace {

/// A table with these titles, and rows of 0 to 20 in each of its three columns: i, 2 i, 3 i.
std::string counted_table(const std::string& titles) {
  std::string text = titles + "\n";
  for (int i = 0; i <= 20; ++i) text += fmt::format("{},{},{}\n", i, 2 * i, 3 * i);
  return text;
}

RecordingFile read_titled(const std::string& titles, const ImportOptions& options = {}) {
  const test::TempFolder folder;
  write_file(folder / "t.csv", counted_table(titles));
  return read_recording_file(folder / "t.csv", options);
}

std::string refusal_of_titles(const std::string& titles) {
  return test::refusal_of([&] { require_time_and_drive(read_titled(titles), "t.csv"); });
}

struct TitledTable {
  const char* titles;
  double time_s, depth_m, force_N;  ///< units of the columns in SI
};

}  // namespace

TEST_CASE("titles of machines are read where their meaning is beyond doubt") {
  constexpr double kInch = 0.0254, kPoundForce = 4.4482216152605, kKilogramForce = 9.80665;
  for (const auto& [titles, time_s, depth_m, force_N] : {
           // The title tells the dimension, so the capitals of the unit do not matter.
           TitledTable{"Time (S),Depth (MM),F(N)", 1.0, 1e-3, 1.0},
           TitledTable{"Time [S],Depth [In],Force [LBF]", 1.0, kInch, kPoundForce},
           TitledTable{"Time [Min],Extension (IN),Load (Lbf)", 60.0, kInch, kPoundForce},
           TitledTable{"Time [MIN],Depth [Mm],Force [KN]", 60.0, 1e-3, 1e3},
           TitledTable{"Time [Ms],Depth [UM],Force [UN]", 1e-3, 1e-6, 1e-6},
           TitledTable{"Time_S,Tip Displacement_um,Force_uN", 1.0, 1e-6, 1e-6},
           TitledTable{"Time_S,BaseDisp_um,Force_mN", 1.0, 1e-6, 1e-3},
           TitledTable{"timeS,depthMm,forceN", 1.0, 1e-3, 1.0},
           TitledTable{"Time (Sec),Displacement (Inches),Load (Pounds-force)", 1.0, kInch,
                       kPoundForce},
           // Units that few machines write.
           TitledTable{"Time (s),Depth (mil),Load (lbf)", 1.0, 1e-3 * kInch, kPoundForce},
           TitledTable{"Time (s),Depth (thou),Load (ozf)", 1.0, 1e-3 * kInch, kPoundForce / 16.0},
           TitledTable{"Temps (min),D\xC3\xA9placement (mm),Charge (daN)", 60.0, 1e-3, 10.0},
           TitledTable{"Time (s),Depth (mm),Force (dyne)", 1.0, 1e-3, 1e-5},
           TitledTable{"Time (s),Depth (mm),Load (KGF)", 1.0, 1e-3, kKilogramForce},
           TitledTable{"Time (s),Depth (mm),Load (gram-force)", 1.0, 1e-3, 1e-3 * kKilogramForce},
           // One column only has a unit of what is missing.
           TitledTable{"t [s],delta [mm],F [N]", 1.0, 1e-3, 1.0},
           TitledTable{"t [s],delta (mm),P (mN)", 1.0, 1e-3, 1e-3},
           TitledTable{"t (s),h (nm),P (uN)", 1.0, 1e-9, 1e-6},
           TitledTable{"t/s,d/mm,F/N", 1.0, 1e-3, 1.0},
           TitledTable{"t_s,x_mm,F_N", 1.0, 1e-3, 1.0},
           TitledTable{"Time [s],Pd [nm],Fn [mN]", 1.0, 1e-9, 1e-3},
           TitledTable{"Tid (s),L\xC3\xA4ge (mm),Kraft (N)", 1.0, 1e-3, 1.0},
           TitledTable{"Tijd (s),Verplaatsing (mm),Kracht (N)", 1.0, 1e-3, 1.0},
           TitledTable{"sec,mm,N", 1.0, 1e-3, 1.0},
           TitledTable{"[s],[mm],[N]", 1.0, 1e-3, 1.0},
       }) {
    INFO(titles);
    REQUIRE(refusal_of_titles(titles).empty());
    const RecordingFile file = read_titled(titles);
    CHECK_THAT(file.recording.time_s.back(), WithinRel(20.0 * time_s, 1e-12));
    REQUIRE_FALSE(file.recording.drive.empty());
    CHECK_THAT(file.recording.drive.back(), WithinRel(40.0 * depth_m, 1e-12));
    CHECK_THAT(file.recording.response.back(), WithinRel(60.0 * force_N, 1e-12));
    CHECK(file.recording.response_quantity == Quantity::contact_force);
  }
  // The unit that was understood is said.
  CHECK_THAT(columns_words(read_titled("Time [S],Depth [IN],Force [N]").findings),
             Contains("column 1 'Time', s") && Contains("column 2 'Depth', in"));
}

TEST_CASE("a title and a row of units that disagree are refused with what to type") {
  CHECK_THAT(refusal_of_titles("Time [s],Depth [mm],Force [N]\ns,mm,mN"),
             Contains("unit N in its title, and mN in the row of units") &&
                 Contains("--unit \"Force=N\" or --unit \"Force=mN\""));
  CHECK(refusal_of_titles("Time [s],Depth [mm],Force [mN]\ns,mm,mN").empty());
  CHECK(refusal_of_titles("Time,Depth,Force\ns,mm,mN").empty());
  ImportOptions options;
  set_reading_unit(options, "Force", "mN", "test");
  const auto read = read_titled("Time [s],Depth [mm],Force [N]\ns,mm,mN", options);
  CHECK(read.recording.response.back() == 60e-3);
}

TEST_CASE("a unit that may be two is refused with what to type") {
  for (const char* unit : {"MN", "Mn", "mn"}) {
    INFO(unit);
    CHECK_THAT(
        refusal_of_titles(fmt::format("Time [s],Depth [mm],Force [{}]", unit)),
        Contains("may be mN or MN") && Contains("--unit \"Force=mN\" or --unit \"Force=MN\""));
  }
  CHECK_THAT(refusal_of_titles("Time [s],Strain [%],Stress [Mpa]"),
             Contains("'Mpa' may be mPa or MPa"));
  CHECK(refusal_of_titles("Time [s],Strain [%],Stress [MPa]").empty());
  // What the user says counts.
  ImportOptions options;
  set_reading_unit(options, "Force", "MN", "test");
  CHECK(read_titled("Time [s],Depth [mm],Force [MN]", options).recording.response.back() == 60e6);
  // Metres or minutes, a minimum or minutes, siemens of something else: not guessed.
  CHECK_THAT(refusal_of_titles("Time [m],Depth [mm],Force [N]"),
             Contains("'m' is a unit of length; expected --unit \"Time=UNIT\""));
  CHECK_THAT(refusal_of_titles("Time MIN,Depth [mm],Force [N]"),
             Contains("--time with one of column 1 'Time MIN'"));
  CHECK_THAT(refusal_of_titles("T [S],Depth [mm],Force [N]"),
             Contains("--time with one of column 1 'T'"));
  CHECK_THAT(refusal_of_titles("Time [s],Position_M,Force [N]"), Contains("--unit \"Position_M"));
}

TEST_CASE("a column is not taken by its unit where two may be meant") {
  // Two axes of a biaxial machine.
  CHECK_THAT(refusal_of_titles("Time_S,XDisplacement_um,YDisplacement_um"),
             Contains("--drive 2 or --drive 3"));
  CHECK(recognize_title("XDisplacement")->role == ColumnRole::drive);
  CHECK(recognize_title("YForce")->role == ColumnRole::response);
  CHECK_FALSE(recognize_title("ForceMax"));  // a summary, whatever its capitals
  CHECK(refused_title("ForceMax"));
  // Names that are known as they stand are not cut.
  CHECK(recognize_title("zSensor")->role == ColumnRole::height);
  CHECK(recognize_title("vDeflection")->role == ColumnRole::deflection);
  // Titles and units that contradict each other are not exchanged.
  CHECK_FALSE(refusal_of_titles("Time [s],Force [mm],Depth [N]").empty());
  CHECK(split_title("N/m").unit.empty());
  CHECK(split_title("d/mm").name == "d");
}

TEST_CASE("units are compared without their capitals only within fitting dimensions") {
  const auto lengths = [](Dimension d) { return d == Dimension::length; };
  const auto times = [](Dimension d) { return d == Dimension::time; };
  const auto forces = [](Dimension d) { return d == Dimension::force; };
  CHECK(units_in_any_case("IN", lengths) == std::vector<std::string>{"in"});
  CHECK(units_in_any_case("M", lengths) == std::vector<std::string>{"m"});
  CHECK(units_in_any_case("M", times).empty());
  CHECK(units_in_any_case("S", times) == std::vector<std::string>{"s"});
  CHECK(units_in_any_case("mn", forces) == std::vector<std::string>{"mN", "MN"});
  CHECK(units_in_any_case("volt", forces).empty());
}

TEST_CASE("titles and units are read in comments, which name no columns otherwise") {
  const auto read = [](const std::string& comments, const std::string& separator) {
    const test::TempFolder folder;
    std::string text = comments;
    for (int i = 0; i <= 20; ++i) {
      text += fmt::format("{1}{0}{2}{0}{3}\n", separator, i, 2 * i, 3 * i);
    }
    write_file(folder / "t.dat", text);
    return read_recording_file(folder / "t.dat", {});
  };
  for (const auto& [comments, separator] : {
           std::pair{"% exported 2023-05-11\n% operator AB\n%\n% columns: time, depth, force\n"
                     "% units: s, mm, N\n",
                     "  "},
           std::pair{"# Columns: Time (s), Depth (mm), Force (N)\n# operator AB\n", "  "},
           std::pair{"# operator AB\n# 1: time [s]\n# 2: depth [mm]\n# 3: force [N]\n", "\t"},
           std::pair{"% column 1 = time (s)\n% column 2 = depth (mm)\n% column 3 = force (N)\n",
                     ","},
           std::pair{"; time depth force\n; s mm N\n;---\n", " "},
           std::pair{"// operator AB\n// Time (s); Depth (mm); Force (N)\n", "\t"},
       }) {
    CAPTURE(comments);
    const Recording r = read(comments, separator).recording;
    CHECK(r.time_s.back() == 20.0);
    CHECK_THAT(r.drive.back(), WithinRel(40e-3, 1e-12));
    CHECK(r.response.back() == 60.0);
  }
  // Comments that say nothing are no titles.
  const std::string refusal =
      test::refusal_of([&] { static_cast<void>(read("% exported\n% operator AB\n", "  ")); });
  CHECK_THAT(refusal, !Contains("AB") && Contains("no titles above its 3 columns") &&
                          Contains("--time 1 --drive 2 --response 3 --unit 1=s"));
}

TEST_CASE("comments between the samples of a machine's table do not part them") {
  const test::TempFolder folder;
  std::string text = "// exported\nTime (s),Depth (mm),Force (N)\n";
  for (int i = 0; i <= 20; ++i) {
    text += fmt::format("{},{},{}\n", i, 2 * i, 3 * i);
    if (i == 9) text += "// hold begins\n\n# filter off\n";
  }
  write_file(folder / "t.csv", text);
  const Recording r = read_recording_file(folder / "t.csv", {}).recording;
  CHECK(r.time_s.size() == 21);
  CHECK(r.response.back() == 60.0);
}

TEST_CASE("a column of times of day is the time, whatever its title") {
  for (const char* title : {"Zeitstempel", "Horodatage", "Date/Heure", "when"}) {
    CAPTURE(title);
    const test::TempFolder folder;
    std::string text = fmt::format("{};Kraft [N];Weg [mm]\n", title);
    for (int i = 0; i <= 20; ++i) text += fmt::format("05.03.2024 10:12:{:02},5;{};{}\n", i, i, i);
    write_file(folder / "t.csv", text);
    const Recording r = read_recording_file(folder / "t.csv", {}).recording;
    REQUIRE(r.time_s.size() == 21);
    CHECK_THAT(r.time_s.back() - r.time_s.front(), WithinRel(20.0, 1e-9));
  }
}

TEST_CASE("columns of logarithms are refused by their titles") {
  for (const char* titles : {"log w,log G',log G''", "log10(omega),log10(G'),log10(G'')",
                             "lg f / Hz,lg E' / Pa,lg E'' / Pa", "ln t,ln force,ln depth"}) {
    CAPTURE(titles);
    CHECK_THAT(refusal_of_titles(titles),
               Contains("logarithms, by their titles") && Contains("10 to the power of"));
  }
  // The time of a log is one column, and plain columns beside logarithms are read.
  CHECK(read_titled("Log time (s),Depth (mm),Force (N)").recording.time_s.back() == 20.0);
}

TEST_CASE("a column that was logged at a lower rate is read where it has numbers") {
  const auto read = [](const auto& depth_at, const auto& force_at) {
    const test::TempFolder folder;
    std::string text = "Time (s),Depth (mm),Force (N)\n";
    for (int i = 0; i < 200; ++i) {
      text += fmt::format("{},{},{}\n", i, depth_at(i) ? std::to_string(2 * i) : "",
                          force_at(i) ? std::to_string(3 * i) : "NaN");
    }
    write_file(folder / "t.csv", text);
    return read_recording_file(folder / "t.csv", {});
  };
  const auto always = [](int) { return true; };
  const auto quarter = [](int i) { return i % 4 == 0; };
  CHECK(read(quarter, always).recording.response.size() == 50);
  CHECK(read(always, quarter).recording.drive.size() == 50);
  for (const auto& refused : {
           test::refusal_of([&] {  // in turn
             static_cast<void>(
                 read([](int i) { return i % 2 == 0; }, [](int i) { return i % 2 == 1; }));
           }),
           test::refusal_of([&] {  // a mark now and then
             static_cast<void>(read([](int i) { return i < 5 || i % 60 == 0; }, always));
           }),
       }) {
    CHECK_THAT(refused, Contains("t.csv:") && Contains("empty where a number belongs, as") &&
                            Contains("of 200 rows are") && Contains("interpolated"));
  }
}
