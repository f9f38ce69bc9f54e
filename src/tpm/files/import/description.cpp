#include "tpm/files/import/description.hpp"

#include <fmt/format.h>

#include <array>
#include <iterator>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/data/curve_words.hpp"
#include "tpm/files/keys/block.hpp"
#include "tpm/files/keys/more_types.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

constexpr auto kBounds = std::to_array<Word<Bound>>(
    {{Bound::value, "value"}, {Bound::lower, "lower"}, {Bound::upper, "upper"}, {Bound::sd, "sd"}});

ValueType<Provenance> provenance_word() {
  return word(kProvenances).named("provenance", "where a number comes from");
}

/// A header such as force_mN must not be described as newtons.
void require_unit_of_name(const std::string& name, const Unit& unit, const std::string& where) {
  const auto cut = name.rfind('_');
  if (cut == std::string::npos || !is_unit(name.substr(cut + 1))) return;
  const Unit named = parse_unit(name.substr(cut + 1), where);
  if (named.symbol == unit.symbol) return;
  throw bad_input(where,
                  fmt::format("unit '{}' but the column is named in {}", unit.symbol, named.symbol),
                  "the same unit in both");
}

const Block<ProbeShape>& probe_block() {
  using P = ProbeShape;
  static const Block<P> block(
      "probe", "the indenter",
      {key("shape", &P::shape, one_of({"hemisphere", "sphere", "flat punch", "cone"}),
           "the shape of the tip; left out if it is not known"),
       key("diameter", &P::diameter_m, quantity(Dimension::length, kAboveZero), "its diameter"),
       key("provenance", &P::provenance, provenance_word(), "where shape and diameter come from")});
  return block;
}

/// Not written where nothing is known.
ValueType<ProbeShape> probe_type() {
  ValueType<ProbeShape> type = probe_block().type();
  type.write = [write = type.write](const ProbeShape& probe) {
    Json json = write(probe);
    return json.empty() ? Json() : json;
  };
  return type;
}

struct ColumnKeys {
  Quantity quantity = Quantity::ordinate;
  std::string unit;
  Bound bound = Bound::value;
  std::optional<Provenance> provenance;
  std::string note;
};

const Block<ColumnKeys>& column_block() {
  using K = ColumnKeys;
  static const Block<K> block(
      "column", "one numeric column",
      {required(key("quantity", &K::quantity,
                    word(kQuantities).named("quantity", "a physical quantity"),
                    "what the column holds")),
       key("unit", &K::unit, text_if_any(), "of its numbers; left out for plain numbers"),
       key("bound", &K::bound, word(kBounds),
           "the value, the lower or upper end of a band, or a standard deviation"),
       key("provenance", &K::provenance, provenance_word(),
           "where the numbers of this column come from, if it differs from the row's"),
       key("note", &K::note, text_if_any(), "what a reader has to know about this column")});
  return block;
}

ValueType<ColumnDescription> column_type() {
  return converted<ColumnDescription>(
      column_block().type(),
      [](ColumnKeys keys, const DocumentPlace& place) {
        return ColumnDescription{
            keys.quantity, parse_unit(keys.unit, quantity_dimension(keys.quantity), place.where),
            keys.bound, keys.provenance, std::move(keys.note)};
      },
      [](const ColumnDescription& column) {
        return ColumnKeys{column.quantity, std::string(column.unit.symbol), column.bound,
                          column.provenance, column.note};
      });
}

using Columns = std::map<std::string, ColumnDescription>;

ValueType<Columns> columns_type(std::size_t fewest) {
  using Pairs = std::vector<std::pair<std::string, ColumnDescription>>;
  return converted<Columns>(
      map_of(column_type(), fewest),
      [](const Pairs& pairs, const DocumentPlace& place) {
        for (const auto& [name, column] : pairs) {
          require_unit_of_name(name, column.unit, place.key(name).where);
        }
        return Columns(pairs.begin(), pairs.end());
      },
      [](const Columns& columns) { return Pairs(columns.begin(), columns.end()); });
}

const Block<RecordedSegment>& segment_block() {
  using S = RecordedSegment;
  const auto instruments_word = text_like(
      "^[a-z0-9-]{1,60}$", "a word of the instrument: small letters, digits and hyphens", "extend");
  static const Block<S> block(
      "segment", "a part that the instrument ran as one",
      {required(key("kind", &S::kind, instruments_word,
                    "the instrument's word: extend, pause, retract")),
       key("control", &S::control, instruments_word,
           "how it was run, such as constant-height-pause"),
       required(key("samples", &S::samples, whole<std::size_t>(1, 1e15), "how many rows"))});
  return block;
}

/// The sentence of each key of the block "instrument", which read_instrument() reads.
struct InstrumentKeys {
  std::string id, force, depth, time, zero, resolution, noise, force_range, depth_range;
  std::string probe, probe_radius, radius;
};

const Block<InstrumentKeys>& instrument_block() {
  using K = InstrumentKeys;
  static const Block<K> block(
      "instrument",
      "how well the instrument knows what it records: limits such as '0.5 % of reading', '0.1 % of "
      "range' or '10 um', with '(standard)' behind a standard uncertainty",
      {required(key("id", &K::id, text(1), "equal in two recordings: their errors are the same")),
       key("force", &K::force, text(), "of the response"),
       key("depth", &K::depth, text(), "of the drive"),
       key("time", &K::time, text(), "between the channels"),
       key("zero", &K::zero, text(),
           "of the response before contact, where nothing was recorded there"),
       key("resolution", &K::resolution, text(),
           "step of the readings of the response, such as '0.1 mN'"),
       key("noise", &K::noise, text(),
           "standard deviation of a reading of the response, such as '0.2 mN'"),
       key("force_range", &K::force_range, text(),
           "of the response, for a share of it, such as '10 N'"),
       key("depth_range", &K::depth_range, text(), "of the drive, for a share of it"),
       key("probe", &K::probe, text(),
           "name of the tip; equal in two recordings: it is the same one (left out: the "
           "instrument's own)"),
       key("probe_radius", &K::probe_radius, text(),
           "radius of a spherical or flat tip, such as '2 mm'"),
       key("radius", &K::radius, text(), "of that radius, such as '10 um' or '0.5 % of radius'")});
  return block;
}

using CurveKey = Key<CurveDescription>;

std::vector<CurveKey> keys_of_all() {
  using D = CurveDescription;
  using H = CurveHeader;
  const auto said = [](Key<H> declared) { return within(&D::header, declared); };
  return {required(said(key("id", &H::id, text(1), "the file name without its ending"))),
          required(said(key("title", &H::title, text(1), "one line that says what the curve is"))),
          said(key("citation", &H::citation, text_if_any(), "authors, journal, year, pages")),
          said(key("doi", &H::doi,
                   text_like("^10\\.", "a bare DOI, without https://doi.org/", "10.1000/182"),
                   "of the publication")),
          said(key("specimen", &H::specimen, text_if_any(), "what was tested and in what state")),
          said(key("probe", &H::probe, probe_type(), "the indenter")),
          said(key("note", &H::note, text_if_any(), "what a reader has to know about the curve"))};
}

/// Those of all kinds and some more.
std::vector<CurveKey> keys_with(std::vector<CurveKey> more) {
  std::vector<CurveKey> keys = keys_of_all();
  std::move(more.begin(), more.end(), std::back_inserter(keys));
  return keys;
}

const Kinds<CurveDescription, std::string>& curve_kinds() {
  using D = CurveDescription;
  const auto observable = required(
      key("observable", &D::observable, word(kQuantities).named("quantity", "a physical quantity"),
          "the quantity that was observed and that a model has to answer"));
  const auto columns = required(
      with_example(key("columns", &D::columns, columns_type(1),
                       "each numeric column of the CSV file by its header; the text columns label, "
                       "provenance, where and note need no description"),
                   {{"time_s", {{"quantity", "time"}, {"unit", "s"}}}}));
  const auto whole_provenance = required(
      key("provenance", &D::provenance, provenance_word(), "where the whole of it comes from"));
  const auto instrument = key("instrument", &D::instrument, as_json(instrument_block().form()),
                              "how well the instrument knows what it records");
  static const Kinds<D, std::string> kinds(
      {"curve", ""}, &D::kind,
      {{"points", "points", "readings of separate experiments",
        keys_with(
            {observable,
             key("time_origin", &D::time_origin, word(kTimeOrigins), "what the times count from"),
             columns, instrument})},
       {"recording", "recording", "samples of one experiment",
        keys_with({observable, whole_provenance, columns,
                   key("segments", &D::segments, list(segment_block().type(), {.fewest = 1}),
                       "the parts that the instrument ran one after the other; together they hold "
                       "all samples"),
                   instrument})},
       {"spectrum", "spectrum", "storage and loss over frequency",
        keys_with({whole_provenance, columns, instrument})},
       {"values", "values", "single numbers, whose columns are fixed", keys_of_all()}});
  return kinds;
}

}  // namespace

std::string_view bound_name(Bound bound) noexcept {
  return entry_of(kBounds, bound).text;
}

std::string segments_words(const std::vector<RecordedSegment>& segments) {
  std::string words;
  for (const RecordedSegment& segment : segments) {
    words += fmt::format("{}{} ({} samples{}{})", words.empty() ? "" : ", ", segment.kind,
                         segment.samples, segment.control.empty() ? "" : ", ", segment.control);
  }
  return words;
}

const FileKind& curve_kind() {
  static const FileKind kind{
      "curve", "Description of a curve file",
      "Stands beside a CSV file of the same name and says what its columns mean and where its "
      "numbers come from",
      curve_kinds().form()};
  return kind;
}

CurveDescription read_description(const std::filesystem::path& path) {
  const std::string file = path.string();
  const DocumentPlace place{file};
  CurveDescription description =
      curve_kinds().made(checked(read_json(path), curve_kind(), file), place);
  if (const std::string& id = description.header.id; id != path.stem().string()) {
    throw bad_input(place.key("id").where,
                    fmt::format("'{}' is not the file's name", printable(id)),
                    fmt::format("'{}'", path.stem().string()));
  }
  return description;
}

Json description_json(const CurveDescription& description) {
  return curve_kinds().write(description);
}

}  // namespace tpm::files
