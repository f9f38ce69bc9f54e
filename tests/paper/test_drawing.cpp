// Drawings: what a user's names may do to them, what is run and read to make them, and that they
// are complete or absent.
#include <sys/stat.h>
#include <sys/wait.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/show/draw.hpp"

namespace tpm::paper {
namespace {

/// A variable of the environment for as long as this lives.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) {
    const char* before = std::getenv(name);
    had_ = before != nullptr;
    if (had_) before_ = before;
    (void)setenv(name, value.c_str(), 1);
  }
  ~Variable() { (void)(had_ ? setenv(name_, before_.c_str(), 1) : unsetenv(name_)); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
  std::string before_;
  bool had_ = false;
};

/// The current folder for as long as this lives.
class CurrentFolder {
 public:
  explicit CurrentFolder(const std::filesystem::path& folder)
      : before_(std::filesystem::current_path()) {
    std::filesystem::current_path(folder);
  }
  ~CurrentFolder() { std::filesystem::current_path(before_); }
  CurrentFolder(const CurrentFolder&) = delete;
  CurrentFolder& operator=(const CurrentFolder&) = delete;

 private:
  std::filesystem::path before_;
};

Figure figure_of(const std::string& name) {
  Panel panel{"", {"time", "s"}, {"force", "N"}};
  panel.series.push_back(line(name, {0.0, 1.0}, {1.0, 2.0}));
  return {figure_id("fit", name), name, name, {std::move(panel)}, name};
}

/// True if it is well-formed XML in which nothing runs.
bool is_harmless(const test::TempFolder& folder, const std::string& svg) {
  write_file(folder / "check.py", R"(
import sys
import xml.etree.ElementTree as tree
for element in tree.parse(sys.argv[1]).iter():
    if element.tag.endswith("script") or any(name.lower().startswith("on") for name in element.keys()):
        sys.exit(1)
)");
  const std::string command = "/usr/bin/python3 '" + (folder / "check.py") + "' '" + svg + "'";
  return std::system(command.c_str()) == 0;
}

}  // namespace

TEST_CASE("a figure's id is a safe name, its own for each name") {
  CHECK(figure_id("fit", "liver_4mm") == "fit_liver_4mm");
  const std::string harmful = "R&D\" onload=\"alert(1)\" x=\"/../";
  const std::string id = figure_id("fit", harmful);
  CHECK(id.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.") ==
        std::string::npos);
  CHECK(figure_id("fit", "R&D") != figure_id("fit", "R D"));
  CHECK(figure_id("fit", std::string(255, 'a')).size() <= 64);
  CHECK(figure_id("fit", std::string(255, 'a')) != figure_id("fit", std::string(254, 'a') + "b"));
}

TEST_CASE("names with markup, quotes, dollars or 255 bytes are drawn as they stand") {
  const test::TempFolder folder;
  std::vector<Figure> figures;
  for (const std::string& name : {std::string("R&D"), std::string("\"a\" onload=\"alert(1)\" b="),
                                  std::string("it's"), std::string("<script>alert(1)</script>"),
                                  std::string("5 $\\frac$ of -- $"), std::string(251, 'n')}) {
    figures.push_back(figure_of(name));
  }
  // One that another program wrote, with an id that is not safe in XML.
  figures.push_back(figure_of("plain"));
  figures.back().id = "a\" onload=\"alert(1)&";
  const auto files = write_figures(folder.path(), figures);
  CHECK(files.size() == 1 + 3 * figures.size());
  for (const Figure& figure : figures) {
    const std::string file = folder / (figure.id + ".svg");
    CAPTURE(file);
    CHECK(is_harmless(folder, file));
  }
}

TEST_CASE("figures of a report come as SVG for its page and as PDF for print") {
  const test::TempFolder folder;
  Document document;
  document.title = "report";
  const Figure figure = figure_of("x");
  document.blocks.emplace_back(Picture{figure.id, "title", "caption"});
  write_document(folder.path(), document, {figure}, find_drawing_python());
  CHECK(read_file(folder / "figures/fit_x.svg").find("<svg") != std::string::npos);
  CHECK(read_file(folder / "figures/fit_x.pdf").substr(0, 5) == "%PDF-");
  CHECK(read_file(folder / "report.html").find("<svg role=") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(folder / "figures/fit_x.png"));
}

TEST_CASE("no program of the current folder is run, and no file of it read, to draw") {
  const test::TempFolder folder;
  const std::string python = find_drawing_python();
  write_file(folder / "python3", "#!/bin/sh\ntouch '" + (folder / "was_run") + "'\nexit 0\n");
  REQUIRE(::chmod((folder / "python3").c_str(), 0755) == 0);
  write_file(folder / "matplotlibrc", "figure.dpi: no number\n");
  const CurrentFolder here(folder.path());
  const std::string path = std::getenv("PATH");
  for (const std::string& relative : {".:" + path, ":" + path, path + ":", "./:" + path}) {
    CAPTURE(relative);
    const Variable changed("PATH", relative);
    CHECK(find_drawing_python() == python);
    // Relative names of files are those of the caller, although Python starts in another folder.
    CHECK_NOTHROW(write_figures("drawn", {figure_of("x")}));
    CHECK(std::filesystem::exists(folder / "drawn/fit_x.svg"));
  }
  CHECK_FALSE(std::filesystem::exists(folder / "was_run"));
}

TEST_CASE("a drawing that is interrupted leaves the one of before") {
  const test::TempFolder folder;
  const std::string program = R"(
import sys
sys.path.insert(0, sys.argv[1])
from drawing_files import save_drawing
class Page:
    def savefig(self, file, **options):
        file.write(b"half")
        raise KeyboardInterrupt
try:
    save_drawing(Page(), sys.argv[2])
except KeyboardInterrupt:
    sys.exit(9)
)";
  write_file(folder / "program.py", program);
  const std::string drawing = folder / "drawing.svg";
  write_file(drawing, "whole");
  const std::string command = "/usr/bin/python3 '" + (folder / "program.py") +
                              "' '" TPM_TEST_SOURCE_DIR "/scripts' '" + drawing + "'";
  const int status = std::system(command.c_str());
  REQUIRE(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 9);
  CHECK(read_file(drawing) == "whole");
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    files += entry.is_regular_file() ? 1 : 0;
  }
  CHECK(files == 2);
}

}  // namespace tpm::paper
