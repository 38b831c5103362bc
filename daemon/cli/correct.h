#pragma once
// Command cellcal correct: poses, or a program.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/krl/correct_program.h"

namespace cellcal::daemon {

struct CorrectCommand {
  std::filesystem::path calibration, output;
  std::filesystem::path poses;         ///< CSV; alternative to a program
  std::filesystem::path program, dat;  ///< .src; dat empty: in the same directory, if any
  std::vector<std::filesystem::path> controller;  ///< $config.dat, $machine.dat
  std::vector<std::string> leave;
  bool anywhere = false, withheld = false, json = false;
  bool force = false;  ///< replace existing program files in `output`
};
int correct(const CorrectCommand& command);

int correct_poses(const CorrectCommand& command, const calib::Calibration& calibration);
int correct_krl(const CorrectCommand& command, const calib::Calibration& calibration);

// Record WELD.corrected.json of a corrected WELD.src: the changes and their calibration. Correcting twice
// displaces the arm by the same amount again, and the program itself carries no mark.

std::filesystem::path record_beside(std::filesystem::path src);

/// Throws calib::FileError where the record in the program's directory lists `files` as results of a
/// correction, or cannot be read.
void refuse_corrected(const krl::ProgramFiles& files);

/// The report, with the SHA-256 of each file as read and as written.
nlohmann::json corrected_record(nlohmann::json report, const krl::ProgramFiles& read,
                                const std::vector<krl::KrlFile>& written);

}  // namespace cellcal::daemon
