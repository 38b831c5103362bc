#pragma once
// cellcal correct: poses, or a program.

#include <filesystem>
#include <string>
#include <vector>

#include "calib/result/calibration.h"

namespace cellcal::daemon {

struct CorrectCommand {
  std::filesystem::path calibration, output;
  std::filesystem::path poses;                    ///< a CSV, or
  std::filesystem::path program, dat;             ///< a .src; dat empty: beside it, where it is
  std::vector<std::filesystem::path> controller;  ///< $config.dat, $machine.dat
  std::vector<std::string> leave;
  bool anywhere = false, withheld = false, json = false;
  bool force = false;  ///< a program's files replace others in `output`
};
int correct(const CorrectCommand& command);

int correct_poses(const CorrectCommand& command, const calib::Calibration& calibration);
int correct_krl(const CorrectCommand& command, const calib::Calibration& calibration);

}  // namespace cellcal::daemon
