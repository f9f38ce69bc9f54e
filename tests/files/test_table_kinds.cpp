// Kinds of tables as people have them, with what each says: the right numbers, or a refusal that
// names what to type.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "table_reader.hpp"
#include "tpm/files/clock_text.hpp"
#include "tpm/files/import/column_title.hpp"
#include "tpm/files/import/file_kind.hpp"
#include "tpm/files/import/header_words.hpp"
#include "tpm/files/import/step_clock.hpp"
#include "tpm/files/number_style.hpp"

using namespace tpm;
using namespace tpm::files;
using Catch::Contains;
using Catch::Matchers::WithinRel;
using test::TableReader;
using test::with;

namespace {

/// Rows of time in s, ramp to 4 mm in 2 s, and k_inf = 60 N/m with a branch of 45 N/m, 2 s.
std::string ramp_rows(const std::string& pattern, int rows = 61) {
  std::string text;
  for (int i = 0; i < rows; ++i) {
    const double t = 0.1 * i;
    const double ramp = std::min(t, 2.0);
    const double depth = 2.0 * ramp;
    const double force =
        0.060 * depth + 0.045 * 4.0 * (std::exp((ramp - t) / 2.0) - std::exp(-t / 2.0));
    text += fmt::format(fmt::runtime(pattern), t, depth, force);
  }
  return text;
}

std::string with_commas(std::string text) {
  std::replace(text.begin(), text.end(), '.', ',');
  return text;
}

}  // namespace

TEST_CASE("marks of thousands are told from decimal signs by the whole column") {
  const TableReader read;
  const std::string head = "Time [s]\tDepth [um]\tForce [uN]\n";
  for (const std::string mark : {",", ".", "'", " ", "\xC2\xA0", "\xE2\x80\xAF"}) {
    INFO(mark);
    std::string text = head;
    for (int i = 0; i <= 8; ++i) {
      const int force = 333 * i;
      text += fmt::format("{}\t{}\t", i, 10 * i) +
              (force < 1000 ? std::to_string(force)
                            : fmt::format("{}{}{:03}", force / 1000, mark, force % 1000)) +
              "\n";
    }
    const Recording r = read(text).recording;
    CHECK_THAT(r.response.back(), WithinRel(2664e-6, 1e-12));
    CHECK_THAT(r.response[3], WithinRel(999e-6, 1e-12));
  }
  // Every number fits both readings.
  const std::string open = head + "0\t0\t1,002\n1\t10\t1,332\n2\t20\t1,665\n3\t30\t2,004\n";
  CHECK_THAT(read.refusal(open), Contains("column 3 'Force'") && Contains("--thousands comma") &&
                                     Contains("--decimal comma"));
  CHECK_THAT(read(open, with("thousands", "comma")).recording.response[0],
             WithinRel(1002e-6, 1e-12));
  CHECK_THAT(read(open, with("decimal", "comma")).recording.response[0],
             WithinRel(1.002e-6, 1e-12));
  // Another column decides: its times have decimal points, or commas.
  const std::string points = head + "0.0\t0\t1,002\n0.5\t10\t1,332\n1.0\t20\t1,665\n";
  CHECK_THAT(read(points).recording.response[0], WithinRel(1002e-6, 1e-12));
  const std::string commas = head + "0,0\t0\t1,002\n0,5\t10\t1,332\n1,0\t20\t1,665\n";
  CHECK_THAT(read(commas).recording.response[0], WithinRel(1.002e-6, 1e-12));
  // Times too.
  const std::string times =
      "Time [ms]\tDepth [um]\tForce [uN]\n0\t0\t1\n500\t1\t2\n1,000\t2\t3\n1,500\t3\t4\n";
  CHECK_THAT(read(times).recording.time_s.back(), WithinRel(1.5, 1e-12));
  // Two columns that contradict each other.
  CHECK_THAT(read.refusal(head + "0.5\t0,25\t1\n1.5\t1,25\t2\n"),
             Contains("column 1 'Time', column 2 'Depth'") && Contains("--decimal"));
}

TEST_CASE("numbers in a style: groups of three, one decimal sign, any minus") {
  const NumberStyle swiss{false, ThousandsMark::apostrophe};
  CHECK(find_styled_number("1'234'567.5", swiss) == 1234567.5);
  CHECK(find_styled_number("1\xE2\x80\x99"
                           "234",
                           swiss) == 1234.0);
  CHECK_FALSE(find_styled_number("12'34", swiss));
  CHECK_FALSE(find_styled_number("0'123", swiss));
  const NumberStyle german{true, ThousandsMark::point};
  CHECK(find_styled_number("-1.234,5", german) == -1234.5);
  CHECK(find_styled_number("\xE2\x88\x92"
                           "0,5e-3",
                           german) == -0.5e-3);
  CHECK_FALSE(find_styled_number("1.2345", german));
  CHECK_FALSE(find_styled_number("nan", NumberStyle{}));
  CHECK_FALSE(is_number_in_some_style("1.2.3"));
  CHECK_FALSE(is_number_in_some_style("2022-03-22"));
}

TEST_CASE("a clock that ran before the step is refused, and --step-time tells it") {
  const TableReader read;
  const auto step = [](double start, double every, const char* title) {
    std::string text = fmt::format("{}\tStrain\tStress\ns\t%\tPa\n", title);
    for (int i = 1; i <= 200; ++i) {
      const double t = every * i;
      text += fmt::format("{:.4f}\t1.000\t{:.5f}\n", start + t, 20.0 + 30.0 * std::exp(-t / 5.0));
    }
    return text;
  };
  CHECK(read(step(0.0, 0.1, "Time")).recording.response_quantity == Quantity::relaxation_modulus);
  CHECK_THAT(read.refusal(step(185.0, 0.1, "Time")),
             Contains("the first sample is 185.1 s after the step") && Contains("--step-time"));
  const Recording told = read(step(185.0, 0.1, "Time"), with("step_time", "185 s")).recording;
  CHECK_THAT(told.time_s.front(), WithinRel(0.1, 1e-9));
  // Two clocks side by side: that of the step is taken.
  std::string both = "Time\tStep time\tStrain\tStress\ns\ts\t%\tPa\n";
  for (int i = 1; i <= 50; ++i) {
    both += fmt::format("{:.1f}\t{:.1f}\t1\t{:.4f}\n", 185.0 + 0.1 * i, 0.1 * i, 50.0 - 0.1 * i);
  }
  CHECK_THAT(read(both).recording.time_s.front(), WithinRel(0.1, 1e-9));
  CHECK_THROWS_WITH(with("step_time", "190 mm"), Contains("test") && Contains("time"));
  // A ramp holds no step.
  CHECK_THAT(read.refusal("Time [s],Depth [mm],Force [N]\n" + ramp_rows("{:.1f},{:.4f},{:.5f}\n"),
                          with("step_time", "1 s")),
             Contains("holds no step"));
}

TEST_CASE("times in geometric progression count from the step") {
  std::vector<double> geometric, decades, late, late_decades;
  for (int i = 0; i < 60; ++i) {
    geometric.push_back(std::round(1e4 * 0.05 * std::pow(10.0, i / 15.0)) / 1e4);
    late.push_back(100.0 + 0.1 * i);
    late_decades.push_back(100.0 + 0.01 * std::pow(10.0, i / 15.0));
  }
  for (const double decade : {1.0, 10.0, 100.0}) {
    for (const double t : {1.0, 2.0, 5.0}) decades.push_back(decade * t);
  }
  CHECK(counts_from_step(geometric));
  CHECK(counts_from_step(decades));
  CHECK_FALSE(counts_from_step(late));
  CHECK_FALSE(counts_from_step(late_decades));
}

TEST_CASE("what was asked for, limits and other quantities have no meaning") {
  for (const char* title : {"Displacement command",
                            "Cmd displacement",
                            "Target force",
                            "Force set point",
                            "Force setpoint",
                            "Demand load",
                            "Ref. force",
                            "Reference position",
                            "Max. load",
                            "Maximum force",
                            "Peak load",
                            "Force limit",
                            "Position error",
                            "Nominal force",
                            "Nennkraft",
                            "Sollkraft",
                            "Kraft-Soll",
                            "Wegsollwert",
                            "Maximalkraft",
                            "Consigne de force",
                            "Force (consigne)",
                            "Valeur de consigne force",
                            "Commande de position",
                            "Fuerza objetivo",
                            "Consigna de fuerza",
                            "Forza obiettivo",
                            "Spostamento comando",
                            "Load cell temperature",
                            "Force rate",
                            "Load at break"}) {
    INFO(title);
    CHECK_FALSE(recognize_title(title));
    CHECK(refused_title(title));
  }
  // Nominal as engineering: of the specimen before the test.
  for (const char* title : {"Nominal stress", "Stress (nominal)", "Nennspannung",
                            "Contrainte nominale", "Esfuerzo nominal"}) {
    INFO(title);
    REQUIRE(recognize_title(title));
    CHECK(recognize_title(title)->quantity == Quantity::stress);
    CHECK_FALSE(refused_title(title));
  }
  CHECK(recognize_title("Nominal strain")->quantity == Quantity::strain);
  CHECK(recognize_title("Nenndehnung")->quantity == Quantity::strain);
  const TableReader engineering;
  const Recording nominal =
      engineering("Time [s],Nominal strain [%],Nominal stress [kPa]\n0,0,0\n1,1,1\n2,2,2\n3,2,1\n")
          .recording;
  CHECK(nominal.response_quantity == Quantity::stress);
  CHECK(nominal.response[2] == 2e3);
  CHECK(recognize_title("Stretch ratio"));
  CHECK(recognize_title("SD of force")->role == ColumnRole::sd);
  const TableReader read;
  const std::string rows = ramp_rows("{0:.1f},{1:.4f},{1:.3f},{2:.5f}\n");
  const RecordingFile file = read("Time [s],Depth command [mm],Depth [mm],Force [N]\n" + rows);
  CHECK_THAT(columns_words(file.findings),
             Catch::StartsWith("read as ") &&
                 Contains("no meaning: column 2 'Depth command': 'command' is what was asked for"));
  // Alone, such a column is not taken either; the option that takes it is named.
  CHECK_THAT(read.refusal("Time [s],Depth command [mm],Channel 3,Force [N]\n" + rows),
             Contains("--drive 2 to take this one"));
}

TEST_CASE("columns that already mean something are not offered as the missing one") {
  const TableReader read;
  const std::string rows = "0,1,2\n1,2,3\n2,3,4\n3,4,5\n";
  const std::string tonometer = read.refusal("Time (s),Pressure (mmHg),Weight\n" + rows);
  CHECK_THAT(tonometer, Contains("--response with one of column 3 'Weight'"));
  CHECK_THAT(tonometer, !Contains("'Time'"));
  // Nor those of another quantity, by their unit or their word.
  CHECK_THAT(
      read.refusal("Time (s),Angle (deg),Torque (mN m)\n" + rows),
      Contains("a column of it with its unit, such as Force (N)") && !Contains("--response"));
  CHECK_THAT(read.refusal("Time (s),Pressure (Pa),Aspirated length (um)\n" + rows),
             !Contains("--response"));
  CHECK_THAT(read.refusal("Sweep,Angle (deg),Force (N)\n" + rows),
             Contains("--time or --drive with one of column 1 'Sweep'") && !Contains("'Angle'"));
  CHECK_THAT(read.refusal("Time (s),Depth (mm)\n0,1\n1,2\n2,3\n"),
             Contains("a column of it with its unit, such as Force (N)"));
  CHECK_THAT(read.refusal("Minute,Force (N)\n0,1\n1,2\n2,3\n"),
             Contains("--time or --drive with one of column 1 'Minute'") && !Contains("'Force'"));
}

TEST_CASE("two columns of one rank are refused where their numbers differ") {
  const TableReader read;
  const std::string same = ramp_rows("{0:.1f},{1:.4f},{2:.5f},{2:.5f}\n");
  CHECK(read("Time [s],Depth [mm],Force A [N],Force B [N]\n" + same).recording.drive.size() == 61);
  std::string differ = "Time [s],Depth [mm],Force1 [N],Force2 [N]\n";
  for (int i = 0; i < 20; ++i) differ += fmt::format("{},{},{},{}\n", i, i, 2 * i, 3 * i);
  CHECK_THAT(read.refusal(differ), Contains("--response 3 or --response 4"));
  CHECK(read(differ, with("response", "4")).recording.response.back() == 57.0);
  // A set of titles that repeats is another specimen; a short one leaves its cells blank.
  std::string beside =
      "Specimen 1,,,Specimen 2,,\nTime,Extension,Load,Time,Extension,Load\n"
      "(s),(mm),(N),(s),(mm),(N)\n";
  for (int i = 0; i < 30; ++i) {
    beside += i < 20 ? fmt::format("{0},{0},{1},{0},{0},{2}\n", i, 2 * i, 3 * i)
                     : fmt::format(",,,{0},{0},{1}\n", i, 3 * i);
  }
  const RecordingFile first = read(beside);
  CHECK(first.recording.response.size() == 20);
  CHECK(first.recording.response.back() == 38.0);
  CHECK_THAT(columns_words(first.findings), Contains("2 side by side"));
}

TEST_CASE("a numbered title has no unit, and a strain without one is refused") {
  CHECK(split_title("Strain_1").unit.empty());
  CHECK(split_title("Strain (1)").unit.empty());
  CHECK(split_title("Strain 1 (%)").unit == "%");
  CHECK(split_title("Load (N) Ch. 1").unit == "N");
  CHECK(split_title("Force N").unit == "N");
  CHECK(split_title("Force/N").name == "Force");
  CHECK(split_title("Force/s").unit.empty());
  CHECK(recognize_title("Force2")->role == ColumnRole::response);
  const TableReader read;
  const auto strains = [](const char* title, double largest) {
    std::string text = fmt::format("Time (s),{},Stress (kPa)\n", title);
    for (int i = 0; i <= 40; ++i) {
      text += fmt::format("{:.1f},{:.4f},{:.4f}\n", 0.1 * i, largest * i / 40.0, 0.1 * i);
    }
    return text;
  };
  for (const char* title : {"Strain_1", "Strain (1)", "Strain"}) {
    for (const double largest : {0.2, 5.0, 20.0}) {
      CHECK_THAT(read.refusal(strains(title, largest)), Contains("has no unit"));
    }
  }
  CHECK_THAT(read.refusal(strains("Strain [-]", 20.0)),
             Contains("reaches 20") && Contains("--unit"));
  CHECK(read(strains("Strain [-]", 0.2)).recording.drive.back() == 0.2);
  CHECK_THAT(read(strains("Strain (%)", 20.0)).recording.drive.back(), WithinRel(0.2, 1e-12));
}

TEST_CASE("tables in every layout give the same recording") {
  const TableReader read;
  const std::string titles = "Zeit [s];Weg [mm];Kraft [N]\n";
  const std::string rows = with_commas(ramp_rows("{:.2f};{:.4f};{:.5f}\n"));
  const Recording plain = read(titles + rows).recording;
  REQUIRE(plain.response.size() == 61);
  std::string preamble;
  for (int i = 0; i < 150; ++i) preamble += fmt::format("Parameter {};wert\n", i);
  std::string blanks = ramp_rows("{:.2f}  {:.4f} {:.5f}\n");
  const std::vector<std::pair<const char*, std::string>> layouts = {
      {"quotes", "\"Zeit [s]\",\"Weg [mm]\",\"Kraft [N]\"\n" +
                     with_commas(ramp_rows("\"{:.2f}\"#\"{:.4f}\"#\"{:.5f}\"\n"))},
      {"a version above", "Software;5.1\nRaum;23.5\n" + titles + rows},
      {"a long preamble", preamble + titles + rows},
      {"an end mark", titles + rows + "<END DATA>\n"},
      {"a summary below", titles + rows + "Maximum;4,0;0,35\nMittel;3,0;0,2\n"},
      {"results above",
       "Probe;Maximum;E\n1;3,5;1,0\n2;3,6;1,1\n3;3,7;1,2\n4;3,5;1,0\n" + titles + rows},
      {"blanks and a comment", "# time_s depth_mm force_N\n" + blanks},
      {"blanks and brackets", "Time [s] Depth [mm] Force [N]\n" + blanks},
      {"an inch sign", "Zeit [s];Weg [mm];Kraft [N];4\" probe\n" +
                           with_commas(ramp_rows("{:.2f};{:.4f};{:.5f};1\n"))}};
  for (auto [name, text] : layouts) {
    INFO(name);
    std::replace(text.begin(), text.end(), '#', name == std::string("quotes") ? ',' : '#');
    const Recording r = read(text).recording;
    CHECK(r.time_s == plain.time_s);
    CHECK(r.drive == plain.drive);
    CHECK(r.response == plain.response);
  }
  // Decimal commas between separating commas: nothing tells them apart.
  CHECK_THAT(read.refusal("Time [s],Depth [mm]\n0,05,0,12\n0,15,0,25\n0,25,0,31\n"),
             Contains("commas in numbers look like separators"));
  // Two blocks that both may be meant.
  const std::string two = titles + rows + "Zweiter Versuch\n" + titles + rows;
  CHECK_THAT(read.refusal(two), Contains("holds 2 blocks of samples") && Contains("--block"));
  CHECK(read(two, with("block", "2")).recording.response == plain.response);
}

TEST_CASE("inches, pounds and bytes that are not UTF-8") {
  const TableReader read;
  const Recording r =
      read(
          "\"Time\",\"Extension\",\"Load\"\n\"(s)\",\"(in)\",\"(lbf)\"\n"
          "\"0.0\",\"0.0\",\"0.0\"\n\"0.5\",\"0.5\",\"2.0\"\n\"1.0\",\"1.0\",\"4.0\"\n")
          .recording;
  CHECK_THAT(r.drive.back(), WithinRel(0.0254, 1e-12));
  CHECK_THAT(r.response.back(), WithinRel(4.0 * 4.4482216152605, 1e-12));
  const Recording sign = read("Time (s)\tDepth (\")\tStress (psi)\n0\t0\t0\n1\t0\t1\n2\t0\t2\n",
                              with("rest_length", "1 in"))
                             .recording;
  CHECK_THAT(sign.response.back(), WithinRel(2.0 * 6894.757293168361, 1e-12));
  const RecordingFile latin =
      read("Time (s)\tDepth (\xB5m)\tForce (mN)\n0\t0\t0\n1\t10\t1\n2\t20\t2\n");
  CHECK_THAT(latin.recording.drive.back(), WithinRel(20e-6, 1e-12));
  CHECK_THAT(columns_words(latin.findings), Contains("latin-1, because it is not UTF-8"));
}

TEST_CASE("units are read as machines write them, and weights ask for the force that is meant") {
  const TableReader read;
  const auto seconds = [&](const std::string& unit) {
    return read("Elapsed Time\tDisp\tLoad\n" + unit + "\tmm\tN\n0\t0\t0\n1\t1\t1\n2\t1\t0.5\n")
        .recording;
  };
  for (const char* unit : {"Sec", "SEC", "sec.", "Sek.", "[Sec]", "Seconds", "Sekunden"}) {
    INFO(unit);
    CHECK_THAT(seconds(unit).time_s.at(2), WithinRel(2.0, 1e-12));
    CHECK_THAT(seconds(unit).drive.at(1), WithinRel(1e-3, 1e-12));
  }
  const Recording r =
      read("Time (Sec),Distance (Millimeter),Force (KN)\n0,0,0\n1,1,1\n2,1,1\n").recording;
  CHECK_THAT(r.response.at(1), WithinRel(1e3, 1e-12));
  CHECK_THAT(r.drive.at(1), WithinRel(1e-3, 1e-12));
  // A texture analyser counts forces in grams.
  const std::string grams = "Force (g),Distance (mm),Time (sec)\n0,0,0\n100,1,1\n90,1,2\n";
  CHECK_THAT(read.refusal(grams), Contains("unknown unit 'g' of a force") &&
                                      Contains("--unit \"Force=gf\" for the weight"));
  ImportOptions gram_force;
  gram_force.units["Force"] = "gf";
  CHECK_THAT(read(grams, gram_force).recording.response.at(1), WithinRel(0.980665, 1e-12));
  CHECK_THAT(read.refusal("Time,Depth,Load\ns,mm,lbs\n0,0,0\n1,1,1\n2,1,1\n"),
             Contains("--unit \"Load=lbf\""));
}

TEST_CASE("a unit is said of a column by its name, whole title or number, and of no other") {
  const TableReader read;
  const std::string table = "time (s),depth (mm),force (N)\n0,0,0\n1,1,1\n2,1,0.5\n";
  for (const char* selector : {"force", "force (N)", "3"}) {
    INFO(selector);
    ImportOptions milli;
    milli.units[selector] = "mN";
    CHECK_THAT(read(table, milli).recording.response.at(1), WithinRel(1e-3, 1e-12));
  }
  for (const char* selector : {"Force", "load", "4", "force (mN)"}) {
    INFO(selector);
    ImportOptions milli;
    milli.units[selector] = "mN";
    CHECK_THAT(read.refusal(table, milli), Contains("no column '") && Contains("--unit names"));
  }
  ImportOptions titles;
  titles.time_column = "time (s)";
  titles.response_column = "force (N)";
  CHECK(read(table, titles).recording.response == read(table).recording.response);
}

TEST_CASE("a column of another title is time, drive or force if nothing else can be") {
  const TableReader read;
  const auto table = [](const std::string& titles) {
    return titles + "\n0,0,0,5\n1,1,1,5\n2,1,0.5,5\n";
  };
  CHECK_THAT(read(table("Time (s),Kolbenweg (mm),Load (N),Width (mm)")).recording.drive.at(1),
             WithinRel(1e-3, 1e-12));
  CHECK_THAT(read(table("Messzeit (s),Depth (mm),Load (N),Width (mm)")).recording.time_s.at(2),
             WithinRel(2.0, 1e-12));
  CHECK_THAT(read(table("Time (s),Depth (mm),FN (mN),Note")).recording.response.at(1),
             WithinRel(1e-3, 1e-12));
  CHECK_THROWS_WITH(require_time_and_drive(read(table("n,Depth (mm),Load (N),Note")), "t.csv"),
                    Contains("--time with one of column 1 'n', column 4 'Note'"));
  // Two columns of lengths: neither is taken, and both are listed.
  const RecordingFile two = read(table("Time (s),Gap (mm),Load (N),Sensor (mm)"));
  CHECK(two.recording.drive.empty());
  CHECK_THROWS_WITH(require_time_and_drive(two, "two.csv"),
                    Contains("--drive with one of column 2 'Gap', column 4 'Sensor'"));
  // A gap beside a strain is not what was imposed.
  CHECK(read(table("Time (s),Strain [-],Stress (Pa),Gap (mm)")).recording.drive_quantity ==
        Quantity::strain);
  const Recording stretched = read(table("Time (s),L/L0,Stress (kPa),Note")).recording;
  CHECK(stretched.drive_quantity == Quantity::relative_length);
}

TEST_CASE("times of day and of a stopwatch are seconds") {
  CHECK(find_clock_seconds("11:09:16.5") == 40156.5);
  CHECK(find_clock_seconds("0:01:23,5") == 83.5);
  CHECK(find_clock_seconds("2022-03-22 11:09:16") == 40156.0);
  CHECK(find_clock_seconds("3:00:01 PM") == 54001.0);
  CHECK(find_clock_seconds("01:23.5") == 83.5);
  CHECK_FALSE(find_clock_seconds("01:23"));  // minutes and seconds, or hours and minutes
  const TableReader read;
  const Recording r = read(
                          "Time,Depth [mm],Force [N]\n23:59:59.0,0,0\n23:59:59.5,1,1\n"
                          "00:00:00.0,2,2\n00:00:00.5,3,3\n")
                          .recording;
  CHECK_THAT(r.time_s.back() - r.time_s.front(), WithinRel(1.5, 1e-9));
}

TEST_CASE("the table of an AFM: depth is height minus deflection") {
  const TableReader read;
  // k = 0.05 N/m: a force of 1 nN bends the cantilever by 20 nm.
  const std::string head = "Time [s],Height [um],Force [nN]\n";
  const std::string rows = "0,0,0\n1,1,1\n2,2,2\n3,3,4\n";
  CHECK_THAT(columns_words(read(head + rows).findings),
             Contains("warning: column 2 'Height'") && Contains("--spring-constant"));
  ImportOptions options = with("spring_constant", "0.05 N/m");
  const Recording r = read(head + rows, options).recording;
  CHECK_THAT(r.drive.back(), WithinRel(3e-6 - 80e-9, 1e-12));
  CHECK_THAT(r.response.back(), WithinRel(4e-9, 1e-12));
  const std::string volts = "Time [s],Piezo height [um],Deflection [V]\n0,0,0\n1,1,0.4\n2,2,0.8\n";
  CHECK_THAT(read.refusal(volts),
             Contains("--spring-constant") && Contains("and --deflection-sensitivity"));
  CHECK_THAT(read.refusal(volts, options), Contains("--deflection-sensitivity"));
  set_reading_option(options, "deflection_sensitivity", "50 nm/V", "test");
  const Recording v = read(volts, options).recording;
  CHECK_THAT(v.drive.back(), WithinRel(2e-6 - 40e-9, 1e-12));
  CHECK_THAT(v.response.back(), WithinRel(0.05 * 40e-9, 1e-12));
  CHECK_THAT(read.refusal("Time [s],Height [um],Force [nN]\n0,3,0\n1,2,1\n2,1,2\n", options),
             Contains("the height falls") || Contains("--deflection-sensitivity only"));
}

TEST_CASE("a file of another kind is named as what it is") {
  CHECK_THAT(find_other_kind("\xD0\xCF\x11\xE0zz", "a.xls")->what, Contains("Excel"));
  CHECK_THAT(find_other_kind("\x89HDF", "a.h5")->what, Contains("HDF5"));
  CHECK_THAT(find_other_kind("a: 1\n", "a.yaml")->what, Contains("YAML"));
  CHECK_THAT(find_other_kind(std::string("\x05\x00", 2), "a.ibw")->what, Contains("Igor"));
  CHECK_FALSE(find_other_kind("a,b\n1,2\n", "a.csv"));
  CHECK_THAT(
      find_other_document(Json{{"law", "linear-1"}, {"parameters", {}}, {"provenance", {}}})->what,
      Contains("law"));
  CHECK_THAT(find_other_document(Json{{"model", {}}, {"rate", "1 kHz"}})->what,
             Contains("session"));
  CHECK_FALSE(find_other_document(Json{{"title", "t"}, {"model", "cvodes"}, {"parameters", {}}}));
}

TEST_CASE("the options of reading have one text form for all who read") {
  ImportOptions options;
  const std::vector<std::pair<std::string, std::string>> said = {
      {"encoding", "latin-1"}, {"separator", "semicolon"},
      {"decimal", "comma"},    {"thousands", "point"},
      {"block", "2"},          {"time", "Zeit"},
      {"step_time", "185 s"},  {"from", "2 s"},
      {"until", "30 s"},       {"segments", "extend,pause"}};
  for (const auto& [key, text] : said) set_reading_option(options, key, text, key);
  const auto texts = reading_texts(options);
  for (const auto& pair : said) CHECK(std::find(texts.begin(), texts.end(), pair) != texts.end());
  CHECK(texts.size() == said.size());
  CHECK_THROWS_WITH(with("decimals", "comma"), Contains("unknown option 'decimals'"));
  CHECK_THROWS_WITH(with("decimal", "semicolon"), Contains("point, comma"));
  const TableReader read;
  ImportOptions window = with("from", "2 s");
  set_reading_option(window, "until", "4 s", "test");
  const Recording r =
      read("Time [s],Depth [mm],Force [N]\n" + ramp_rows("{:.1f},{:.4f},{:.5f}\n"), window)
          .recording;
  CHECK(r.time_s.front() == 2.0);
  CHECK(r.time_s.back() == 4.0);
}
