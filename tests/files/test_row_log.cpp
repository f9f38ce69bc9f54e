// Recordings: what is read back, and what survives damage.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>

#include "temp_folder.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/files/origin_mark.hpp"
#include "tpm/files/row_log.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

struct Row {
  double a, b;
};

std::string written(const test::TempFolder& folder, int rows, bool closed) {
  std::string path = folder / "rows";
  RowLogWriter log(path, "{\"header\": 1}", sizeof(Row));
  for (int i = 0; i < rows; ++i) {
    const Row row{0.1 * i, -1.0 * i};
    log.append(&row);
  }
  if (closed) {
    log.close("{\"end\": true}");
  } else {
    log.flush();
  }
  return path;
}

Row row_of(const RowLog& log, std::size_t i) {
  Row row{};
  std::memcpy(&row, log.bytes.data() + i * sizeof(Row), sizeof(Row));
  return row;
}

TEST_CASE("A closed log gives back header, rows and closing") {
  const test::TempFolder folder;
  const RowLog log = read_row_log(written(folder, 10'000, true));
  CHECK(log.header == "{\"header\": 1}");
  CHECK(log.closed);
  CHECK(log.closing == "{\"end\": true}");
  REQUIRE(log.rows == 10'000);
  CHECK(row_of(log, 9'999).a == 0.1 * 9'999);
}

TEST_CASE("A closed log does not look as if it was changed since it was written") {
  const test::TempFolder folder;
  FileRoles roles;
  roles.mark_results("tpm hil run /data/session.json", false);
  const std::string path = written(folder, 10'000, true);
  const auto mark = origin_mark(path);
  if (!mark) {
    WARN("this file system has no extended attributes");
    return;
  }
  CHECK(mark->origin == "tpm hil run /data/session.json");
  CHECK_FALSE(mark->changed);
}

TEST_CASE("A log cut at any byte gives all rows before the cut, and is not whole") {
  const test::TempFolder folder;
  const std::string bytes = read_file(written(folder, 20, true));
  const std::size_t header = 8 + 4 + 4 + 13 + 4, stride = 4 + sizeof(Row) + 4;
  for (std::size_t size = header; size < bytes.size(); ++size) {
    const std::string path = folder / "cut";
    write_file(path, bytes.substr(0, size));
    const RowLog log = read_row_log(path);
    REQUIRE(log.rows == std::min<std::size_t>(20, (size - header) / stride));
    REQUIRE(log.damaged == 0);
    REQUIRE_FALSE(log.closed);
  }
}

TEST_CASE("A damaged row is left out and counted; all others and the closing come through") {
  const test::TempFolder folder;
  const std::string bytes = read_file(written(folder, 20, true));
  const std::size_t header = 8 + 4 + 4 + 13 + 4, stride = 4 + sizeof(Row) + 4;
  for (std::size_t at = header; at < header + 20 * stride; at += 7) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    const std::string path = folder / "damaged";
    write_file(path, damaged);
    const RowLog log = read_row_log(path);
    REQUIRE(log.rows == 19);
    REQUIRE(log.damaged == 1);
    REQUIRE(log.closed);
    const std::size_t lost = (at - header) / stride;
    for (std::size_t i = 0; i < log.rows; ++i)
      REQUIRE(row_of(log, i).a == 0.1 * static_cast<double>(i < lost ? i : i + 1));
  }
}

TEST_CASE("Four bytes lost between two rows damage both; a damaged closing is counted") {
  const test::TempFolder folder;
  const std::string bytes = read_file(written(folder, 20, true));
  const std::size_t header = 8 + 4 + 4 + 13 + 4, stride = 4 + sizeof(Row) + 4;
  std::string damaged = bytes;
  damaged.replace(header + 5 * stride - 2, 4, "XXXX");
  write_file(folder / "two", damaged);
  CHECK(read_row_log(folder / "two").damaged == 2);
  CHECK(read_row_log(folder / "two").rows == 18);
  CHECK(read_row_log(folder / "two").closed);
  damaged = bytes;
  damaged[bytes.size() - 6] = 'X';
  write_file(folder / "end", damaged);
  CHECK(read_row_log(folder / "end").rows == 20);
  CHECK(read_row_log(folder / "end").damaged == 1);
  CHECK_FALSE(read_row_log(folder / "end").closed);
}

TEST_CASE("A row that is lost, whole or in part, loses no other") {
  const test::TempFolder folder;
  const std::string bytes = read_file(written(folder, 20, true));
  const std::size_t header = 8 + 4 + 4 + 13 + 4, stride = 4 + sizeof(Row) + 4;
  for (const std::size_t gone : {stride, std::size_t{1}, std::size_t{5}, stride - 1}) {
    std::string damaged = bytes;
    damaged.erase(header + 5 * stride, gone);
    write_file(folder / "lost", damaged);
    const RowLog log = read_row_log(folder / "lost");
    CAPTURE(gone);
    REQUIRE(log.rows == 19);
    CHECK(log.damaged == 1);
    CHECK(log.closed);
    CHECK(row_of(log, 4).a == 0.1 * 4);
    CHECK(row_of(log, 5).a == 0.1 * 6);
  }
  std::string damaged = bytes;  // bytes of something else between two rows
  damaged.insert(header + 5 * stride, "XXX");
  write_file(folder / "more", damaged);
  CHECK(read_row_log(folder / "more").rows == 20);
  damaged = bytes;
  damaged.erase(header + 5 * stride, 3 * stride);
  write_file(folder / "three", damaged);
  CHECK(read_row_log(folder / "three").rows == 17);
  CHECK(read_row_log(folder / "three").damaged == 3);
}

TEST_CASE("A log that is to appear later leaves nothing, and spares what has its name") {
  const test::TempFolder folder;
  write_file(folder / "rows", "before");
  const auto files = [&] {
    const std::filesystem::directory_iterator all(
        std::filesystem::path(folder / "rows").parent_path());
    return std::distance(begin(all), end(all));
  };
  {
    const RowLogWriter log(folder / "rows", "{}", sizeof(Row), RowLogWriter::Name::later);
    CHECK(files() <= 2);  // a second one only where no file is without a name
  }
  CHECK(read_file(folder / "rows") == "before");
  CHECK(files() == 1);
  RowLogWriter log(folder / "rows", "{}", sizeof(Row), RowLogWriter::Name::later);
  log.appear();
  log.close("{}");
  CHECK(read_row_log(folder / "rows").closed);
  CHECK(files() == 1);
}

TEST_CASE("What is no log is refused in one line") {
  const test::TempFolder folder;
  const std::string path = folder / "text";
  write_file(path, "time,force\n0,1\n");
  CHECK_THROWS_WITH(read_row_log(path), Catch::Matchers::Contains("is no recording; expected"));
  CHECK_THROWS_AS(RowLogWriter("/proc/no/such", "{}", 8), Error);
}

TEST_CASE("A log that has its name has its header, and leaves nothing else behind") {
  const test::TempFolder folder;
  const RowLogWriter log(folder / "rows", "{\"header\": 1}", sizeof(Row));
  CHECK(read_row_log(folder / "rows").header == "{\"header\": 1}");
  const std::filesystem::directory_iterator files(
      std::filesystem::path(folder / "rows").parent_path());
  CHECK(std::distance(begin(files), end(files)) == 1);
}

TEST_CASE("A pipe is written into, not replaced") {
  const test::TempFolder folder;
  const std::string pipe = folder / "pipe";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  REQUIRE(reader >= 0);
  const auto received = [reader] {
    std::string bytes(100, '\0');
    const ssize_t got = ::read(reader, bytes.data(), bytes.size());
    bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    return bytes;
  };
  write_file(pipe, "text");
  CHECK(received() == "text");
  RowLogWriter log(pipe, "{}", sizeof(Row));
  log.close("{}");
  CHECK_THAT(received(), Catch::Matchers::StartsWith("TPMROWS1"));
  CHECK_THROWS_WITH(Hdf5Writer(pipe), Catch::Matchers::Contains("is a device or a pipe"));
  CHECK(is_device_or_pipe(pipe));
  CHECK_FALSE(is_device_or_pipe(folder / "none"));
  (void)::close(reader);
}

}  // namespace
}  // namespace tpm::files
