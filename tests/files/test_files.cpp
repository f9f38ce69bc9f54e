// Files that are read, written and replaced: nothing that a command reads is written over, and what
// is replaced keeps its place, its mode and its links.
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/checksum.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/files/origin_mark.hpp"
#include "tpm/files/replacement.hpp"
#include "tpm/files/row_log.hpp"

namespace tpm::files {
namespace {

namespace fs = std::filesystem;
using Catch::Matchers::Contains;

const std::string kSource = TPM_TEST_SOURCE_DIR;

struct Ran {
  int code = 0;
  std::string said;  ///< on standard error
};

/// Runs a shell line in the folder, in which $TPM stands for the program.
Ran run_in(const test::TempFolder& folder, const std::string& line) {
  const std::string said = folder / "said";
  const std::string command = "cd '" + folder.path().string() +
                              "'; TPM='" TPM_TEST_PROGRAM "'; S='" + kSource + "'; { " + line +
                              "; } > out 2> said";
  const int status = std::system(command.c_str());
  std::ifstream in(said, std::ios::binary);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          std::string(std::istreambuf_iterator<char>(in), {})};
}

mode_t mode_of(const std::string& file) {
  struct stat found {};
  REQUIRE(::stat(file.c_str(), &found) == 0);
  return found.st_mode & 07777;
}

std::size_t files_in(const test::TempFolder& folder) {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()));
}

TEST_CASE("No command writes over a file that it reads, whatever the file is called") {
  const test::TempFolder folder;
  fs::copy_file(kSource + "/configs/liver_scene.json", folder / "organ.json");
  fs::copy_file(kSource + "/configs/liver_poke.json", folder / "x.xdmf");
  fs::copy_file(kSource + "/configs/sweep_x_depth.json", folder / "s.json");
  fs::copy_file(kSource + "/configs/sweep_x_depth.json", folder / "t.csv");
  fs::copy_file(kSource + "/tests/fixtures/machine_french.csv", folder / "d.csv");
  fs::copy_file(kSource + "/configs/design_meat.json", folder / "figures.json");
  fs::create_symlink("organ.json", folder / "link.json");
  fs::create_hard_link(folder / "organ.json", folder / "twin.json");
  fs::create_directory(folder / "way");
  REQUIRE(run_in(folder, "$TPM data pack evren_static -o c.h5").code == 0);
  const std::string packed = read_file(folder / "c.h5"), organ = read_file(folder / "organ.json");
  const char* const linked =
      "$TPM fit $S/configs/liver_relaxation.json -o out.json; ln out.json in.json; $TPM fit "
      "in.json "
      "-o out.json";
  for (const char* line :
       {linked, "$TPM network show organ.json -o organ", "$TPM network show link.json -o organ",
        "$TPM network show twin.json -o organ", "$TPM network show organ.json -o link",
        "$TPM network show organ.json -o ./way/../organ", "$TPM network build x.xdmf -o x.h5",
        "$TPM simulate x.xdmf -o x.h5", "$TPM simulate x.xdmf -o x.xdmf",
        "$TPM simulate organ.json -o organ.json", "$TPM data import d.csv -o d --overwrite",
        "$TPM data pack c.h5 -o c.h5 --overwrite", "$TPM sweep s.json -o s.json",
        "$TPM sweep t.csv -o t.h5", "$TPM design figures.json --repetitions 0 --folder ."}) {
    INFO(line);
    const Ran ran = run_in(folder, line);
    CHECK(ran.code == 2);
    CHECK(std::count(ran.said.begin(), ran.said.end(), '\n') == 1);
  }
  CHECK(read_file(folder / "c.h5") == packed);
  CHECK(read_file(folder / "organ.json") == organ);
  CHECK(read_file(folder / "x.xdmf") == read_file(kSource + "/configs/liver_poke.json"));
  CHECK(read_file(folder / "d.csv") == read_file(kSource + "/tests/fixtures/machine_french.csv"));
  CHECK(read_file(folder / "t.csv") == read_file(kSource + "/configs/sweep_x_depth.json"));
  CHECK(read_file(folder / "figures.json") == read_file(kSource + "/configs/design_meat.json"));
}

TEST_CASE("What a command reads and what it writes are told apart in either order") {
  const test::TempFolder folder;
  write_file(folder / "a", "a");
  write_file(folder / "b", "b");
  const FileRoles roles;
  const std::string expected = "reads it and would write over it";
  CHECK(read_file(folder / "a") == "a");
  CHECK_THAT(test::refusal_of([&] { will_write({folder / "a"}); }), Contains(expected));
  CHECK_THAT(test::refusal_of([&] { write_file(folder / "a", "x"); }), Contains(expected));
  CHECK_THAT(test::refusal_of([&] { (void)Hdf5Writer(folder / "a"); }), Contains(expected));
  CHECK_THAT(test::refusal_of([&] { RowLogWriter(folder / "a", "h", 8); }), Contains(expected));
  will_write({folder / "b"});
  CHECK_THAT(test::refusal_of([&] { (void)read_file(folder / "b"); }), Contains(expected));
  write_file(folder / "b", "new");
  CHECK(read_file(folder / "b") == "new");  // its own result
  CHECK_NOTHROW(write_file(folder / "b", "newer"));
  will_update({folder / "c"});
  write_file(folder / "c", "state");
  CHECK(read_file(folder / "c") == "state");
  CHECK_NOTHROW(write_file(folder / "c", "next state"));
  CHECK(read_file(folder / "a") == "a");
}

TEST_CASE("a result of a default name gives way to the same command with the same inputs alone") {
  const test::TempFolder folder;
  const std::string fit = "tpm fit /data/a.csv";
  const auto run_as = [&](const std::string& origin, bool force, Naming naming,
                          const std::string& content) {
    FileRoles roles;
    roles.mark_results(origin, force);
    return test::refusal_of([&] {
      will_write({folder / "r"}, naming);
      write_file(folder / "r", content);
    });
  };
  CHECK(run_as(fit, false, Naming::by_default, "a").empty());
  if (!origin_mark(folder / "r")) {
    WARN("this file system has no extended attributes: nothing is told apart");
    return;
  }
  CHECK(origin_mark(folder / "r")->origin == fit);
  CHECK(run_as(fit, false, Naming::by_default, "b").empty());
  CHECK_THAT(
      run_as("tpm fit /data/b.csv", false, Naming::by_default, "c"),
      Contains("r: is a result of: tpm fit /data/a.csv; expected ") && Contains("--overwrite"));
  CHECK(read_file(folder / "r") == "b");
  CHECK(run_as("tpm fit /data/b.csv", false, Naming::folder, "c").empty());
  { std::ofstream(folder / "r", std::ios::app) << "edited"; }
  for (const Naming naming : {Naming::by_default, Naming::folder}) {
    CHECK_THAT(run_as("tpm fit /data/b.csv", false, naming, "d"),
               Contains("was changed since tpm wrote it"));
  }
  CHECK(read_file(folder / "r") == "cedited");
  CHECK(run_as("tpm fit /data/b.csv", true, Naming::by_default, "e").empty());
  fs::remove(folder / "r");
  std::ofstream(folder / "r") << "of somebody";
  CHECK_THAT(run_as(fit, false, Naming::by_default, "f"),
             Contains("nothing says that tpm wrote it"));
  CHECK(run_as(fit, false, Naming::folder, "g").empty());
  CHECK(run_as(fit, false, Naming::file, "h").empty());
}

TEST_CASE("files whose names come later are kept in a folder of a default name, too") {
  const test::TempFolder folder;
  FileRoles roles;
  fs::create_directory(folder / "out");
  std::ofstream(folder / "out/figure.svg") << "of somebody";
  std::ofstream(folder / "figure.svg") << "of somebody";
  roles.mark_results("tpm paper report", false);
  will_write_in(folder / "out", Naming::by_default);
  CHECK_THAT(test::refusal_of([&] { write_file(folder / "out/figure.svg", "x"); }),
             Contains("nothing says that tpm wrote it"));
  CHECK_NOTHROW(write_file(folder / "out/other.svg", "x"));
  CHECK_NOTHROW(write_file(folder / "out/other.svg", "its own"));
  CHECK_NOTHROW(write_file(folder / "figure.svg", "x"));
}

TEST_CASE("A file that is replaced keeps its mode, and a link to it stays a link") {
  const test::TempFolder folder;
  fs::create_directory(folder / "deep");
  write_file(folder / "deep/private", "old");
  REQUIRE(::chmod((folder / "deep/private").c_str(), 0600) == 0);
  fs::create_symlink("deep/private", folder / "link");
  fs::create_symlink("link", folder / "second");
  write_file(folder / "second", "new");
  CHECK(fs::is_symlink(folder / "link"));
  CHECK(fs::is_symlink(folder / "second"));
  CHECK(read_file(folder / "deep/private") == "new");
  CHECK(mode_of(folder / "deep/private") == 0600);
  Hdf5Writer hdf5(folder / "link");
  hdf5.numbers("/x", {1.0});
  hdf5.commit();
  CHECK(fs::is_symlink(folder / "link"));
  CHECK(Hdf5Reader(folder / "second").numbers("/x").at(0) == 1.0);
  CHECK(mode_of(folder / "deep/private") == 0600);
  RowLogWriter(folder / "link", "header", 8).close("end");
  CHECK(read_row_log(folder / "second").header == "header");
  CHECK(mode_of(folder / "deep/private") == 0600);

  fs::create_symlink("nowhere_yet", folder / "ahead");
  write_file(folder / "ahead", "made");
  CHECK(read_file(folder / "nowhere_yet") == "made");
  fs::create_symlink("round", folder / "about");
  fs::create_symlink("about", folder / "round");
  CHECK_THAT(test::refusal_of([&] { write_file(folder / "about", "x"); }),
             Contains("cannot write: Too many levels of symbolic links"));
}

TEST_CASE("A temporary file that lies there already is neither followed nor written into") {
  const test::TempFolder folder;
  write_file(folder / "precious", "kept");
  const std::string usual = (folder / "out") + ".part." + std::to_string(::getpid());
  fs::create_symlink("precious", usual);
  write_file(folder / "out", "result");
  CHECK(read_file(folder / "out") == "result");
  CHECK(read_file(folder / "precious") == "kept");
  CHECK(fs::is_symlink(usual));
}

TEST_CASE("Temporary files of dead writers go when the same result is written again") {
  const test::TempFolder folder;
  for (const char* name :
       {"out.part.4711", "out.part.4711-2", "outer.part.4711", "out.part.mine"}) {
    write_file(folder / name, "left over");
  }
  const std::string alive = folder / "out.part.4712";
  write_file(alive, "under way");
  const int held = ::open(alive.c_str(), O_RDWR | O_CLOEXEC);
  REQUIRE(::flock(held, LOCK_EX) == 0);
  write_file(folder / "out", "result");
  CHECK_FALSE(fs::exists(folder / "out.part.4711"));
  CHECK_FALSE(fs::exists(folder / "out.part.4711-2"));
  CHECK(fs::exists(folder / "outer.part.4711"));
  CHECK(fs::exists(folder / "out.part.mine"));
  CHECK(fs::exists(alive));
  ::close(held);
  {
    Hdf5Writer first(folder / "out");
    Hdf5Writer second(folder / "out");  // of the same process: neither removes the other's
    first.numbers("/x", {1.0});
    first.commit();
    second.numbers("/x", {2.0});
    second.commit();
  }
  CHECK(Hdf5Reader(folder / "out").numbers("/x").at(0) == 2.0);
  CHECK_FALSE(fs::exists(alive));
  CHECK(files_in(folder) == 3);
}

/// True if the folder's file system knows files without a name.
bool knows_nameless_files(const test::TempFolder& folder) {
  const int file = ::open(folder.path().c_str(), O_RDWR | O_TMPFILE | O_CLOEXEC, 0600);
  if (file >= 0) ::close(file);
  return file >= 0;
}

TEST_CASE("A killed writer leaves nothing, or what the next one removes") {
  const test::TempFolder folder;
  const pid_t child = ::fork();
  if (child == 0) {
    const Replacement begun(folder / "out");
    (void)!::write(begun.descriptor(), "half", 4);
    (void)::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  REQUIRE(files_in(folder) == (knows_nameless_files(folder) ? 0 : 1));
  write_file(folder / "out", "whole");
  CHECK(files_in(folder) == 1);
  CHECK(read_file(folder / "out") == "whole");
}

/// Processes that this one has started and not waited for.
std::vector<pid_t> children() {
  std::ifstream in("/proc/thread-self/children");
  return {std::istream_iterator<pid_t>(in), {}};
}

TEST_CASE(
    "The end of the process that puts an HDF5 file together is one error, and leaves nothing") {
  const test::TempFolder folder;
  write_file(folder / "out", "whole");
  {
    Hdf5Writer writer(folder / "out");
    writer.numbers("/x", {1.0, 2.0});
    const std::vector<pid_t> started = children();
    REQUIRE(started.size() == 1);
    REQUIRE(::kill(started.front(), SIGSEGV) == 0);
    const std::string end = "out: cannot write: HDF5 ended by signal 11; expected more memory";
    CHECK_THAT(test::refusal_of([&] { writer.commit(); }), Contains(end));
    CHECK_THAT(test::refusal_of([&] { writer.numbers("/y", {1.0}); }), Contains(end));
    CHECK_FALSE(test::refusal_of([&] { writer.commit(); }).empty());
  }
  CHECK(children().empty());
  CHECK(read_file(folder / "out") == "whole");
  CHECK(files_in(folder) == 1);
}

TEST_CASE("A check sum is the CRC-32 of ISO 3309, in one go, in parts and joined") {
  const std::string digits = "123456789";
  constexpr std::uint32_t kKnown = 0xcbf43926U;  // its usual check value
  CHECK(crc32_of(digits.data(), digits.size()) == kKnown);
  CHECK(crc32_of(nullptr, 0, kKnown) == kKnown);
  for (std::size_t first = 0; first <= digits.size(); ++first) {
    const std::uint32_t begin = crc32_of(digits.data(), first);
    CHECK(crc32_of(digits.data() + first, digits.size() - first, begin) == kKnown);
    const std::uint32_t end = crc32_of(digits.data() + first, digits.size() - first);
    CHECK(joined_crc32(begin, end, digits.size() - first) == kKnown);
  }
}

TEST_CASE("Names up to the longest that a folder takes are written, longer ones are said to be") {
  const test::TempFolder folder;
  for (const std::size_t length : {230U, 245U, 255U}) {
    const std::string file = folder / std::string(length, 'n');
    write_file(file, "text");
    CHECK(read_file(file) == "text");
  }
  const Ran ran = run_in(folder, "$TPM paper tables -o " + std::string(256, 'n'));
  CHECK(ran.code == 5);
  CHECK_THAT(ran.said, Contains("File name too long; expected a name of at most 255 bytes"));
  const Ran beside = run_in(
      folder, "$TPM simulate $S/configs/liver_poke.json -o " + std::string(250, 'n') + ".h5");
  CHECK(beside.code == 5);
  CHECK_THAT(beside.said, Contains("File name too long; expected a name of at most 255 bytes"));
}

TEST_CASE("A disk that gets full ends every writer of HDF5 in one line and leaves nothing behind") {
  const test::TempFolder folder;
  fs::copy_file(kSource + "/configs/liver_scene.json", folder / "organ.json");
  // A limit of the file size stands for the disk, at every place where it may strike.
  for (const int kilobytes : {1, 2, 4, 8, 16, 32, 64, 96}) {
    INFO(kilobytes);
    const Ran ran =
        run_in(folder, "( ulimit -f " + std::to_string(kilobytes) +
                           "; trap '' XFSZ; exec $TPM network build organ.json -o o.h5 )");
    CHECK(ran.code == 5);
    CHECK(ran.said ==
          "tpm: o.h5: cannot write: File too large; expected a folder that can be written and has "
          "room\n");
    CHECK(files_in(folder) == 3);  // the scene, what was said, nothing
  }
  const Ran pack = run_in(folder,
                          "( ulimit -f 4; trap '' XFSZ; exec $TPM data pack amy_creep "
                          "evren_relaxation evren_static -o c.h5 )");
  CHECK(pack.code == 5);
  CHECK(std::count(pack.said.begin(), pack.said.end(), '\n') == 1);
  CHECK_FALSE(fs::exists(folder / "c.h5"));
}

TEST_CASE("Control characters of names and titles are escaped on every way to the terminal") {
  CHECK(for_terminal("plain \xC3\xA9\ttext\n", LineEnds::kept) == "plain \xC3\xA9\ttext\n");
  CHECK(for_terminal("a\x1b[2Jb\r\n", LineEnds::escaped) == "a\\u001b[2Jb\\u000d\\u000a");
  CHECK(for_terminal("\xC2\x9b"
                     "1m \xE2\x80\xAE \x7f \xff",
                     LineEnds::kept) == "\\u009b1m \\u202e \\u007f ?");
  const test::TempFolder folder;
  write_file(folder / "s.json",
             "{\"title\": \"\\u001b[31mred\\u009b\", \"organ\": {\"kind\": \"liver\"}}");
  const Ran checked = run_in(folder, "$TPM network check s.json");
  CHECK(checked.code == 0);
  const std::string text = read_file(folder / "out");
  CHECK(text.find('\x1b') == std::string::npos);
  CHECK(text.find("\xC2\x9b") == std::string::npos);
  const Ran missing = run_in(folder, "$TPM network check \"$(printf 'no\\033[2J\\nfile')\"");
  CHECK(missing.code == 3);
  CHECK(missing.said == "tpm: no\\u001b[2J\\u000afile: no such file; expected a readable file\n");
  const Ran option = run_in(folder, "$TPM network check --\"$(printf 'o\\033\\nption')\"");
  CHECK(option.code == 2);
  CHECK(option.said.find('\x1b') == std::string::npos);
  CHECK(std::count(option.said.begin(), option.said.end(), '\n') == 1);
}

TEST_CASE("Views of a sweep read the file that a sweep writes by default") {
  const test::TempFolder folder;
  REQUIRE(run_in(folder, "$TPM sweep $S/configs/sweep_x_depth.json").code == 0);
  for (const char* view : {"show sweep.h5", "best sweep.h5 --objective peak_force"}) {
    CAPTURE(view);
    const Ran ran = run_in(folder, std::string("$TPM sweep ") + view);
    CHECK(ran.code == 0);
    CHECK(ran.said == "");
  }
}

TEST_CASE("A sweep for which the disk has no room is refused before its first cell") {
  const test::TempFolder folder;
  write_file(folder / "s.json",
             R"({"model": "single_contact", "indentation": {"kind": "step_hold"},
                 "axes": [{"parameter": "depth", "from": "1 mm", "to": "8 mm", "count": 1000000},
                          {"parameter": "spacing", "from": "10 mm", "to": "40 mm", "count": 1000000}],
                 "outputs": ["peak_force"]})");
  const Ran ran = run_in(folder, "timeout -s INT 600 $TPM sweep s.json -o o.h5");
  CHECK(ran.code == 5);
  CHECK_THAT(ran.said, Contains("o.h5.blocks: 1e+12 cells need") && Contains("the disk has"));
}

TEST_CASE("Inputs without an end are refused by every command that reads") {
  const test::TempFolder folder;
  write_file(folder / "law.json", R"({"law": "linear", "drive": "indentation_depth",
    "response": "contact_force", "reference_m": 0.001, "provenance": "assumed",
    "parameters": {"k_inf_N_per_m": 20.0}})");
  for (const char* command : {"simulate /dev/zero -o o.h5",
                              "network build /dev/zero -o o.h5",
                              "network check /dev/zero",
                              "network show /dev/zero -o o",
                              "plan /dev/zero",
                              "sweep /dev/zero -o o.h5",
                              "sweep merge /dev/zero o.blocks",
                              "fit /dev/zero --no-draw",
                              "fit a.csv /dev/zero --no-draw",
                              "data check /dev/zero",
                              "data show /dev/zero",
                              "data pack /dev/zero -o o.h5",
                              "data import /dev/zero -o o",
                              "predict /dev/zero --frequencies '1 Hz'",
                              "export /dev/zero --to febio",
                              "design /dev/zero",
                              "predict /dev/zero a.csv",
                              "predict law.json /dev/zero",
                              "budget /dev/zero a.csv",
                              "budget law.json /dev/zero",
                              "identify /dev/zero",
                              "paper audit /dev/zero",
                              "paper experiments /dev/zero --folder o",
                              "plan $S/configs/liver_poke.json --costs /dev/zero",
                              "hil run /dev/zero -o o.tpmrec",
                              "hil check /dev/zero",
                              "hil verify /dev/zero",
                              "hil report /dev/zero",
                              "hil export /dev/zero -o o.h5",
                              "hil run $S/configs/hil_omega7.json --law /dev/zero -o o.tpmrec",
                              "hil run $S/configs/hil_omega7.json --device replay "
                              "--device-recording /dev/zero -o o.tpmrec",
                              "sweep show /dev/zero",
                              "sweep best /dev/zero --objective peak_force",
                              "sweep plot /dev/zero --folder o.png",
                              "sweep convergence /dev/zero",
                              "sweep sensitivity /dev/zero"}) {
    INFO(command);
    write_file(folder / "a.csv", "time [s],depth [mm],force [N]\n0,0,0\n1,1,0.1\n2,1,0.08\n");
    const Ran ran = run_in(folder, std::string("$TPM ") + command);
    const bool checks = std::string_view(command).starts_with("data check");
    CHECK(ran.code == (checks ? 1 : 3));
    // What is no curve by its name is not opened at all.
    const bool refused = ran.said.starts_with("tpm: /dev/zero: holds more than 16 MB; expected") ||
                         ran.said.starts_with("tpm: /dev/zero: is a device or a pipe; expected") ||
                         ran.said.starts_with("tpm: /dev/zero: is neither a curve file nor");
    if (!refused) CHECK(ran.said == "");
    CHECK(std::count(ran.said.begin(), ran.said.end(), '\n') == 1);
    CHECK_FALSE(std::filesystem::exists(folder / "o.h5"));
  }
  write_file(folder / "ten", "0123456789");
  CHECK(read_file(folder / "ten", 10) == "0123456789");
  CHECK_THAT(test::refusal_of([&] { (void)read_file(folder / "ten", 9); }), Contains("holds more"));
}

}  // namespace
}  // namespace tpm::files
