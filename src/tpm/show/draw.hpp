#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/show/document.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::show {

/// The Python interpreter that draws: $TPMKIT_PYTHON if it is set, else the first of python3 and
/// /usr/bin/python3 that has matplotlib (a version manager's python3 often has not). Without one it
/// warns, naming those tried, and returns an empty name, for which the functions below draw nothing
/// and write the rest.
[[nodiscard]] std::string find_drawing_python();

/// Formats of each figure: SVG and PDF, or PNG (300 dpi) too.
enum class Drawings { for_report, for_print };

/// Draws every figure of a figures.json into `folder`, one file per format, with
/// scripts/draw_figures.py. Throws Error(environment) with the last words of the script if it
/// fails.
void draw_figures(const std::string& python, const std::filesystem::path& figures_json,
                  const std::filesystem::path& folder, Drawings drawings = Drawings::for_report);

/// Writes figures.json into `folder` and draws its figures there as SVG, PNG and PDF. Returns the
/// names of the files that were written, after those of `files`: without a Python with matplotlib
/// figures.json alone. Throws as draw_figures does; figures.json is then there.
[[nodiscard]] std::vector<std::string> write_figures(const std::filesystem::path& folder,
                                                     const std::vector<Figure>& figures,
                                                     std::vector<std::string> files = {});

/// Writes a document with its figures into `folder`: report.md, report.html, figures.json,
/// figures/ID.svg and figures/ID.pdf. Without a Python a line stands in place of each figure.
/// Throws as draw_figures does.
void write_document(const std::filesystem::path& folder, const Document& document,
                    const std::vector<Figure>& figures, const std::string& python);

/// Writes a report into `folder`: what write_document() writes, and report.run.json with what
/// changes from run to run. Throws as draw_figures does.
/// @param seconds wall time of each part of the run; that of drawing is added
/// @param more further keys of report.run.json
void write_report(const std::filesystem::path& folder, const Document& document,
                  const std::vector<Figure>& figures, const std::string& python,
                  std::map<std::string, double> seconds, const Json& more = Json::object());

/// Draws a network_picture() as STEM.svg, STEM.png and STEM.pdf with scripts/draw_network.py.
/// Throws as draw_figures does.
void draw_network(const std::string& python, const std::filesystem::path& picture_json,
                  const std::filesystem::path& stem);

/// Draws pictures.json of a simulation into `folder` with scripts/draw_deformation.py, as SVG, PNG
/// and PDF. Returns the names of the files, none without a Python. Throws as draw_figures does.
/// @param two there are two states to be drawn side by side
[[nodiscard]] std::vector<std::string> draw_deformation(const std::string& python,
                                                        const std::filesystem::path& pictures_json,
                                                        const std::filesystem::path& folder,
                                                        bool two);

}  // namespace tpm::show
