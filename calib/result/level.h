#pragma once
// Model levels: the imperfections of the arm that a fit may use to explain the touches. Geometry and bending of the
// tool are always included.
//
// Further ones: joint compliance; play, closed by the load; smooth transmission error in the joint angle (a few
// harmonics per joint); and ripple, transmission error that varies too fast to be tracked between touches and acts as
// joint noise. Every arm has them whether or not its file names them: they are the discrepancy between a geometric
// model and a real arm, and omitting them makes the stated bounds too small. Values that the file leaves open are
// assumed: masses by the links' lengths, compliance by the load, harmonics of orders 1 to 4 with decreasing amplitudes.

#include <span>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/model/touch.h"

namespace cellcal::calib {

struct Calibration;
struct ModelLevel {
  /// Prior of the compliances relative to the robot file's or the assumed ones; 0: rigid joints.
  double compliance = 1.0;
  /// Prior of the smooth transmission error relative to the robot file's (default 10 arcsec); 0:
  /// none.
  double transmission = 1.0;
  double ripple_rad = 0.0;  ///< 1 sigma per joint
  double play = 0.0;        ///< prior of the play relative to the default, 30 arcsec; 0: none
  bool operator==(const ModelLevel&) const = default;
};

/// All imperfections. An estimate starts without the play.
inline constexpr ModelLevel kFullestLevel{1.0, 1.0, 0.0, 1.0};

/// One level considered, and its evidence.
struct LevelEvidence {
  ModelLevel level;
  double log_evidence = 0.0;  ///< natural logarithm, including the level's prior
  double probability = 0.0;   ///< among all levels considered
};

/// Selection of the level of a calibration's parameters.
enum class LevelChoice {
  kNone,  ///< methods without levels
  kAskedFor,
  kMeanByEvidence,     ///< of all levels considered
  kNothingIdentified,  ///< the nominal arm
  kRecorded            ///< text of a file without kinds
};
struct LevelReason {
  LevelChoice choice = LevelChoice::kNone;
  std::string text = {};  ///< kRecorded
  bool operator==(const LevelReason&) const = default;
};

/// The cell with the priors of this level; unaffected priors are the files' own.
Cell at_level(const Cell& cell, const ModelLevel& level);
/// For an estimate from these touches: further tools without touches keep their stated values.
Cell at_level(const Cell& cell, const ModelLevel& level, std::span<const Touch> touches);

/// "geometry, tool bending, joint compliance, transmission 10 arcsec, ripple 5 arcsec"
std::string words(const Cell& cell, const ModelLevel& level);

/// The level and the reason for its selection, as in files.
std::string level_and_reason_words(const Calibration& calibration);

}  // namespace cellcal::calib
