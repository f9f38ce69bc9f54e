// Oscillatory data: storage and loss over frequency.
#include <catch2/catch.hpp>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/header_words.hpp"
#include "tpm/files/import/import.hpp"
#include "tpm/files/import/pack.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/files/json.hpp"
#include "tpmkit/curve_file.hpp"

using namespace tpm;
using namespace tpm::files;
using Catch::Matchers::WithinRel;
using test::TempFolder;

namespace {

constexpr const char* kModuli = R"({"id": "c", "title": "t", "kind": "spectrum",
  "provenance": "measured",
  "columns": {"frequency_rad/s": {"quantity": "frequency", "unit": "rad/s"},
              "storage_kPa": {"quantity": "storage_modulus", "unit": "kPa"},
              "storage_sd_kPa": {"quantity": "storage_modulus", "unit": "kPa", "bound": "sd"},
              "loss_Pa": {"quantity": "loss_modulus", "unit": "Pa"}}})";
const std::string kHead = "frequency_rad/s,storage_kPa,storage_sd_kPa,loss_Pa\n";

std::string fault(const std::string& json, const std::string& csv) {
  const TempFolder folder;
  write_file(folder / "c.json", json);
  write_file(folder / "c.csv", csv);
  return test::refusal_of([&] { static_cast<void>(load_spectrum(folder / "c.csv")); });
}

std::string import_fault(const std::string& csv, const ImportOptions& options = {}) {
  const TempFolder folder;
  write_file(folder / "m.csv", csv);
  return test::refusal_of([&] { static_cast<void>(import_curves(folder / "m.csv", options)); });
}

/// Imported, written and loaded, as a user does it.
Spectrum imported(const std::string& csv, const ImportOptions& options = {}) {
  const TempFolder folder;
  write_file(folder / "m.csv", csv);
  ImportedCurve curve = import_curves(folder / "m.csv", options).at(0);
  curve.description.header.id = "c";
  curve.description.header.title = "t";
  write_file(folder / "c.csv", curve.csv);
  write_file(folder / "c.json", to_text(description_json(curve.description)));
  return load_spectrum(folder / "c.csv");
}

}  // namespace

TEST_CASE("a spectrum is read in SI, radians per second as cycles, in any order") {
  const TempFolder folder;
  write_file(folder / "c.json", kModuli);
  write_file(folder / "c.csv",
             kHead + "62.83185307179586,2,0.1,300\n6.283185307179586,1,0.1,200\n");
  const Spectrum spectrum = load_spectrum(folder / "c.csv");
  CHECK(spectrum.dimension == Dimension::stress);
  CHECK_THAT(spectrum.frequency_Hz.at(0), WithinRel(10.0, 1e-14));
  CHECK_THAT(spectrum.frequency_Hz.at(1), WithinRel(1.0, 1e-14));
  CHECK(spectrum.storage == std::vector<double>{2000, 1000});
  CHECK(spectrum.loss == std::vector<double>{300, 200});
  CHECK(spectrum.storage_sd == std::vector<double>{100, 100});
  CHECK(spectrum.loss_sd.empty());
  CHECK(curve_size(load_curve(folder / "c.json")) == 2);
  CHECK_THROWS_WITH(load_recording(folder / "c.csv"),
                    Catch::EndsWith("is a curve of kind spectrum; expected kind recording"));

  pack_curves(folder / "p.h5", {spectrum});
  const auto back = std::get<Spectrum>(unpack_curves(folder / "p.h5").at(0));
  CHECK(back.frequency_Hz == spectrum.frequency_Hz);
  CHECK(back.storage == spectrum.storage);
  CHECK(back.loss == spectrum.loss);
  CHECK(back.storage_sd == spectrum.storage_sd);
  CHECK(back.loss_sd.empty());
  CHECK(back.dimension == spectrum.dimension);
}

TEST_CASE("each fault of a spectrum is told with its place") {
  CHECK(fault(kModuli, kHead + "1,1,0,1\n").empty());
  CHECK_THAT(fault(kModuli, kHead + "0,1,0,1\n"), Catch::Contains("c.csv:2: frequency 0 is not"));
  CHECK_THAT(fault(kModuli, kHead + "1,1,0,1\n2,1,0,1\n1,1,0,1\n"),
             Catch::Contains("c.csv:4: frequency") && Catch::Contains("stands twice"));
  CHECK_THAT(fault(kModuli, kHead + "1,-1,0,1\n"), Catch::Contains("storage -1000 is negative"));
  CHECK_THAT(fault(kModuli, kHead + "1,1,0,-1\n"), Catch::Contains("loss -1 is negative"));
  CHECK_THAT(fault(kModuli, kHead + "1,1,-1,1\n"), Catch::Contains("-1 is too small"));
  CHECK_THAT(fault(kModuli, kHead + "1,1,0,\n"), Catch::Contains("column 'loss_Pa': empty"));
  const auto with = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  CHECK_THAT(
      fault(with(kModuli, "\"provenance\": \"measured\",", ""), kHead + "1,1,0,1\n"),
      Catch::Contains("key /provenance: is missing; expected where the whole of it comes from"));
  CHECK_THAT(
      fault(with(kModuli, "\"kind\"", "\"observable\": \"stress\", \"kind\""), kHead + "1,1,0,1\n"),
      Catch::Contains("key /observable: is no key of the kind 'spectrum'"));
  CHECK_THAT(fault(with(kModuli, "loss_modulus", "stress"), kHead + "1,1,0,1\n"),
             Catch::Contains("'stress' in a file of kind spectrum"));
  const auto mixed = with(
      with(kModuli, "\"loss_modulus\", \"unit\": \"Pa\"", "\"loss_stiffness\", \"unit\": \"N/m\""),
      "loss_Pa", "loss");
  CHECK_THAT(fault(mixed, "frequency_rad/s,storage_kPa,storage_sd_kPa,loss\n1,1,0,1\n"),
             Catch::Contains("moduli beside stiffnesses"));
}

TEST_CASE("machine exports of spectra in five languages, with primes and as stiffness") {
  for (const char* head :
       {"Frequency (Hz),G' (Pa),G'' (Pa)", "Frequenz [Hz],Speichermodul [Pa],Verlustmodul [Pa]",
        "Fr\xC3\xA9quence (Hz),Module de conservation (Pa),Module de perte (Pa)",
        "Frequency (Hz),Storage modulus (Pa),Loss modulus (Pa)",
        "freq_Hz,E\xE2\x80\xB2_Pa,E\xE2\x80\xB3_Pa"}) {
    INFO(head);
    const Spectrum spectrum = imported(std::string(head) + "\n0.1,100,10\n1,150,20\n");
    CHECK(spectrum.frequency_Hz == std::vector<double>{0.1, 1});
    CHECK(spectrum.storage == std::vector<double>{100, 150});
    CHECK(spectrum.loss == std::vector<double>{10, 20});
  }
  const Spectrum stiffness = imported(
      "Frequency,Time,Storage stiffness,Loss stiffness,Complex viscosity\nHz,s,N/mm,N/mm,Pa s\n"
      "1,0,0.2,0.1,5\n2,1,0.3,0.1,5\n");
  CHECK(stiffness.dimension == Dimension::stiffness);
  CHECK(stiffness.storage == std::vector<double>{200, 300});
  ImportOptions options;
  options.frequency_column = "1";
  options.storage_column = "2";
  options.loss_column = "3";
  options.units = {{"1", "Hz"}, {"2", "kPa"}, {"3", "kPa"}};
  CHECK(imported("a,b,c\n1,2,3\n2,3,4\n", options).loss == std::vector<double>{3000, 4000});
  CHECK(recognize_title("G''")->role == ColumnRole::loss);
  CHECK_FALSE(recognize_title("G'''").has_value());
}

TEST_CASE("exports that hold no whole spectrum are refused") {
  const std::string head = "Frequency (Hz),G' (Pa),G'' (Pa)\n";
  CHECK_THAT(import_fault(head + "1,1,1\n1,2,2\n"), Catch::Contains("m.csv:3: frequency 1 stands"));
  CHECK_THAT(import_fault(head + "1,1,1\n2,-2,2\n"), Catch::Contains("storage -2 is negative"));
  CHECK_THAT(import_fault("Frequency (Hz),G' (Pa)\n1,1\n2,2\n"),
             Catch::Contains("no column is recognised as a loss modulus; expected --loss"));
  CHECK_THAT(import_fault("Shear strain (%),G' (Pa),G'' (Pa)\n0.1,9,1\n1,8,2\n"),
             Catch::Contains("column 2 'G'': a storage or loss modulus without a frequency, as of "
                             "a sweep of the amplitude, the temperature or the time; expected a "
                             "sweep of the frequency, or --frequency with one of column 1"));
  CHECK_THAT(import_fault("Frequency,G',G''\n1,1,1\n2,2,2\n"),
             Catch::Contains("--unit \"Frequency=UNIT\" with a unit of frequency: Hz, kHz, rad/s; "
                             "--unit \"G'=UNIT\" with a unit of stress"));
  CHECK_THAT(import_fault("Frequency (Hz),G' (Pa),G'' (N/m)\n1,1,1\n2,2,2\n"),
             Catch::Contains("a modulus beside a stiffness"));
  ImportOptions figure;
  figure.x = parse_axis("frequency:Hz", "--x-quantity");
  figure.y = parse_axis("storage_modulus:Pa", "--y-quantity");
  CHECK_THAT(import_fault("1,1\n2,2\n", figure), Catch::Contains("without both storage and loss"));
  const TempFolder folder;
  write_file(folder / "m.csv", head + "1,1,1\n2,2,2\n");
  CHECK_THROWS_WITH(read_recording_file(folder / "m.csv"), Catch::Contains("holds a spectrum"));
}
