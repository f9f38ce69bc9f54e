#pragma once
// ZIP archives and small JPK force curves, sound or not, for tests of what is refused.
#include <minizip/zip.h>

#include <array>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "temp_folder.hpp"

namespace tpm::test {

using ZipMembers = std::vector<std::pair<std::string, std::string>>;

/// The bytes of an archive. A name may stand twice.
inline std::string zipped(const ZipMembers& members, int method = Z_DEFLATED) {
  const TempFolder folder;
  const std::string path = folder / "archive.zip";
  zipFile archive = zipOpen(path.c_str(), APPEND_STATUS_CREATE);
  if (archive == nullptr) throw std::runtime_error("cannot write " + path);
  for (const auto& [name, bytes] : members) {
    const zip_fileinfo info{};
    zipOpenNewFileInZip(archive, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, method,
                        Z_DEFAULT_COMPRESSION);
    zipWriteInFileInZip(archive, bytes.data(), static_cast<unsigned>(bytes.size()));
    zipCloseFileInZip(archive);
  }
  zipClose(archive, nullptr);
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// One segment of four samples: heights of 4, 3, 2, 1 um and deflections of 0, 0, 1, 2 um, in
/// metres as the encoder leaves them, with a spring constant of 0.5 N/m. `number` is that of the
/// segment.
inline ZipMembers jpk_segment(const std::string& kind = "extend", int number = 0) {
  const std::string folder = "segments/" + std::to_string(number) + "/";
  std::string text = "force-segment-header.settings.style=" + kind +
                     "\nforce-segment-header.num-points=4\nforce-segment-header.duration=2\n";
  for (const std::string channel : {"height", "vDeflection"}) {
    const std::string at = "channel." + channel + ".";
    text += at + "data.file.name=channels/" + channel + ".dat\n" + at +
            "data.encoder.type=signedshort\n" + at + "data.encoder.scaling.offset=0\n" + at +
            "data.encoder.scaling.multiplier=1e-6\n" + at +
            "conversion-set.conversions.base=volts\n" + at +
            "conversion-set.conversions.list=distance force\n" + at +
            "conversion-set.conversions.default=distance\n";
    for (const auto& [slot, base, multiplier, unit] :
         {std::array{"distance", "volts", "1", "m"}, {"force", "distance", "0.5", "N"}}) {
      const std::string block = at + "conversion-set.conversion." + slot + ".";
      text += block + "defined=true\n" + block + "base-calibration-slot=" + base + "\n" + block +
              "scaling.offset=0\n" + block + "scaling.multiplier=" + multiplier + "\n" + block +
              "scaling.unit.unit=" + unit + "\n";
    }
  }
  return {{folder + "segment-header.properties", text},
          {folder + "channels/height.dat", std::string("\0\4\0\3\0\2\0\1", 8)},
          {folder + "channels/vDeflection.dat", std::string("\0\0\0\0\0\1\0\2", 8)}};
}

inline ZipMembers jpk_curve(const std::vector<std::string>& kinds = {"extend"}) {
  ZipMembers members{{"header.properties", "type=force-scan-series\n"}};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    for (auto& member : jpk_segment(kinds[i], static_cast<int>(i))) members.push_back(member);
  }
  return members;
}

/// The curve with something else in the member that holds `from`.
inline ZipMembers with_replaced(ZipMembers members, const std::string& from,
                                const std::string& to) {
  for (auto& [name, bytes] : members) {
    const auto at = bytes.find(from);
    if (at == std::string::npos) continue;
    bytes.replace(at, from.size(), to);
    return members;
  }
  throw std::logic_error("nothing to replace: " + from);
}

}  // namespace tpm::test
