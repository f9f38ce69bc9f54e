#include "tpm/sweep/block_log.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <utility>

#include "tpm/files/checksum.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/files/require_exists.hpp"
#include "tpmkit/error.hpp"

namespace tpm::sweep {
namespace {

static_assert(std::endian::native == std::endian::little, "logs hold little-endian numbers");

constexpr std::string_view kLogMagic = "TPMSWEEP";
constexpr std::string_view kRecordMagic = "TPMBLOCK";
constexpr std::uint64_t kLargestRecord = std::uint64_t{1} << 32U;

/// Header of a payload.
struct RecordHead {
  char magic[8];
  std::uint64_t number;
  std::uint64_t size;
  std::uint32_t crc_of_payload;
  std::uint32_t crc_of_head;  ///< of all before it
};

template <class T>
void put_all(std::string& to, const std::vector<T>& values) {
  to.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

template <class T>
bool take_all(std::string_view& from, std::vector<T>& values) {
  const std::size_t bytes = values.size() * sizeof(T);
  if (from.size() < bytes) return false;
  if (bytes > 0) std::memcpy(values.data(), from.data(), bytes);  // no vector, no address
  from.remove_prefix(bytes);
  return true;
}

/// @param block empty_block()
bool unpack(std::string_view bytes, CellBlock& block) {
  bool whole = take_all(bytes, block.status) && take_all(bytes, block.reason) &&
               take_all(bytes, block.error_estimate) && take_all(bytes, block.model);
  for (auto& counts : block.counts) whole = whole && take_all(bytes, counts);
  for (auto& values : block.values) whole = whole && take_all(bytes, values);
  while (whole && !bytes.empty()) {
    const std::size_t end = bytes.find('\0');
    if (end == std::string_view::npos) return false;
    block.reasons.emplace_back(bytes.substr(0, end));
    bytes.remove_prefix(end + 1);
  }
  return whole && std::all_of(block.reason.begin(), block.reason.end(),
                              [&](std::uint16_t r) { return r <= block.reasons.size(); });
}

std::string log_head(const std::string& fingerprint) {
  return std::string(kLogMagic) + fingerprint;
}

Error cannot_write_log(const std::filesystem::path& path) {
  return {ExitCode::environment, path.string(),
          fmt::format("cannot write: {}", std::strerror(errno)),
          "a folder that can be written and has room; what was computed is kept"};
}

}  // namespace

std::string log_record(const CellBlock& block) {
  RecordHead head{};
  std::string bytes(sizeof head, '\0');
  put_all(bytes, block.status);
  put_all(bytes, block.reason);
  put_all(bytes, block.error_estimate);
  put_all(bytes, block.model);
  for (const auto& counts : block.counts) put_all(bytes, counts);
  for (const auto& values : block.values) put_all(bytes, values);
  for (const std::string& reason : block.reasons) bytes.append(reason).push_back('\0');
  std::copy(kRecordMagic.begin(), kRecordMagic.end(), head.magic);
  head.number = block.number;
  head.size = bytes.size() - sizeof head;
  head.crc_of_payload = crc32_of(bytes.data() + sizeof head, head.size);
  head.crc_of_head = crc32_of(&head, sizeof head - sizeof head.crc_of_head);
  std::memcpy(bytes.data(), &head, sizeof head);
  return bytes;
}

BlockLog::BlockLog(std::filesystem::path path, const Sweep& sweep)
    : path_(std::move(path)), sweep_(&sweep), place_(sweep.blocks(), 0) {}

BlockLog::BlockLog(std::filesystem::path path, const Sweep& sweep,
                   const std::function<void(const std::string&)>& note)
    : BlockLog(std::move(path), sweep) {
  std::error_code ignored;
  if (path_.has_parent_path()) std::filesystem::create_directories(path_.parent_path(), ignored);
  open(O_RDWR | O_CREAT);
  if (::flock(file_.get(), LOCK_EX | LOCK_NB) != 0) {
    throw Error(ExitCode::environment, path_.string(), "another tpm sweep is writing it",
                "one at a time, or shards with files of their own");
  }
  begin();
  find_blocks(note);
  // Bytes behind the last block were cut short: new blocks take their place.
  if (::ftruncate(file_.get(), static_cast<off_t>(length_)) != 0) throw cannot_write_log(path_);
}

BlockLog BlockLog::to_read(std::filesystem::path path, const Sweep& sweep,
                           const std::function<void(const std::string&)>& note) {
  BlockLog log(std::move(path), sweep);
  require_exists(log.path_);
  log.open(O_RDONLY);
  std::string head;
  const std::string right = log_head(sweep.fingerprint);
  if (!log.read_at(0, head, right.size()) || !head.starts_with(kLogMagic)) {
    throw bad_input(log.path_.string(), "is no log of a sweep",
                    "a shard that tpm sweep has written");
  }
  log.begin();
  log.find_blocks(note);
  return log;
}

void BlockLog::open(int flags) {
  if ((flags & O_CREAT) != 0) require_not_read(path_);
  file_ = Descriptor(::open(path_.c_str(), flags | O_CLOEXEC | O_NONBLOCK, 0666));
  if (file_.get() >= 0 && (flags & O_CREAT) == 0) note_reading(path_, file_.get());
  struct stat found {};
  if (file_.get() < 0 || ::fstat(file_.get(), &found) != 0) {
    if ((flags & O_CREAT) != 0) throw cannot_write_log(path_);
    throw bad_input(path_.string(), std::strerror(errno), "a shard that tpm sweep has written");
  }
  length_ = static_cast<std::uint64_t>(found.st_size);
}

void BlockLog::begin() {
  const std::string right = log_head(sweep_->fingerprint);
  std::string head;
  if (read_at(0, head, right.size())) {
    if (head == right) return;
    throw bad_input(path_.string(),
                    head.starts_with(kLogMagic) ? "belongs to another sweep or version of tpm"
                                                : "is no log of a sweep",
                    "the log of this sweep; remove the file to begin anew");
  }
  // Shorter than a head: killed before anything was written, unless it is something else.
  if (!read_at(0, head, length_) || !right.starts_with(head)) {
    throw bad_input(path_.string(), "is no log of a sweep", "a file that tpm sweep has begun");
  }
  if (pwrite_all(file_.get(), right.data(), right.size(), 0) < right.size()) {
    throw cannot_write_log(path_);
  }
  length_ = right.size();
}

bool BlockLog::read_at(std::uint64_t offset, std::string& bytes, std::uint64_t size) const {
  if (offset > length_ || length_ - offset < size) return false;
  bytes.resize(size);
  return pread_all(file_.get(), bytes.data(), size, offset) == size;
}

bool BlockLog::record_at(std::uint64_t offset, std::uint64_t& number, std::string& payload,
                         std::uint64_t& end) const {
  std::string bytes;
  RecordHead head{};
  if (!read_at(offset, bytes, sizeof head)) return false;
  std::memcpy(&head, bytes.data(), sizeof head);
  if (std::string_view(head.magic, sizeof head.magic) != kRecordMagic ||
      head.crc_of_head != crc32_of(&head, sizeof head - sizeof head.crc_of_head) ||
      head.size > kLargestRecord || head.number >= place_.size()) {
    return false;
  }
  if (!read_at(offset + sizeof head, payload, head.size) ||
      crc32_of(payload.data(), payload.size()) != head.crc_of_payload) {
    return false;
  }
  number = head.number;
  end = offset + sizeof head + head.size;
  return true;
}

/// Where the next record may begin; the file's length if nowhere.
std::uint64_t BlockLog::find_next(std::uint64_t from) const {
  constexpr std::uint64_t kStretch = std::uint64_t{1} << 20U;
  std::string bytes;
  while (from < length_) {
    const std::uint64_t size = std::min(kStretch, length_ - from);
    if (!read_at(from, bytes, size)) break;
    const std::size_t found = bytes.find(kRecordMagic);
    if (found != std::string::npos) return from + found;
    if (size < kStretch) break;
    from += size - kRecordMagic.size() + 1;
  }
  return length_;
}

void BlockLog::find_blocks(const std::function<void(const std::string&)>& note) {
  std::uint64_t offset = log_head(sweep_->fingerprint).size(), last_end = offset, number = 0,
                end = 0;
  bool damaged_before = false;
  int damaged = 0;
  std::string payload;
  while (offset < length_) {
    if (record_at(offset, number, payload, end)) {
      CellBlock block = empty_block(*sweep_, number);
      if (place_[number] == 0 && unpack(payload, block)) {
        place_[number] = offset;
        ++size_;
      }
      damaged += damaged_before ? 1 : 0;
      damaged_before = false;
      offset = last_end = end;
    } else {
      damaged_before = true;
      offset = find_next(offset + 1);
    }
  }
  length_ = last_end;
  if (damaged > 0 && note) {
    note(fmt::format("{}: damaged in {} place{}; the blocks there count as not computed",
                     path_.string(), damaged, damaged == 1 ? "" : "s"));
  }
}

void BlockLog::append(std::uint64_t number, std::string_view record) {
  if (pwrite_all(file_.get(), record.data(), record.size(), length_) < record.size()) {
    const Error error = cannot_write_log(path_);
    if (::ftruncate(file_.get(), static_cast<off_t>(length_)) != 0) {
      // The next run cuts the half-written block off.
    }
    throw error;
  }
  place_[number] = length_;
  length_ += record.size();
  ++size_;
}

void BlockLog::require_room(std::uint64_t blocks) const {
  double per_cell = sizeof(CellStatus) + sizeof(std::uint16_t) + sizeof(double);
  if (!sweep_->model->models().empty()) per_cell += 1.0;
  per_cell += 8.0 * static_cast<double>(sweep_->model->counted().size());
  for (const SweepVariable& variable : sweep_->variables) {
    per_cell += 8.0 * static_cast<double>(variable.width());
  }
  const double cells =
      std::min(static_cast<double>(blocks) * static_cast<double>(sweep_->block_cells),
               static_cast<double>(sweep_->cells()));
  std::error_code ec;
  const auto folder = path_.has_parent_path() ? path_.parent_path() : std::filesystem::path(".");
  const auto space = std::filesystem::space(folder, ec);
  if (ec || cells * per_cell <= static_cast<double>(space.capacity)) return;
  throw Error(ExitCode::environment, path_.string(),
              fmt::format("{:.3g} cells need {:.3g} GB, the disk has {:.3g}", cells,
                          1e-9 * cells * per_cell, 1e-9 * static_cast<double>(space.capacity)),
              "a larger disk, a coarser axis, or --shard over several machines");
}

CellBlock BlockLog::read(std::uint64_t number) const {
  CellBlock block = empty_block(*sweep_, number);
  std::string payload;
  std::uint64_t end = 0;
  if (!record_at(place_[number], block.number, payload, end) || block.number != number ||
      !unpack(payload, block)) {
    throw bad_input(path_.string(), fmt::format("block {} is damaged", number),
                    "a log that nobody writes into; the same command computes it again");
  }
  return block;
}

void BlockLog::sync() {
  if (::fdatasync(file_.get()) != 0) throw cannot_write_log(path_);
}

}  // namespace tpm::sweep
