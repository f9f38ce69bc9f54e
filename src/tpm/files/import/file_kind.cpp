#include "tpm/files/import/file_kind.hpp"

#include <algorithm>
#include <array>

namespace tpm::files {
namespace {

constexpr const char* kAsText = "the samples exported as CSV or text";
constexpr const char* kSheet = "the sheet saved as CSV or text";

struct KindMark {
  std::string_view bytes;
  const char* what;
  const char* expected;
};

constexpr auto kFirstBytes = std::to_array<KindMark>({
    {"\xD0\xCF\x11\xE0", "is an Excel workbook of the old kind (.xls)", kSheet},
    {"\x89HDF", "is an HDF5 file", kAsText},
    {"%PDF", "is a PDF", kAsText},
    {"\x1F\x8B", "is a compressed file (gzip)", "the file unpacked"},
    {"BZh", "is a compressed file (bzip2)", "the file unpacked"},
    {"7z\xBC\xAF", "is an archive (7z)", "the file unpacked"},
    {"\x93NUMPY", "is an array of NumPy (.npy)", "the array saved as text (numpy.savetxt)"},
    {"MATLAB 5.0 MAT-file", "is a file of MATLAB (.mat)",
     "the variables saved as text (writetable)"},
    {"\x89PNG", "is a picture", "the figure digitised (WebPlotDigitizer, Engauge)"},
    {"\xFF\xD8\xFF", "is a picture", "the figure digitised (WebPlotDigitizer, Engauge)"},
    {"TPMROWS1", "is the recording of a session (.tpmrec)",
     "tpm hil verify or tpm hil export with it"},
    {"<?xml", "is an XML document", kAsText},
    {"<!DOCTYPE html", "is a web page", kAsText},
    {"<html", "is a web page", kAsText},
});

constexpr auto kZipContents = std::to_array<KindMark>({
    {"xl/workbook", "is an Excel workbook (.xlsx)", kSheet},
    {"word/document", "is a Word document (.docx)", kAsText},
    {"opendocument.spreadsheet", "is a spreadsheet (.ods)", kSheet},
});

constexpr auto kEndings = std::to_array<KindMark>({
    {".yaml", "is a YAML document", "a table of samples, or a configuration in JSON"},
    {".yml", "is a YAML document", "a table of samples, or a configuration in JSON"},
    {".ibw", "is a wave of Igor (.ibw)", "the waves exported as delimited text"},
    {".pxp", "is an experiment of Igor (.pxp)", "the waves exported as delimited text"},
    {".toml", "is a TOML document", "a table of samples, or a configuration in JSON"},
    {".tdms", "is a file of LabVIEW (.tdms)", kAsText},
    {".spm", "is a file of a NanoScope", "the force curve exported as text"},
});

std::string lower_case(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return lower;
}

}  // namespace

std::optional<OtherKind> find_other_kind(std::string_view bytes, std::string_view path) {
  for (const KindMark& mark : kFirstBytes) {
    if (bytes.starts_with(mark.bytes)) return OtherKind{mark.what, mark.expected};
  }
  if (bytes.starts_with("PK")) {
    for (const KindMark& mark : kZipContents) {
      if (bytes.find(mark.bytes) != std::string_view::npos) {
        return OtherKind{mark.what, mark.expected};
      }
    }
  }
  const std::string name = lower_case(path);
  for (const KindMark& mark : kEndings) {
    if (name.ends_with(mark.bytes)) return OtherKind{mark.what, mark.expected};
  }
  return std::nullopt;
}

std::optional<OtherKind> find_other_document(const Json& document) {
  if (!document.is_object()) return std::nullopt;
  const auto has = [&document](const char* key) { return document.contains(key); };
  if (has("data") || has("measurement_file")) return std::nullopt;
  if (has("law") && has("parameters") && has("provenance")) {
    return OtherKind{"is a law, which tpm fit writes", "a recording, or tpm predict with this law"};
  }
  if (has("organ")) {
    return OtherKind{"is a scene", "a recording, or tpm simulate with this scene"};
  }
  if (has("protocol")) {
    return OtherKind{"is a protocol", "a recording, or tpm predict LAW with this protocol"};
  }
  const bool session = has("model") && !has("parameters") &&
                       (has("rate") || has("indentations") || has("slides") || has("motion") ||
                        has("push") || has("limits"));
  if (session) return OtherKind{"is a session", "a recording, or tpm hil run with this session"};
  return std::nullopt;
}

}  // namespace tpm::files
