#include "tpm/files/row_log.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <optional>

#include "tpm/files/checksum.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/files/replacement.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

static_assert(std::endian::native == std::endian::little, "row logs hold little-endian numbers");

constexpr std::string_view kMagic = "TPMROWS1";
constexpr std::uint32_t kClosing = 0xffffffffU;  // in place of a row's number
constexpr std::size_t kBlock = 1U << 16U;

std::uint32_t crc_of(const void* bytes, std::size_t size, std::uint32_t number = 0) {
  return crc32_of(bytes, size, crc32_of(&number, sizeof number));
}

void put(std::vector<std::byte>& to, const void* bytes, std::size_t size) {
  const auto* first = static_cast<const std::byte*>(bytes);
  to.insert(to.end(), first, first + size);
}

void put_number(std::vector<std::byte>& to, std::uint32_t number) {
  put(to, &number, sizeof number);
}

/// A text with its length before and its check sum behind.
void put_text(std::vector<std::byte>& to, std::string_view text) {
  put_number(to, static_cast<std::uint32_t>(text.size()));
  put(to, text.data(), text.size());
  put_number(to, crc_of(text.data(), text.size()));
}

/// Reads on from a place in the bytes; false where they end.
class Cursor {
 public:
  explicit Cursor(std::string_view bytes) : bytes_(bytes) {}
  bool take(void* to, std::size_t size) {
    if (bytes_.size() - at_ < size) return false;
    std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
    return true;
  }
  [[nodiscard]] std::size_t at() const { return at_; }
  void go_to(std::size_t at) { at_ = at; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  /// True if the remaining bytes hold the text that begins here.
  [[nodiscard]] bool holds_text() const {
    Cursor ahead = *this;
    std::uint32_t size = 0;
    return ahead.take(&size, sizeof size) &&
           bytes_.size() - ahead.at_ >= std::size_t{size} + sizeof(std::uint32_t);
  }
  bool take_text(std::string& text) {
    std::uint32_t size = 0, crc = 0;
    if (!take(&size, sizeof size) || bytes_.size() - at_ < size) return false;
    text.assign(bytes_.substr(at_, size));
    at_ += size;
    return take(&crc, sizeof crc) && crc == crc_of(text.data(), text.size());
  }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

Error cannot_write_rows(const std::filesystem::path& path, const char* what) {
  return {ExitCode::environment, path.string(), fmt::format("{}: {}", what, std::strerror(errno))};
}

}  // namespace

RowLogWriter::RowLogWriter(std::filesystem::path path, std::string_view header,
                           std::size_t row_bytes, Name name)
    : path_(std::move(path)), row_bytes_(row_bytes) {
  if (is_device_or_pipe(path_)) {
    file_ = Descriptor(::open(path_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC));
  } else {
    begun_ = std::make_unique<Replacement>(path_);
    file_ = Descriptor(::fcntl(begun_->descriptor(), F_DUPFD_CLOEXEC, 0));
  }
  if (file_.get() < 0) throw cannot_write_rows(path_, "cannot be written");
  kept_.reserve(2 * kBlock);
  put(kept_, kMagic.data(), kMagic.size());
  put_number(kept_, static_cast<std::uint32_t>(row_bytes));
  put_text(kept_, header);
  flush();
  if (name == Name::instantaneous) appear();
}

void RowLogWriter::appear() {
  if (begun_ == nullptr) return;
  begun_->put_in_place();
  begun_.reset();
}

void RowLogWriter::append(const void* row) {
  const std::size_t begin = kept_.size();
  put_number(kept_, rows_);
  put(kept_, row, row_bytes_);
  put_number(kept_, crc32_of(kept_.data() + begin, kept_.size() - begin));  // as crc_of()
  ++rows_;
  if (kept_.size() >= kBlock) flush();
}

void RowLogWriter::flush() {
  const std::string_view bytes(reinterpret_cast<const char*>(kept_.data()), kept_.size());
  if (!write_all(file_.get(), bytes)) throw cannot_write_rows(path_, "cannot be written on");
  kept_.clear();
}

void RowLogWriter::close(std::string_view closing) {
  put_number(kept_, kClosing);
  put_text(kept_, closing);
  flush();
  if (::fsync(file_.get()) != 0 && errno != EINVAL) {  // EINVAL: a device or pipe, without a disk
    throw cannot_write_rows(path_, "cannot be brought to the disk");
  }
  mark_result(file_.get());  // the mark that its name came with tells of the header alone
  (void)file_.close();
}

namespace {

/// The number of the whole row that begins here, if one does.
std::optional<std::uint32_t> row_number_at(Cursor cursor, std::vector<std::byte>& row) {
  std::uint32_t number = 0, crc = 0;
  if (!cursor.take(&number, sizeof number) || number == kClosing ||
      !cursor.take(row.data(), row.size()) || !cursor.take(&crc, sizeof crc) ||
      crc != crc_of(row.data(), row.size(), number)) {
    return std::nullopt;
  }
  return number;
}

/// Where bytes are missing, or too many, the next whole row begins at another place. Leaves the
/// cursor there and returns its number; where none is found within a few rows, as it was.
std::optional<std::uint32_t> find_next_row(Cursor& cursor, std::size_t damaged_at,
                                           std::uint32_t expected, std::size_t row_bytes) {
  constexpr std::size_t kRowsAhead = 4;
  std::vector<std::byte> row(row_bytes);
  const std::size_t slot = row_bytes + 2 * sizeof(std::uint32_t), next = cursor.at();
  if (cursor.left() < slot || row_number_at(cursor, row)) return std::nullopt;
  Cursor ahead = cursor;
  for (std::size_t at = damaged_at + 1; at < damaged_at + kRowsAhead * slot; ++at) {
    ahead.go_to(at);
    if (ahead.left() < slot) break;
    const std::optional<std::uint32_t> number = row_number_at(ahead, row);
    if (!number || *number < expected) continue;
    cursor.go_to(at);
    return number;
  }
  cursor.go_to(next);
  return std::nullopt;
}

/// A row, or what stands in its place.
enum class Found { row, closing, damage, end };

/// @param expected number of the row; larger afterwards if rows before this one are missing
Found read_slot(Cursor& cursor, RowLog& log, std::uint32_t& expected, std::vector<std::byte>& row) {
  const std::size_t begin = cursor.at();
  std::uint32_t number = 0, crc = 0;
  if (!cursor.take(&number, sizeof number)) return Found::end;
  if (number == kClosing) {
    const bool cut = !cursor.holds_text();
    if (cursor.take_text(log.closing)) return Found::closing;
    log.closing.clear();
    if (!cut) ++log.damaged;
    return Found::end;
  }
  if (!cursor.take(row.data(), row.size()) || !cursor.take(&crc, sizeof crc)) return Found::end;
  const bool whole = number >= expected && crc == crc_of(row.data(), row.size(), number);
  if (!whole) {
    if (const auto next = find_next_row(cursor, begin, expected, row.size())) {
      if (*next > expected) log.damaged += *next - expected - 1;
      expected = *next - 1;
    }
    return Found::damage;
  }
  log.damaged += number - expected;  // rows that are not there
  expected = number;
  return Found::row;
}

void read_rows(Cursor& cursor, RowLog& log) {
  std::vector<std::byte> row(log.row_bytes);
  for (std::uint32_t expected = 0;; ++expected) {
    const Found found = read_slot(cursor, log, expected, row);
    if (found == Found::damage) {
      ++log.damaged;
      continue;
    }
    if (found == Found::closing) log.closed = true;
    if (found == Found::closing || found == Found::end) return;
    log.bytes.insert(log.bytes.end(), row.begin(), row.end());
    ++log.rows;
  }
}

}  // namespace

RowLog read_row_log(const std::filesystem::path& path) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 36U;  // a working day at 4 kHz
  // A source that is no regular file may have no end.
  std::error_code ec;
  const std::string bytes =
      std::filesystem::is_regular_file(path, ec) ? read_file(path, kMost) : read_file(path);
  Cursor cursor(bytes);
  RowLog log;
  std::string magic(kMagic.size(), '\0');
  std::uint32_t row_bytes = 0;
  constexpr std::uint32_t kMostRowBytes = 1U << 20U;
  constexpr const char* kExpected = "a file that tpm hil run has written";
  if (!cursor.take(magic.data(), magic.size()) || magic != kMagic ||
      !cursor.take(&row_bytes, sizeof row_bytes) || row_bytes == 0 || row_bytes > kMostRowBytes) {
    throw bad_input(path.string(), "is no recording", kExpected);
  }
  if (!cursor.holds_text()) throw bad_input(path.string(), "ends inside its header", kExpected);
  if (!cursor.take_text(log.header)) {
    throw bad_input(path.string() + ": header", "is damaged: its check sum does not fit",
                    kExpected);
  }
  log.row_bytes = row_bytes;
  log.bytes.reserve(bytes.size());
  read_rows(cursor, log);
  return log;
}

}  // namespace tpm::files
