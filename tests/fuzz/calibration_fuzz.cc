// Any text as a calibration: refused with FileError, or predicts without errors and can be written
// again. Also replayed over calibration_corpus as an ordinary test.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "calib/estimate/predict.h"
#include "calib/files/calibration_json.h"
#include "calib/model/error.h"

namespace {

using namespace cellcal::calib;  // NOLINT: a fuzz target's own file

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Calibration calibration;
  try {
    calibration = calibration_from_json({reinterpret_cast<const char*>(data), size}, "fuzz.json");
  } catch (const FileError&) {
    return 0;
  }
  const Predictor predictor(calibration);
  const std::vector<double> zero(calibration.cell.robot.joints.size(), 0.0);
  const Prediction prediction = predictor.calibrated(zero);
  require(!(prediction.u95_m < 0.0), "a bound is not negative");
  const Calibration again = calibration_from_json(calibration_to_json(calibration), "again.json");
  require(again.parameters.size() == calibration.parameters.size(),
          "what was read can be written and read");
  return 0;
}
