#include "tpm/files/import/import_jpk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <numeric>
#include <span>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/import/contact.hpp"
#include "tpm/files/import/jpk_segment.hpp"
#include "tpm/files/zip_archive.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

constexpr std::uint64_t kMostPropertyBytes = std::uint64_t{4} << 20U;
constexpr std::size_t kMostSegments = 1000;
constexpr std::size_t kMostSamples = std::size_t{1} << 24U;  // of all segments together

/// A segment as its properties state it.
struct JpkSegment {
  int number = 0;
  std::string folder;  ///< "segments/0/"
  JpkProperties properties;
  RecordedSegment what;
  double duration_s = 0.0;
};

PropertyMap properties_of(const ZipArchive& archive, const std::string& member) {
  return parse_properties(archive.read(member, kMostPropertyBytes));
}

/// A JPK archive of another kind is told apart before its segments are missed.
void require_force_curve(const ZipArchive& archive) {
  constexpr const char* kExpected = "a force curve of a JPK instrument (.jpk-force)";
  if (!archive.has("header.properties")) {
    throw bad_input(archive.file(), "is a ZIP archive without header.properties",
                    fmt::format("{}, or a table as text", kExpected));
  }
  const PropertyMap header = properties_of(archive, "header.properties");
  const auto type = header.find("type");
  const std::string kind = type == header.end() ? "of no type" : type->second;
  if (kind == "force-scan-series") return;
  throw bad_input(
      archive.file() + ": header.properties: key type", fmt::format("'{}'", printable(kind)),
      fmt::format("'force-scan-series': {}; of a map, its curves one by one", kExpected));
}

/// The number of "segments/12/segment-header.properties".
std::optional<int> segment_number(std::string_view member) {
  constexpr std::string_view kHead = "segments/";
  constexpr std::string_view kTail = "/segment-header.properties";
  if (!member.starts_with(kHead) || !member.ends_with(kTail)) return std::nullopt;
  member.remove_prefix(kHead.size());
  member.remove_suffix(std::min(kTail.size(), member.size()));
  int number = -1;
  const auto [end, fault] = std::from_chars(member.data(), member.data() + member.size(), number);
  if (fault != std::errc() || end != member.data() + member.size() || number < 0) {
    return std::nullopt;
  }
  return number;
}

std::string plain_word(const JpkProperties& properties, std::string_view key, std::string word) {
  constexpr std::size_t kLongest = 60;
  const bool plain = !word.empty() && word.size() <= kLongest &&
                     word.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") == word.npos;
  if (plain) return word;
  throw bad_input(properties.place_of(key), fmt::format("'{}'", printable(word)),
                  "a word such as extend or pause");
}

std::size_t sample_count(const JpkProperties& properties, std::string_view key) {
  const double count = properties.number(key);
  if (count >= 0.0 && count <= static_cast<double>(kMostSamples) && count == std::floor(count)) {
    return static_cast<std::size_t>(count);
  }
  throw bad_input(properties.place_of(key), fmt::format("{} samples", shortest(count)),
                  fmt::format("a whole number up to {}", kMostSamples));
}

JpkSegment read_segment(const ZipArchive& archive, int number, const PropertyMap& shared) {
  const std::string folder = fmt::format("segments/{}/", number);
  const std::string member = folder + "segment-header.properties";
  JpkSegment segment{number,
                     folder,
                     {properties_of(archive, member), shared, archive.file() + ": " + member},
                     {},
                     0.0};
  const JpkProperties& properties = segment.properties;
  const std::string head = "force-segment-header.";
  const std::string style = head + "settings.segment-settings.style";
  const std::string type = head + "settings.segment-settings.type";
  segment.what.kind = plain_word(
      properties, style, properties.find_any({style, head + "settings.style"}).value_or(""));
  if (auto control = properties.find(type)) {
    segment.what.control = plain_word(properties, type, *std::move(control));
  }
  segment.what.samples = sample_count(properties, head + "num-points");
  segment.duration_s = properties.number(head + "duration");
  if (segment.what.samples > 0 && segment.duration_s <= 0.0) {
    throw bad_input(properties.place_of(head + "duration"), "is not above 0", "seconds");
  }
  return segment;
}

/// In the order in which they were run, also those without samples.
std::vector<JpkSegment> read_jpk_segments(const ZipArchive& archive, const PropertyMap& shared) {
  std::vector<int> numbers;
  for (const std::string& name : archive.names()) {
    if (const auto number = segment_number(name)) numbers.push_back(*number);
  }
  std::sort(numbers.begin(), numbers.end());
  if (numbers.size() > kMostSegments) {
    throw bad_input(archive.file(), fmt::format("holds {} segments", numbers.size()),
                    fmt::format("at most {}", kMostSegments));
  }
  std::vector<JpkSegment> segments;
  std::size_t samples = 0;
  for (const int number : numbers) {
    JpkSegment segment = read_segment(archive, number, shared);
    samples += segment.what.samples;
    if (samples > kMostSamples) {
      throw bad_input(archive.file(), "holds too many samples",
                      fmt::format("at most {} in all segments", kMostSamples));
    }
    segments.push_back(std::move(segment));
  }
  if (samples == 0) throw bad_input(archive.file(), "no segment has samples", "a force curve");
  return segments;
}

std::vector<RecordedSegment> recorded(const std::vector<JpkSegment>& segments) {
  std::vector<RecordedSegment> words;
  words.reserve(segments.size());
  for (const JpkSegment& segment : segments) words.push_back(segment.what);
  return words;
}

/// A history with a hole in it is none: between two segments no other is missing, and none without
/// samples takes time.
void require_no_hole(std::span<const JpkSegment> segments, const std::string& file,
                     const std::string& all) {
  const auto refuse = [&](const std::string& what) {
    return bad_input(file, what,
                     fmt::format("--segments on one side of it, of {}", printable(all, 200)));
  };
  for (std::size_t i = 1; i < segments.size(); ++i) {
    const int expected = segments[i - 1].number + 1;
    if (segments[i].number == expected) continue;
    throw refuse(fmt::format("segment {} is not in the archive", expected));
  }
  for (const JpkSegment& segment : segments) {
    if (segment.what.samples > 0 || segment.duration_s == 0.0) continue;
    throw refuse(fmt::format("segment {} ({}, {} s) has no samples", segment.number,
                             segment.what.kind, significant(segment.duration_s, 4)));
  }
}

/// Those of the wanted kinds that have samples; none wanted: all. They have to follow each other,
/// and all of them begin with the first.
std::vector<JpkSegment> chosen_segments(std::vector<JpkSegment> segments, const std::string& file,
                                        const std::vector<std::string>& kinds) {
  const std::string all = segments_words(recorded(segments));
  for (const std::string& kind : kinds) {
    const bool known = std::any_of(segments.begin(), segments.end(), [&kind](const auto& s) {
      return s.what.kind == kind && s.what.samples > 0;
    });
    if (!known) {
      throw bad_input(file, fmt::format("has no segment '{}'", printable(kind)),
                      fmt::format("--segments of {}", printable(all, 200)));
    }
  }
  if (kinds.empty() && segments.front().number != 0) {
    throw bad_input(file, "segment 0 is not in the archive: the approach is missing",
                    fmt::format("a whole file, or --segments of {}", printable(all, 200)));
  }
  const auto wanted = [&kinds](const JpkSegment& segment) {
    return segment.what.samples > 0 &&
           (kinds.empty() ||
            std::find(kinds.begin(), kinds.end(), segment.what.kind) != kinds.end());
  };
  const auto first =
      kinds.empty() ? segments.begin() : std::find_if(segments.begin(), segments.end(), wanted);
  const auto last = std::find_if(segments.rbegin(), segments.rend(), wanted).base();
  const auto other = std::find_if(first, last, [&](const JpkSegment& segment) {
    return segment.what.samples > 0 && !wanted(segment);
  });
  if (other != last) {
    throw bad_input(file, "the chosen segments do not follow each other",
                    fmt::format("--segments without a gap in {}", printable(all, 200)));
  }
  require_no_hole({first, last}, file, all);
  std::vector<JpkSegment> chosen;
  std::copy_if(std::make_move_iterator(first), std::make_move_iterator(last),
               std::back_inserter(chosen), wanted);
  return chosen;
}

bool all_have(const std::vector<JpkSegment>& segments, const std::string& channel) {
  return std::all_of(segments.begin(), segments.end(), [&channel](const JpkSegment& segment) {
    return has_jpk_channel(segment.properties, channel);
  });
}

std::string height_channel(const std::vector<JpkSegment>& segments, const std::string& file,
                           const std::string& wanted) {
  if (!wanted.empty() && all_have(segments, wanted)) return wanted;
  constexpr std::array kHeights{"measuredHeight", "capacitiveSensorHeight", "strainGaugeHeight",
                                "height"};
  if (wanted.empty()) {
    for (const char* channel : kHeights) {
      if (all_have(segments, channel)) return channel;
    }
  }
  throw bad_input(file,
                  wanted.empty()
                      ? std::string("no height is in all segments")
                      : fmt::format("no channel '{}' in all segments", printable(wanted)),
                  fmt::format("one of {}", fmt::join(kHeights, ", ")));
}

/// Heights and deflections of one segment, and how they became forces.
struct TipMotion {
  std::vector<double> height_m;
  std::vector<double> deflection_m;
  double spring_constant_N_per_m = 0.0;
  double sensitivity = 0.0;                    ///< m per unit of the stored signal, usually V
  std::optional<double> file_spring_constant;  ///< N/m
  std::optional<double> baseline;              ///< of the stored signal, subtracted
};

JpkConversion calibrated(const JpkSegment& segment, const std::string& channel,
                         const std::string& file) {
  if (const auto found = find_jpk_conversion(segment.properties, channel, "m")) return *found;
  throw bad_input(fmt::format("{}: {}", file, segment.folder),
                  fmt::format("the channel '{}' is not calibrated in metres", printable(channel)),
                  "a curve saved after calibration");
}

void find_spring_constant(TipMotion& motion, const JpkSegment& segment, const std::string& channel,
                          const std::string& file, const ImportOptions& options) {
  if (const auto force = find_jpk_conversion(segment.properties, channel, "N")) {
    motion.file_spring_constant = force->multiplier / motion.sensitivity;
  }
  const auto known = options.spring_constant_N_per_m ? options.spring_constant_N_per_m
                                                     : motion.file_spring_constant;
  if (!known) {
    throw bad_input(file, "does not say the spring constant of the cantilever",
                    "--spring-constant, such as \"0.05 N/m\"");
  }
  if (!(*known > 0.0) || !std::isfinite(*known)) {
    throw bad_input(file, fmt::format("a spring constant of {} N/m", shortest(*known)),
                    "above 0, or another --spring-constant");
  }
  motion.spring_constant_N_per_m = *known;
}

std::optional<double> measured_baseline(const JpkProperties& properties) {
  const std::string block = "force-segment-header.baseline.";
  if (properties.find(block + "measured") != "true") return std::nullopt;
  return properties.number(block + "baseline");
}

TipMotion read_motion(const ZipArchive& archive, const JpkSegment& segment,
                      const std::string& height, const std::string& deflection,
                      const ImportOptions& options) {
  const auto channel = [&](const std::string& name) {
    return read_jpk_channel(archive, segment.folder, segment.properties, name,
                            segment.what.samples);
  };
  TipMotion motion;
  const JpkConversion to_height = calibrated(segment, height, archive.file());
  motion.height_m = channel(height);
  for (double& value : motion.height_m) value = to_height(value);
  JpkConversion to_deflection = calibrated(segment, deflection, archive.file());
  motion.sensitivity = to_deflection.multiplier;
  motion.baseline = measured_baseline(segment.properties);
  if (motion.baseline) to_deflection.offset = -to_deflection.multiplier * *motion.baseline;
  motion.deflection_m = channel(deflection);
  for (double& value : motion.deflection_m) value = to_deflection(value);
  find_spring_constant(motion, segment, deflection, archive.file(), options);
  return motion;
}

ImportedColumn computed_column(Quantity quantity, const char* unit, const std::string& file) {
  ImportedColumn column;
  column.quantity = quantity;
  column.unit = parse_unit(unit, quantity_dimension(quantity), file);
  column.shifted = true;  // computed: not the digits of the file
  return column;
}

/// Time, depth and force of all segments, in s, um and nN.
class JpkSeries {
 public:
  JpkSeries(const std::string& file, const ImportOptions& options)
      : time_(computed_column(Quantity::time, "s", file)),
        depth_(computed_column(Quantity::indentation_depth, "um", file)),
        force_(computed_column(Quantity::contact_force, "nN", file)),
        depth_sign_((options.negate_drive ? -1.0 : 1.0) / depth_.unit.to_si),
        force_sign_((options.negate_response ? -1.0 : 1.0) / force_.unit.to_si) {}

  void add(const JpkSegment& segment, const TipMotion& motion) {
    const double step_s = segment.duration_s / static_cast<double>(segment.what.samples);
    for (std::size_t i = 0; i < segment.what.samples; ++i) {
      const double tip_m = motion.height_m[i] + motion.deflection_m[i];
      if (depth_.values.empty()) first_tip_m_ = tip_m;
      time_.values.push_back(start_s_ + static_cast<double>(i) * step_s);
      depth_.values.push_back(depth_sign_ * (first_tip_m_ - tip_m));
      force_.values.push_back(force_sign_ * motion.spring_constant_N_per_m *
                              motion.deflection_m[i]);
    }
    start_s_ += segment.duration_s;
  }

  [[nodiscard]] std::vector<ImportedColumn> take() {
    return {std::move(time_), std::move(depth_), std::move(force_)};
  }

 private:
  ImportedColumn time_, depth_, force_;
  double depth_sign_, force_sign_;
  double first_tip_m_ = 0.0;
  double start_s_ = 0.0;
};

/// Refuses options for other files, and those that a JPK file states itself.
void require_jpk_options(const ImportOptions& options, const std::string& file) {
  const bool columns = !options.time_column.empty() || !options.sd_column.empty() ||
                       !options.frequency_column.empty() || !options.storage_column.empty() ||
                       !options.loss_column.empty() || options.drive_quantity ||
                       options.response_quantity || !options.units.empty() || options.header_rows ||
                       options.rest_length_m || options.area_m2 ||
                       options.deflection_sensitivity_m_per_V;
  if (columns || options.x || options.y || options.depth_m || options.load_N) {
    throw bad_input(file, "a JPK force file says itself what its channels are",
                    "only --drive and --response with the names of channels, --negate-drive, "
                    "--negate-response, "
                    "--spring-constant, --segments and --contact-force");
  }
}

std::string baseline_words(const TipMotion& motion) {
  if (!motion.baseline) return "zero of the force as in the file";
  return fmt::format("baseline {} V subtracted", significant(*motion.baseline, 6));
}

std::string force_words(const TipMotion& motion, const std::string& channel) {
  const bool given = motion.spring_constant_N_per_m != motion.file_spring_constant;
  std::string spring = significant(motion.spring_constant_N_per_m, 6) + " N/m";
  if (given) {
    spring += motion.file_spring_constant
                  ? fmt::format(" (given; {} N/m in the file)",
                                significant(*motion.file_spring_constant, 6))
                  : std::string(" (given)");
  }
  return fmt::format("channel {}, spring constant {}, sensitivity {} nm/V, {}", printable(channel),
                     spring, significant(motion.sensitivity * 1e9, 6), baseline_words(motion));
}

}  // namespace

ImportedSeries read_jpk(std::string_view bytes, const std::string& file,
                        const ImportOptions& options) {
  require_jpk_options(options, file);
  const ZipArchive archive(bytes, file);
  require_force_curve(archive);
  constexpr const char* kShared = "shared-data/header.properties";
  const PropertyMap shared = archive.has(kShared) ? properties_of(archive, kShared) : PropertyMap{};
  const std::vector<JpkSegment> segments =
      chosen_segments(read_jpk_segments(archive, shared), file, options.segments);
  const std::string height = height_channel(segments, file, options.drive_column);
  const std::string deflection =
      options.response_column.empty() ? "vDeflection" : options.response_column;
  if (!all_have(segments, deflection)) {
    throw bad_input(file, fmt::format("no channel '{}' in all segments", printable(deflection)),
                    "the vertical deflection, vDeflection");
  }
  JpkSeries columns(file, options);
  std::string force;
  for (const JpkSegment& segment : segments) {
    const TipMotion motion = read_motion(archive, segment, height, deflection, options);
    if (force.empty()) force = force_words(motion, deflection);
    columns.add(segment, motion);
  }
  ImportedSeries series;
  series.columns = columns.take();
  series.segments = recorded(segments);
  series.lines.resize(series.columns.front().values.size());
  std::iota(series.lines.begin(), series.lines.end(), 1);
  const std::string depth =
      fmt::format("channel {} and the deflection: tip position", printable(height));
  series.findings = {{"segments", segments_words(series.segments)},
                     ImportFinding::told_of("indentation_depth", depth),
                     ImportFinding::told_of("contact_force", force)};
  if (const auto stamp = segments.front().properties.find("force-segment-header.time-stamp")) {
    series.findings.push_back({"recorded", printable(*stamp)});
  }
  if (!options.header.probe.diameter_m) {
    series.findings.push_back({"tip", "its shape and radius are not in the file"});
  }
  series.note = fmt::format("depth: {}; force: {}", depth, force);
  start_at_contact(series, file, options);
  return series;
}

}  // namespace tpm::files
