#include "tpm/fit/sample_digest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/fitted_law.hpp"

namespace tpm::fit {
namespace {

constexpr const char* kDigest = "samples_sha256";

}  // namespace

std::string samples_sha256(std::span<const double> time_s, std::span<const double> drive,
                           std::span<const double> response) {
  std::string text;
  constexpr std::size_t kBytesOfSample = 50;
  text.reserve(kBytesOfSample * response.size());
  const auto put = [&text](std::span<const double> column, std::size_t i) {
    // Adding 0 makes -0 a 0.
    if (i < column.size()) fmt::format_to(std::back_inserter(text), "{:.8e},", column[i] + 0.0);
  };
  for (std::size_t i = 0; i < response.size(); ++i) {
    put(time_s, i);
    put(drive, i);
    put(response, i);
    text += '\n';
  }
  return sha256_hex(text);
}

std::string samples_sha256(const Recording& r) {
  return samples_sha256(r.time_s, r.drive, r.response);
}

Json law_document(const FitResult& fit) {
  std::vector<std::string> digests(fit.config.data.size());
  for (const RecordingFit& r : fit.recordings) {
    digests.at(r.choice) = samples_sha256(r.time_s, r.drive, r.observed);
  }
  return with_sample_digests(files::to_json(fitted_law(fit)), digests);
}

Json with_sample_digests(Json law, const std::vector<std::string>& digests) {
  const Json::json_pointer place("/fit/data");
  if (!law.contains(place)) return law;
  Json& data = law.at(place);
  for (std::size_t i = 0; i < std::min(data.size(), digests.size()); ++i) {
    if (!digests[i].empty()) data[i][kDigest] = digests[i];
  }
  return law;
}

std::vector<std::string> sample_digests(const Json& law) {
  std::vector<std::string> digests;
  const Json::json_pointer place("/fit/data");
  if (!law.contains(place)) return digests;
  for (const Json& file : law.at(place)) digests.push_back(file.value(kDigest, ""));
  return digests;
}

}  // namespace tpm::fit
