#include "tpm/files/zip_archive.hpp"

#include <fmt/format.h>
#include <minizip/unzip.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

/// Bytes that minizip reads in place of a file.
struct MemoryStream {
  std::string_view bytes;
  std::uint64_t at = 0;
};

MemoryStream& stream_of(voidpf stream) {
  return *static_cast<MemoryStream*>(stream);
}

voidpf open_stream(voidpf opaque, const void* /*name*/, int /*mode*/) {
  return opaque;
}

uLong read_stream(voidpf /*opaque*/, voidpf stream, void* buffer, uLong size) {
  MemoryStream& memory = stream_of(stream);
  const uLong count = std::min<uLong>(size, memory.bytes.size() - memory.at);
  std::memcpy(buffer, memory.bytes.data() + memory.at, count);
  memory.at += count;
  return count;
}

uLong write_stream(voidpf /*opaque*/, voidpf /*stream*/, const void* /*buffer*/, uLong /*size*/) {
  return 0;  // archives are only read
}

ZPOS64_T tell_stream(voidpf /*opaque*/, voidpf stream) {
  return stream_of(stream).at;
}

long seek_stream(voidpf /*opaque*/, voidpf stream, ZPOS64_T offset, int origin) {
  MemoryStream& memory = stream_of(stream);
  const std::uint64_t size = memory.bytes.size();
  std::uint64_t from = 0;
  if (origin == ZLIB_FILEFUNC_SEEK_CUR) from = memory.at;
  if (origin == ZLIB_FILEFUNC_SEEK_END) from = size;
  if (offset > size - from) return -1;
  memory.at = from + offset;
  return 0;
}

int close_stream(voidpf /*opaque*/, voidpf /*stream*/) {
  return 0;
}

int stream_error(voidpf /*opaque*/, voidpf /*stream*/) {
  return 0;
}

using Handle = std::unique_ptr<void, decltype(&unzClose)>;

/// Null if the bytes have no directory of an archive at their end.
Handle open_archive(MemoryStream& stream) {
  zlib_filefunc64_def functions{};
  functions.zopen64_file = open_stream;
  functions.zread_file = read_stream;
  functions.zwrite_file = write_stream;
  functions.ztell64_file = tell_stream;
  functions.zseek64_file = seek_stream;
  functions.zclose_file = close_stream;
  functions.zerror_file = stream_error;
  functions.opaque = &stream;
  return {unzOpen2_64("", &functions), unzClose};
}

Error damaged(const std::string& place) {
  return bad_input(place, "the ZIP archive is damaged", "the file as the instrument wrote it");
}

constexpr std::size_t kLongestEntryName = 1024;

/// Unpacks the current member, whose size was checked.
std::string unpacked(unzFile archive, std::uint64_t size, const std::string& place) {
  if (unzOpenCurrentFile(archive) != UNZ_OK) throw damaged(place);
  std::string bytes(size, '\0');
  std::uint64_t done = 0;
  while (done < size) {
    constexpr std::uint64_t kPiece = std::uint64_t{1} << 20U;
    const auto piece = static_cast<unsigned>(std::min(kPiece, size - done));
    const int count = unzReadCurrentFile(archive, bytes.data() + done, piece);
    if (count <= 0) break;
    done += static_cast<std::uint64_t>(count);
  }
  // Closing compares the check sum.
  const bool sound = unzCloseCurrentFile(archive) == UNZ_OK;
  if (done != size || !sound) throw damaged(place);
  return bytes;
}

}  // namespace

bool looks_like_zip(std::string_view bytes) noexcept {
  return bytes.starts_with("PK\x03\x04");
}

ZipArchive::ZipArchive(std::string_view bytes, std::string file)
    : bytes_(bytes), file_(std::move(file)) {
  MemoryStream stream{bytes_};
  const Handle archive = open_archive(stream);
  if (archive == nullptr) throw damaged(file_);
  int state = unzGoToFirstFile(archive.get());
  for (; state == UNZ_OK; state = unzGoToNextFile(archive.get())) {
    unz_file_info64 info{};
    std::array<char, kLongestEntryName + 1> name{};
    unz64_file_pos place{};
    if (unzGetCurrentFileInfo64(archive.get(), &info, name.data(), kLongestEntryName, nullptr, 0,
                                nullptr, 0) != UNZ_OK ||
        info.size_filename > kLongestEntryName ||
        unzGetFilePos64(archive.get(), &place) != UNZ_OK) {
      throw damaged(file_);
    }
    std::string text(name.data(), info.size_filename);
    if (text.empty() || text.back() == '/') continue;
    members_.push_back({std::move(text), place.pos_in_zip_directory, place.num_of_file});
  }
  if (state != UNZ_END_OF_LIST_OF_FILE) throw damaged(file_);
  std::ranges::sort(members_, {}, &Member::name);
  const auto twice = std::ranges::adjacent_find(members_, {}, &Member::name);
  if (twice == members_.end()) return;
  throw bad_input(file_, fmt::format("holds '{}' twice", printable(twice->name)),
                  "an archive in which each name stands once");
}

std::vector<std::string> ZipArchive::names() const {
  std::vector<std::string> names;
  names.reserve(members_.size());
  for (const Member& member : members_) names.push_back(member.name);
  return names;
}

const ZipArchive::Member* ZipArchive::find(std::string_view name) const {
  const auto found = std::ranges::lower_bound(members_, name, {}, &Member::name);
  return found != members_.end() && found->name == name ? &*found : nullptr;
}

bool ZipArchive::has(std::string_view name) const {
  return find(name) != nullptr;
}

std::string ZipArchive::read(std::string_view name, std::uint64_t most) const {
  const std::string place = fmt::format("{}: {}", file_, printable(name));
  const Member* member = find(name);
  if (member == nullptr) throw bad_input(place, "is not in the archive", "a complete file");
  MemoryStream stream{bytes_};
  const Handle archive = open_archive(stream);
  const unz64_file_pos position{member->place, member->number};
  unz_file_info64 info{};
  if (archive == nullptr || unzGoToFilePos64(archive.get(), &position) != UNZ_OK ||
      unzGetCurrentFileInfo64(archive.get(), &info, nullptr, 0, nullptr, 0, nullptr, 0) != UNZ_OK) {
    throw damaged(place);
  }
  constexpr uLong kEncrypted = 1;
  if ((info.flag & kEncrypted) != 0) throw bad_input(place, "is encrypted", "a plain archive");
  if (info.compression_method != 0 && info.compression_method != Z_DEFLATED) {
    throw bad_input(place, fmt::format("is packed by method {}", info.compression_method),
                    "method 0 (stored) or 8 (deflate)");
  }
  if (info.uncompressed_size > most) {
    throw bad_input(place, fmt::format("holds {} bytes", info.uncompressed_size),
                    fmt::format("at most {}", most));
  }
  return unpacked(archive.get(), info.uncompressed_size, place);
}

}  // namespace tpm::files
