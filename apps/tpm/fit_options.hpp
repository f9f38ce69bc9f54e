#pragma once
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "command.hpp"
#include "recording_options.hpp"
#include "tpm/fit/groups/young_moduli.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/law/contact_geometry.hpp"
#include "tpm/show/short_answer.hpp"

namespace tpm::app {

/// Options of `tpm fit` as typed; a text is empty if its option is missing.
struct FitOptions {
  RecordingOptions recordings;  ///< its files may also be one configuration, or one folder
  std::vector<std::string> laws;
  std::string family, margin, times;
  bool no_held_out = false;
  bool no_profiles = false;
  std::string folder;
  bool no_draw = false;
  bool verbose = false;
  std::string output;
  std::string rate;
  std::string hold_out_depth;
  std::string starts;
  std::string seed;
  std::string bootstrap;
  std::string resample;
  std::string reference;
  std::string group_by;
  bool compare = false;
  PlacementArguments placement;
  std::string radius, cone_angle, punch_radius, poisson;
};

/// The probe, if the options name one; none else.
[[nodiscard]] std::optional<ContactGeometry> probe_of(const FitOptions& options);

/// The law that all recordings are fitted with; none where there is a choice.
[[nodiscard]] std::optional<LawSpec> only_law(const SelectionOptions& selection);

[[nodiscard]] SelectionOptions selection_options(const FitOptions& options);

/// --reference for recordings: a depth, or a change of relative length.
void set_reference(const FitOptions& options, const std::vector<PreparedRecording>& recordings,
                   SelectionOptions& selection);

/// A probe goes with recordings of a force over a depth alone.
void require_indentation(const FitOptions& options,
                         const std::vector<PreparedRecording>& recordings);

/// --folder, or NAME_fit after the recording or the folder of recordings.
[[nodiscard]] std::string figure_folder(const FitOptions& options, const std::string& input);

/// Announces the files of recordings.
void announce_figures(const FitOptions& options, const std::string& input,
                      std::initializer_list<const char*> names);

void write_moduli(const std::filesystem::path& folder, const std::optional<YoungModuli>& moduli,
                  std::vector<std::string>& files);

/// Appends the moduli, if there are any, to the answer in both forms.
void append_moduli(Json& json, std::string& text, const std::optional<YoungModuli>& moduli);

/// The answer: as JSON, the short text, or with --verbose `text`; each with the files at its end.
[[nodiscard]] std::string answer_with_files(const FitOptions& options, const Session& session,
                                            Json json, std::string text, ShortAnswer answer,
                                            const std::string& folder,
                                            const std::vector<std::string>& files,
                                            const std::string& next);

/// The page of the figures in a folder that was written.
[[nodiscard]] std::string next_of_figures(const std::string& folder);

/// Each recording of a folder by itself, and the pool of all. Returns the exit code.
int fit_folder(const FitOptions& options, const Session& session);

/// Two folders (--compare). Returns the exit code.
int compare_folders(const FitOptions& options, const Session& session);

}  // namespace tpm::app
