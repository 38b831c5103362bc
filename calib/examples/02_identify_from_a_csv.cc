// From touches to a calibration.
//   02_identify_from_a_csv cell.toml touches.csv calibration.json
#include <exception>
#include <fstream>
#include <iostream>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/files/robot_file.h"
#include "calib/identify/identify.h"
#include "calib/result/finding.h"

int main(int argc, char** argv) try {
  using namespace cellcal::calib;
  if (argc != 4) {
    std::cerr << "02_identify_from_a_csv CELL TOUCHES RESULT\n";
    return 2;
  }
  const Cell cell = load_cell(argv[1]);
  // With the shipped robots a withheld result can name a robot file that would fit.
  const Calibration result = identify(cell, load_touches(argv[2], cell), {}, shipped_robots);
  std::ofstream(argv[3]) << calibration_to_json(result);
  std::cout << "touches   " << result.after.count << ", residual " << 1e3 * result.before.mean_m
            << " -> " << 1e3 * result.after.mean_m << " mm (mean)\n"
            << "published " << (result.verdict.publish() ? "yes" : "no") << '\n';
  for (const auto& reason : words(result.verdict.findings)) std::cout << "  " << reason << '\n';
  return result.verdict.publish() ? 0 : 3;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
