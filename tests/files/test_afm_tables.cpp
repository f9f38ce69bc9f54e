// Tables of an atomic force microscope in which the deflection of the cantilever stands beside the
// height and the force.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "table_reader.hpp"

using namespace tpm;
using namespace tpm::files;
using Catch::Contains;
using Catch::Matchers::WithinRel;
using test::TableReader;
using test::with;

namespace {

const std::string kAfmTitles = "Time [s],Height [um],Deflection [nm],Force [nN]\n";
const std::string kAfmRows = "0,0,0,0\n1,1,20,1\n2,2,40,2\n3,3,80,4\n";  // 0.05 N/m

}  // namespace

TEST_CASE("a deflection in nm beside a force is taken away from the height of an AFM") {
  const TableReader read;
  const RecordingFile file = read(kAfmTitles + kAfmRows);
  CHECK_THAT(file.recording.drive.back(), WithinRel(3e-6 - 80e-9, 1e-12));
  CHECK_THAT(file.recording.response.back(), WithinRel(4e-9, 1e-12));
  CHECK(file.recording.response_sd.empty());
  CHECK_THAT(columns_words(file.findings),
             Contains("depth = column 2 'Height' - column 3 'Deflection', to which the force is "
                      "proportional: 0.05 N/m") &&
                 !Contains("warning"));
  // Force and deflection with noise of their own.
  std::string noisy = kAfmTitles;
  for (int i = 0; i < 60; ++i) {
    const double bent = std::max(0.0, 40.0 * (0.05 * i - 1.0));
    noisy += fmt::format("{},{},{},{}\n", i, 0.05 * i, bent + 0.06 * ((i * i * 7 + 3 * i) % 11 - 5),
                         0.06 * bent + 0.003 * ((i * i * 5 + i) % 13 - 6));
  }
  CHECK_THAT(columns_words(read(noisy).findings), Contains("proportional: 0.06 N/m"));
}

TEST_CASE("options and other deflections leave the height of an AFM as they say") {
  const TableReader read;
  const RecordingFile chosen = read(kAfmTitles + kAfmRows, with("drive", "Height"));
  CHECK_THAT(chosen.recording.drive.back(), WithinRel(3e-6, 1e-12));
  CHECK_THAT(columns_words(chosen.findings), Contains("warning: column 2 'Height'"));
  const Recording stiffer =
      read(kAfmTitles + kAfmRows, with("spring_constant", "0.1 N/m")).recording;
  CHECK_THAT(stiffer.drive.back(), WithinRel(3e-6 - 40e-9, 1e-12));

  // Volts, and two deflections, tell no depth; a column of the depth goes before.
  for (const std::string text :
       {"Time [s],Height [um],Deflection [V],Force [nN]\n0,0,0,0\n1,1,20,1\n2,2,40,2\n",
        "Time [s],Height [um],Deflection [nm],Force [nN],Lateral deflection [nm]\n"
        "0,0,0,0,1\n1,1,20,1,1\n2,2,40,2,1\n"}) {
    const RecordingFile kept = read(text);
    CHECK_THAT(kept.recording.drive.back(), WithinRel(2e-6, 1e-12));
    CHECK_THAT(columns_words(kept.findings), Contains("warning: column 2 'Height'"));
  }
  const Recording depth = read(
                              "Time [s],Height [um],Deflection [nm],Force [nN],Indentation [um]\n"
                              "0,0,0,0,0\n1,1,20,1,0.5\n2,2,40,2,1\n")
                              .recording;
  CHECK_THAT(depth.drive.back(), WithinRel(1e-6, 1e-12));
}

TEST_CASE("a deflection that the force does not follow is refused as that of an AFM") {
  const TableReader read;
  // How far a specimen bends: few samples, and many with noise.
  CHECK_THROWS_WITH(read(kAfmTitles + "0,0,0,0\n1,1,20,1\n2,2,40,2.8\n3,3,60,5.2\n4,4,80,8\n"),
                    Contains("column 3 'Deflection'") && Contains("one positive stiffness") &&
                        Contains("--drive 2 to take the height as the depth"));
  std::string many = kAfmTitles;
  for (int i = 0; i < 60; ++i) {
    const double bent = std::max(0.0, 0.05 * i - 1.0);
    many += fmt::format("{},{},{},{}\n", i, 0.05 * i, 40.0 * bent,
                        bent * std::sqrt(bent) + 0.003 * ((i * i * 5 + i) % 13 - 6));
  }
  CHECK_THROWS_WITH(read(many), Contains("one positive stiffness"));
  CHECK_THROWS_WITH(read(kAfmTitles + "0,0,0,0\n1,1,-20,1\n2,2,-40,2\n3,3,-80,4\n"),
                    Contains("one positive stiffness"));
  CHECK_THROWS_WITH(read(kAfmTitles + "0,0,0,0\n1,1,1000,1\n2,2,2000,2\n3,3,3000,3\n"),
                    Contains("grows as much as the height") && Contains("--drive 2"));
}
