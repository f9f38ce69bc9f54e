// Tables of G(t), J(t) and of an oscillation as laboratories write them: the right numbers, or a
// refusal that says what to type.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <vector>

#include "table_reader.hpp"
#include "tpm/files/import/column_title.hpp"
#include "tpm/files/import/header_words.hpp"

using namespace tpm;
using namespace tpm::files;
using Catch::Contains;
using Catch::Matchers::WithinRel;
using test::TableReader;
using test::with;

namespace {

/// Readings of 8 to 1 at 1 s to 8 s.
std::string falling(const std::string& titles) {
  std::string text = titles + "\n";
  for (int i = 1; i <= 8; ++i) text += fmt::format("{},{}\n", i, 9 - i);
  return text;
}

Spectrum read_spectrum(const std::string& text) {
  const test::TempFolder folder;
  write_file(folder / "m.csv", text);
  return read_spectrum_file(folder / "m.csv");
}

std::string spectrum_refusal(const std::string& text, const ImportOptions& options = {}) {
  const test::TempFolder folder;
  write_file(folder / "m.csv", text);
  return test::refusal_of(
      [&] { static_cast<void>(read_spectrum_file(folder / "m.csv", options)); });
}

std::string told(const std::vector<ImportFinding>& findings, const std::string& what) {
  for (const ImportFinding& finding : findings) {
    if (finding.what == what) return finding.value;
  }
  return {};
}

}  // namespace

TEST_CASE("G(t) and J(t) are read with other words beside them") {
  const TableReader read;
  for (const char* title :
       {"Mean G(t) [Pa]", "G(t) mean [Pa]", "Specimen 1 G(t) [Pa]", "Relaxationsmodul G(t) [Pa]",
        "Relaxationsmodul [Pa]", "module de relaxation (Pa)", "modulo de relajacion / Pa"}) {
    CAPTURE(title);
    const Recording recording = read(falling(fmt::format("t [s],{}", title))).recording;
    CHECK(recording.response_quantity == Quantity::relaxation_modulus);
    CHECK(recording.response.front() == 8.0);
  }
  for (const char* title : {"Mean J(t) [1/Pa]", "Kriechnachgiebigkeit [1/Pa]", "J/(1/Pa)"}) {
    CAPTURE(title);
    const Recording recording = read(falling(fmt::format("t [s],{}", title))).recording;
    CHECK(recording.response_quantity == Quantity::creep_compliance);
  }
  CHECK(split_title("J/(1/Pa)").name == "J");
}

TEST_CASE("numbers that are not the readings of G(t) are not taken for them") {
  for (const char* title : {"log G(t)", "G(t) fit", "G(t) lower", "SE G(t)", "normalised G(t)",
                            "max. G(t)", "G(t)/G0", "deviation of G(t)"}) {
    CAPTURE(title);
    const auto meaning = recognize_title(title);
    CHECK_FALSE((meaning && meaning->quantity == Quantity::relaxation_modulus));
  }
  CHECK(recognize_title("G(t) SD")->role == ColumnRole::sd);
  const TableReader read;
  const Recording mean =
      read("t [s],Mean G(t) [Pa],SD G(t) [Pa],n\n1,8,0.5,6\n2,7,0.5,6\n3,6,0.4,6\n4,5,0.4,6\n")
          .recording;
  CHECK(mean.response_sd == std::vector<double>{0.5, 0.5, 0.4, 0.4});
  // The title of nothing else is the readings, and of several specimens one is chosen.
  const Recording one = read("t [s],Mean G(t) [Pa],G(t) [Pa]\n1,8,9\n2,7,8\n3,6,7\n").recording;
  CHECK(one.response.front() == 9.0);
  CHECK_THAT(read.refusal("t [s],Pig 1 G(t) [Pa],Pig 2 G(t) [Pa]\n1,8,9\n2,7,8\n3,6,7\n"),
             Contains("may both be the response") && Contains("--response 2 or --response 3"));
  CHECK_THAT(read.refusal(falling("t [s],G(t)/G0 [%]")),
             Contains("a share of another reading") &&
                 Contains("--response 2 --response-quantity relaxation_modulus --unit 2=Pa"));
}

TEST_CASE("a mean and its deviation in one cell are refused by what they are") {
  const TableReader read;
  for (const char* sign : {"\xC2\xB1", "+/-", "+-"}) {
    CAPTURE(sign);
    CHECK_THAT(read.refusal(fmt::format("t [s],G(t) [Pa]\n1,8.0 {0} 0.3\n2,7.0 {0} 0.3\n", sign)),
               Contains("table.txt:2: '8.0") && Contains("in one cell") && Contains("SD [kPa]"));
  }
}

TEST_CASE("repeated readings of G(t) at times in geometric progression count from the step") {
  const TableReader read;
  std::string text = "t [s],G(t) [Pa]\n";
  for (int i = 0; i < 15; ++i) {
    for (int k = 0; k < 3; ++k) {
      text += fmt::format("{:.4g},{}\n", 0.1 * std::pow(10.0, i / 5.0), 30 - i + 0.1 * k);
    }
  }
  const Recording recording = read(text).recording;
  CHECK(recording.time_s.size() == 15);
  CHECK_THAT(recording.response.front(), WithinRel(30.1, 1e-12));
  // A clock that is late is told by its own tick.
  CHECK_THAT(read.refusal("t [s],G(t) [Pa]\n185.1,9\n185.1,9\n185.2,8\n185.2,8\n185.3,7\n"),
             Contains("ticks every 0.1 s"));
}

TEST_CASE("shuffled rows of J(t) are sorted, specimens below each other are not mixed") {
  const TableReader read;
  const std::string head = "t [s],J(t) [1/Pa]\n";
  const RecordingFile sorted = read(head + "4,4.5\n1,1.5\n8,8.5\n2,2.5\n16,16.5\n0.5,1\n");
  CHECK(sorted.recording.time_s == std::vector<double>{0.5, 1, 2, 4, 8, 16});
  CHECK(sorted.recording.response == std::vector<double>{1, 1.5, 2.5, 4.5, 8.5, 16.5});
  CHECK_THAT(told(sorted.findings, "order"), Contains("sorted"));
  CHECK_THAT(read.refusal(head + "1,1\n2,2\n3,3\n1,2\n2,3\n3,4\n1,1\n2,2\n3,4\n"),
             Contains("does not follow"));
  CHECK_THAT(read.refusal(head + "1,1\n2,2\n4,3\n8,4\n16,5\n1.5,1\n3,2\n6,3\n12,4\n24,5\n"),
             Contains("does not follow"));
}

TEST_CASE("a reading of 0 at the step itself is from before it") {
  const TableReader read;
  const std::string head = "t [s],J(t) [1/Pa]\n";
  const RecordingFile file = read(head + "0,0\n0.5,2\n1,3\n2,4\n4,5\n");
  CHECK(file.recording.time_s.front() == 0.5);
  CHECK_THAT(told(file.findings, "left out"), Contains("before the step"));
  CHECK(read(head + "0,1\n0.5,2\n1,3\n2,4\n4,5\n").recording.time_s.front() == 0.0);
  // The strain has its noise before the step, too.
  for (const char* noise : {"0.001", "-0.001"}) {
    CAPTURE(noise);
    const RecordingFile noisy =
        read(fmt::format("t [s],Stress [Pa],Strain [%]\n0,5,{}\n0.5,5,2\n1,5,3\n2,5,4\n", noise));
    CHECK(noisy.recording.time_s.front() == 0.5);
    CHECK_THAT(told(noisy.findings, "left out"), Contains("the reading at 0 s"));
  }
}

TEST_CASE("a strain that rises in the first rows counts from half of its step") {
  // A strain of 2 % that is reached after `rise_s` of 100 s; 1 kPa, of which a part relaxes.
  const auto table = [](double rise_s, double first_share, double relaxing) {
    std::string text = "Step time [s],Strain [%],Stress [Pa]\n";
    const auto row = [&](double time, double share) {
      const double modulus = 1000.0 * (1.0 - relaxing * (1.0 - std::exp(-time)));
      text += fmt::format("{},{},{}\n", time, 2.0 * share, 0.02 * share * modulus);
    };
    for (const double part : {first_share, 0.6, 0.9}) row(part * rise_s, part);
    for (double time = rise_s; time <= 100.0; time *= 1.1) row(time, 1.0);
    return text;
  };
  const TableReader read;
  const RecordingFile file = read(table(4e-3, 0.3, 0.5));
  CHECK(file.recording.response_quantity == Quantity::relaxation_modulus);
  CHECK_THAT(file.recording.time_s.front(), WithinRel(2e-3, 1e-9));
  CHECK_THAT(file.recording.response.front(), WithinRel(1000.0, 0.01));
  CHECK_THAT(told(file.findings, "left out"),
             Contains("the first 3 rows, in which the strain") && Contains("half of the step"));
  // A ramp that lasts, one whose begin is seen, and a strain that answers are none.
  CHECK(read(table(0.4, 0.3, 0.5)).recording.response_quantity == Quantity::stress);
  CHECK(read(table(4e-3, 0.0, 0.5)).recording.response_quantity == Quantity::stress);
  CHECK(read(table(4e-3, 0.3, 0.0)).recording.response_quantity == Quantity::stress);
}

TEST_CASE("storage and loss compliance become moduli") {
  std::string text = "omega [rad/s],J' [1/kPa],J'' [1/kPa]\n";
  std::string words = "omega [rad/s],Storage compliance [1/kPa],Loss compliance [1/kPa]\n";
  std::vector<std::complex<double>> moduli;
  for (const double omega : {0.1, 1.0, 10.0}) {
    const std::complex<double> i_omega(0.0, omega);
    moduli.push_back(800.0 + 2200.0 * i_omega / (2.0 + i_omega));
    const std::complex<double> compliance = 1e3 / moduli.back();
    const std::string row =
        fmt::format("{},{:.17g},{:.17g}\n", omega, compliance.real(), -compliance.imag());
    text += row;
    words += row;
  }
  for (const std::string& table : {text, words}) {
    const Spectrum spectrum = read_spectrum(table);
    for (std::size_t i = 0; i < moduli.size(); ++i) {
      CHECK_THAT(spectrum.storage[i], WithinRel(moduli[i].real(), 1e-12));
      CHECK_THAT(spectrum.loss[i], WithinRel(moduli[i].imag(), 1e-12));
    }
  }
  CHECK_THAT(spectrum_refusal("f [Hz],J' [1/Pa],G'' [Pa]\n1,1,1\n2,2,2\n"),
             Contains("a compliance beside another kind of column"));
}

TEST_CASE("a spectrum in part is refused with what it lacks") {
  const std::string half = "f [Hz],G' [Pa]\n1,1\n2,2\n";
  CHECK_THAT(spectrum_refusal(half), Contains("no column is recognised as a loss modulus") &&
                                         Contains("G' and tan delta") && !Contains("column 2"));
  CHECK_THAT(spectrum_refusal(half, with("loss", "2")), Contains("both storage and loss"));
  CHECK_THAT(
      spectrum_refusal("omega [rad/s],|eta*| [Pa s]\n1,1\n2,2\n"),
      Contains("a frequency without a storage and a loss modulus") && Contains("|G*| and delta"));
  // The symbol alone is a force, and with hertz a frequency.
  const Spectrum spectrum = read_spectrum("f/Hz,G'/kPa,G''/kPa\n1,1,2\n2,3,4\n");
  CHECK(spectrum.frequency_Hz == std::vector<double>{1, 2});
  CHECK(recognize_title(split_title("F/N").name)->role == ColumnRole::response);
}

TEST_CASE("standard deviations of a spectrum that are not read are told") {
  const test::TempFolder folder;
  write_file(folder / "m.csv", "f [Hz],G' [Pa],SD G' [Pa],G'' [Pa]\n1,1,0.1,2\n2,3,0.1,4\n");
  const MeasuredFile file = read_measured_file(folder / "m.csv");
  CHECK_THAT(told(std::get<SpectrumFile>(file).findings, "not read"), Contains("SD G'"));
}

TEST_CASE("a stress without a drive names the option of a relaxation modulus") {
  const TableReader read;
  const RecordingFile file = read(falling("t [s],Amount [Pa]"), with("response", "2"));
  CHECK_THAT(test::refusal_of([&] { require_time_and_drive(file, "t.csv"); }),
             Contains("--response-quantity relaxation_modulus"));
}
