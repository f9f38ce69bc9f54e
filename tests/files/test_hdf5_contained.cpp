// HDF5 from others is read by a child process: what it may do and use, and how its end is told.
#include <fcntl.h>
#include <hdf5.h>
#include <sys/resource.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "refusal.hpp"
#include "sanitizer.hpp"
#include "temp_folder.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/files/contained.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

using Catch::Matchers::Contains;

/// What a child answers, or how its end is told, for the only request.
std::string end_of(const ContainedLimits& limits, const Contained::Answer& answer) {
  const test::TempFolder folder;
  write_file(folder / "f", "content");
  const int file = ::open((folder / "f").c_str(), O_RDONLY | O_CLOEXEC);
  REQUIRE(file >= 0);
  Contained child("f", file, limits, [&](int /*descriptor*/) { return answer; });
  ::close(file);
  std::string told;
  const std::string refused = test::refusal_of([&] { told = child.ask("one"); });
  if (refused.empty()) return "answered: " + told;
  // A child that has ended says so again; one that threw goes on.
  CHECK(test::refusal_of([&] { (void)child.ask("two"); }) == refused);
  return refused;
}

TEST_CASE("A child answers, and an error of it is thrown here") {
  const ContainedLimits limits;
  CHECK(end_of(limits, [](std::string_view request) { return std::string(request) + "!"; }) ==
        "answered: one!");
  CHECK(end_of(limits, [](std::string_view) -> std::string {
          throw bad_input("f", "holds nothing", "something");
        }) == "f: holds nothing; expected something");
}

TEST_CASE(
    "Requests that nobody waits for are answered in their order, and their errors come later") {
  const test::TempFolder folder;
  write_file(folder / "f", "content");
  const int file = ::open((folder / "f").c_str(), O_RDONLY | O_CLOEXEC);
  REQUIRE(file >= 0);
  Contained child("f", file, ContainedLimits{}, [](int /*descriptor*/) {
    return [](std::string_view request) -> std::string {
      if (request == "throw") throw bad_input("f", "holds nothing", "something");
      return std::string(request) + "!";
    };
  });
  ::close(file);
  constexpr int kRequests = 1000;  // far more than may be due
  std::vector<std::string> taken;
  std::vector<std::string> expected;
  for (int i = 0; i < kRequests; ++i) {
    expected.push_back(std::to_string(i) + "!");
    child.tell(std::to_string(i), [&](std::string_view answer) { taken.emplace_back(answer); });
  }
  CHECK(child.ask("last") == "last!");
  CHECK(taken == expected);
  CHECK(test::refusal_of([&] { child.tell("throw"); }).empty());
  CHECK(test::refusal_of([&] { (void)child.ask("next"); }) ==
        "f: holds nothing; expected something");
}

TEST_CASE("A child that crashes, loops, or asks for more than it may have ends in one line") {
  ContainedLimits limits;
  CHECK(end_of(limits, [](std::string_view) -> std::string {
          (void)std::raise(SIGSEGV);
          return {};
        }) == "f: its content crashes the reader; expected a whole file");
  CHECK(end_of(limits, [](std::string_view) -> std::string { std::abort(); }) ==
        "f: its content crashes the reader; expected a whole file");
  limits.cpu_s = 0.05;
  CHECK(end_of(limits, [](std::string_view) -> std::string {
          for (volatile int i = 0;;) i = i + 1;
        }) == "f: its content keeps the reader busy without end; expected a whole file");
  limits.cpu_s = 5.0;
  limits.answer_bytes = 1000;
  CHECK(end_of(limits, [](std::string_view) { return std::string(1001, 'x'); }) ==
        "f: its content crashes the reader; expected a whole file");
  if (test::has_sanitizer()) return;
  limits.memory_bytes = std::uint64_t{64} << 20U;
  CHECK(end_of(limits, [](std::string_view) {
          const std::vector<char> much(std::size_t{256} << 20U, 'x');
          return std::string(much.data(), 1);
        }) == "f: its content asks for too much memory; expected a whole file");
}

#ifndef TPM_SANITIZE_EVERYTHING  // there the sanitizer needs two descriptors
TEST_CASE("A child that reads opens nothing and writes nothing") {
  const test::TempFolder folder;
  const std::string other = folder / "other";
  write_file(other, "secret");
  const std::string target = folder / "written";
  CHECK(end_of({}, [&](std::string_view) -> std::string {
          const int read = ::open(other.c_str(), O_RDONLY);
          const int written = ::open(target.c_str(), O_WRONLY | O_CREAT, 0600);
          return read < 0 && written < 0 ? "neither" : "opened";
        }) == "answered: neither");
  CHECK_FALSE(std::filesystem::exists(target));
  // Standard output and error of the parent are closed to it, and so is the file for writing.
  CHECK(end_of({}, [](std::string_view) -> std::string {
          rlimit size{};
          ::getrlimit(RLIMIT_FSIZE, &size);
          constexpr int kFile = 3;
          const bool wrote = ::write(kFile, "x", 1) == 1;
          return size.rlim_cur == 0 && !wrote ? "read only" : "writes";
        }) == "answered: read only");
}
#endif

/// An HDF5 file made by its own library.
class Crafted {
 public:
  explicit Crafted(const std::string& path)
      : file_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {
    REQUIRE(file_ >= 0);
  }
  ~Crafted() { H5Fclose(file_); }
  Crafted(const Crafted&) = delete;
  Crafted& operator=(const Crafted&) = delete;
  [[nodiscard]] hid_t get() const { return file_; }

 private:
  hid_t file_;
};

TEST_CASE("Links and numbers that lie in other files are refused") {
  const test::TempFolder folder;
  {
    const Crafted other(folder / "other.h5");
    H5Gclose(H5Gcreate2(other.get(), "group", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  }
  write_file(folder / "numbers.raw", std::string(16, '\0'));
  {
    const Crafted crafted(folder / "c.h5");
    REQUIRE(H5Lcreate_external((folder / "other.h5").c_str(), "/group", crafted.get(), "link",
                               H5P_DEFAULT, H5P_DEFAULT) >= 0);
    const hsize_t two = 2;
    const hid_t space = H5Screate_simple(1, &two, nullptr);
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_external(creation, (folder / "numbers.raw").c_str(), 0, 16);
    const hid_t set = H5Dcreate2(crafted.get(), "outside", H5T_IEEE_F64LE, space, H5P_DEFAULT,
                                 creation, H5P_DEFAULT);
    REQUIRE(set >= 0);
    H5Dclose(set);
    H5Pclose(creation);
    H5Sclose(space);
  }
  const Hdf5Reader file(folder / "c.h5");
  CHECK_THAT(test::refusal_of([&] { (void)file.members("/link"); }),
             Contains("/link: is a link to another file; expected"));
  CHECK_THAT(test::refusal_of([&] { (void)file.numbers("/outside"); }),
             Contains("/outside: keeps its numbers in another file; expected"));
}

TEST_CASE("Damaged HDF5 is read or refused in one line, by a process that goes on") {
  const test::TempFolder folder;
  const std::string whole =
      read_file(std::filesystem::path(TPM_TEST_SOURCE_DIR) / "tests/fuzz/corpus/hdf5/packed.h5");
  std::mt19937 random(0);
  int refused = 0, read = 0;
  constexpr int kFiles = 40;
  for (int i = 0; i < kFiles; ++i) {
    std::string bytes = whole;
    for (auto left = 1 + random() % 10; left > 0; --left) {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    write_file(folder / "m.h5", bytes);
    const std::string said = test::refusal_of([&] {
      const Hdf5Reader file(folder / "m.h5");
      for (const std::string& name : file.members("/")) (void)file.extents("/" + name);
    });
    INFO(i << ": " << said);
    CHECK(said.find('\n') == std::string::npos);
    ++(said.empty() ? read : refused);
  }
  CHECK(read + refused == kFiles);
  CHECK(refused > 0);
}

}  // namespace
}  // namespace tpm::files
