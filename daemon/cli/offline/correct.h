#pragma once
// cellcal correct: poses, or a program.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/krl/correct_program.h"

namespace cellcal::daemon {

struct CorrectCommand {
  std::filesystem::path calibration, output;
  std::filesystem::path poses;                    ///< a CSV, or
  std::filesystem::path program, dat;             ///< a .src; dat empty: beside it, where it is
  std::vector<std::filesystem::path> controller;  ///< $config.dat, $machine.dat, .src of called routines
  std::vector<std::string> leave;
  std::vector<std::string> still;                 ///< routines that neither move nor set frames
  bool anywhere = false, withheld = false, json = false;
  bool force = false;  ///< a program's files replace others in `output`
};
int correct(const CorrectCommand& command);

int correct_poses(const CorrectCommand& command, const calib::Calibration& calibration);
int correct_krl(const CorrectCommand& command, const calib::Calibration& calibration);

// WELD.corrected.json beside a corrected WELD.src: what was changed, by which calibration. Whoever corrects a
// program twice sends the arm as far to the other side, and the program itself carries no mark.

std::filesystem::path record_beside(std::filesystem::path src);

/// Throws calib::FileError where the record beside the program says that `files` are what a correction wrote, and where
/// it cannot be read: nobody knows then.
void refuse_corrected(const krl::ProgramFiles& files);

/// The report with the SHA-256 of each file as it was read and as it was written.
nlohmann::json corrected_record(nlohmann::json report, const krl::ProgramFiles& read,
                                const std::vector<krl::KrlFile>& written);

}  // namespace cellcal::daemon
