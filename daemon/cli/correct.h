#pragma once
// Command cellcal correct: corrects poses or a program.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/cli/backup.h"
#include "daemon/krl/correct_program.h"

namespace cellcal::daemon {

struct CorrectCommand {
  std::filesystem::path calibration, output;
  std::filesystem::path poses;  ///< a CSV, or
  std::string on;  ///< axis of the positioner whose frame the poses are in; empty: the base frame
  std::filesystem::path backup;        ///< all programs of a controller: folder or ZIP, or
  std::filesystem::path program, dat;  ///< a .src; dat empty: next to it, if it exists
  std::vector<std::filesystem::path>
      controller;  ///< $config.dat, $machine.dat, .src of called routines
  std::vector<std::string> leave;
  std::vector<std::string> still;  ///< routines that neither move nor set frames
  std::filesystem::path from;      ///< calibration of the arm that the points were taught on
  bool upload = false;             ///< touched-up points become those of the nominal arm
  bool anywhere = false, withheld = false, json = false;
  bool force = false;               ///< replace existing program files in `output`
  bool at_run_time = false;         ///< rewrite the motions, and write CELLCAL_FIX
  int serial = 0;                   ///< of the robot, for CELLCAL_FIX
  std::filesystem::path restore;    ///< a .src whose motions go back to what they were
  bool nominal_controller = false;  ///< the controller computes with the robot file's model
};
int correct(const CorrectCommand& command);

int correct_poses(const CorrectCommand& command, const calib::Calibration& calibration);
int correct_krl(const CorrectCommand& command, const calib::Calibration& calibration,
                const calib::Calibration* from = nullptr);
int correct_backup_files(const CorrectCommand& command, const calib::Calibration& calibration,
                         const calib::Calibration* from = nullptr);

int correct_at_run_time(const CorrectCommand& command, const calib::Calibration& calibration);
int restore_program(const CorrectCommand& command);

/// A program with its .dat and the other programs of its folder.
krl::ProgramFiles read_program_files(const std::filesystem::path& program,
                                     const std::filesystem::path& dat,
                                     const std::vector<std::filesystem::path>& controller);

/// As names of KRL.
std::vector<std::string> upper(std::vector<std::string> names);

/// Each .src with the .dat of the same name; the controller's own data; other .dat files.
krl::BackupFiles modules_of(std::vector<krl::KrlFile> files);
/// Those of --backup with the files of --config, which are added to `backup`. Throws calib::FileError without a program
/// in it, or if one is corrected already.
krl::BackupFiles programs_of(const CorrectCommand& command, Backup& backup);
/// Files that are no KRL.
std::vector<krl::LeftPoint> files_left(const Backup& backup);
/// $config.dat and the like of --config, by absolute path.
std::vector<krl::KrlFile> controller_files(const CorrectCommand& command);

// Common to the reports.
krl::CorrectionOptions correction_options(const CorrectCommand& command,
                                          const calib::Calibration* from);
/// Tools with the largest u95 of their points, what stays, and where the robot stands is not stated.
std::string stated_words(const krl::Corrected& result);
nlohmann::json left_json(const std::vector<krl::LeftPoint>& left);
nlohmann::json tool_json(const krl::ToolUsed& tool);
/// In records: the load of LOAD_DATA that the points were corrected with.
inline constexpr const char* kOwnLoad = "the tool's own";
std::string load_name(const krl::ToolUsed& tool);
/// `state`: "corrected", "left", "refused", "no motion". Ends with a line break.
std::string module_line(const std::string& state, const std::string& src,
                        const calib::Phrase& what);
/// Number of a module's refusals; print_refused_modules() prints the reasons.
calib::Phrase refused_phrase(std::size_t refusals);
nlohmann::json point_json(const krl::CorrectedPoint& point);
nlohmann::json refusals_json(const std::vector<krl::Refusal>& refusals, const calib::Robot& robot);
/// Prints the refusals to the standard error, the first 30 of them.
void print_refusals(const std::vector<krl::Refusal>& refusals, const calib::Robot& robot);
/// Prints those of modules that move, and how many modules stay; kNotPublishable where there is one.
int print_refused_modules(const std::vector<std::vector<krl::Refusal>>& of_moving,
                          const calib::Robot& robot, bool at_run_time = false);
template <class Module>
std::vector<std::vector<krl::Refusal>> refusals_of_moving(const std::vector<Module>& modules) {
  std::vector<std::vector<krl::Refusal>> all;
  for (const Module& module : modules)
    if (module.motions > 0) all.push_back(module.refusals);
  return all;
}
/// Prints the warnings, and one of points that were taught by another model than may be in force, to the standard
/// error; in English for JSON.
nlohmann::json warned(std::vector<calib::Phrase> warnings, const CorrectCommand& command,
                      const calib::Robot& robot, const std::vector<krl::CorrectedPoint>& points);

// Record WELD.corrected.json of a corrected WELD.src, cellcal.corrected.json of a corrected backup: the changes and
// their calibration. Correcting twice displaces the arm by the same amount again, and the program itself carries no
// mark.

/// Throws calib::FileError if a record next to the files, by their names in the folder, lists one of them as the result
/// of a correction with another calibration than that of --from or --upload, or cannot be read.
void refuse_corrected(const CorrectCommand& command, const std::filesystem::path& folder,
                      const std::vector<krl::KrlFile>& files);

/// Throws for an existing file without --force.
void refuse_to_replace(const CorrectCommand& command, const std::filesystem::path& place);
/// Writes the corrected files, `more` by their names in the output folder, and a record of `report`, to which the
/// places are added as `written`; returns these as lines. Nothing without corrected files or output folder. All or none:
/// throws where a file is one that was read, exists without --force, or is not KRL.
std::string write_corrected(const CorrectCommand& command, const std::vector<krl::KrlFile>& read,
                            const std::vector<krl::KrlFile>& corrected,
                            const std::vector<krl::KrlFile>& more, nlohmann::json& report);

}  // namespace cellcal::daemon
