#include "tpm/fit/waterfall.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "tpm/base/namespaces.hpp"

namespace tpm::fit {
namespace {

constexpr double kSameMinimum = 1e-5;  // relative above 1: one minimum

std::vector<int> clusters_of(const std::vector<double>& sorted) {
  std::vector<int> clusters;
  clusters.reserve(sorted.size());
  double first = 0.0;
  for (const double d : sorted) {
    if (clusters.empty()) {
      clusters.push_back(0);
      first = d;
      continue;
    }
    const bool same = d - first <= kSameMinimum * std::max(1.0, std::abs(first));
    clusters.push_back(same ? clusters.back() : clusters.back() + 1);
    if (!same) first = d;
  }
  return clusters;
}

std::string waterfall_words(const Waterfall& w) {
  if (w.deviances.empty())
    return fmt::format("none of {} starts ended in a usable point", w.starts);
  const int distinct = w.clusters.back() + 1;
  return fmt::format("{} of {} starts end at the best minimum; {} distinct {}, {} failed",
                     w.at_best, w.starts, distinct, distinct == 1 ? "minimum" : "minima", w.failed);
}

}  // namespace

Waterfall waterfall(std::span<const double> deviances) {
  Waterfall w;
  w.starts = static_cast<int>(deviances.size());
  std::copy_if(deviances.begin(), deviances.end(), std::back_inserter(w.deviances),
               [](double d) { return std::isfinite(d); });
  std::sort(w.deviances.begin(), w.deviances.end());
  w.failed = w.starts - static_cast<int>(w.deviances.size());
  w.clusters = clusters_of(w.deviances);
  w.at_best = static_cast<int>(std::ranges::count(w.clusters, 0));
  w.summary = waterfall_words(w);
  return w;
}

}  // namespace tpm::fit
