#pragma once
// Model levels: which of the arm's imperfections a fit may explain the touches with. Geometry and
// the bending of the tool are always in it.
//
// Beyond them: joint compliance; play, closed by the load; transmission error, smooth in the joint angle (a few harmonics per
// joint); and ripple, transmission error too fast to be followed from touch to touch, which acts as
// joint noise. They are in every arm whether or not its file names them: they are the discrepancy
// between a geometric model and a real arm, and leaving them out is what makes stated bounds too
// small. What the file leaves open is assumed: masses by the links' lengths, compliance by the
// load, harmonics of orders 1 to 4, each the smaller the higher.

#include <span>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/model/touch.h"

namespace cellcal::calib {

struct Calibration;
struct ModelLevel {
  /// Prior of the compliances in units of the robot file's or the assumed ones; 0: stiff joints.
  double compliance = 1.0;
  /// Prior of the smooth transmission error in units of the robot file's (10 arcsec where it names
  /// none); 0: none.
  double transmission = 1.0;
  double ripple_rad = 0.0;  ///< 1 sigma per joint
  double play = 0.0;        ///< prior of the play in units of the usual, 30 arcsec; 0: none
  bool operator==(const ModelLevel&) const = default;
};

/// Everything that an arm may do. An estimate begins without the play.
inline constexpr ModelLevel kFullestLevel{1.0, 1.0, 0.0, 1.0};

/// One level that was considered, and how well it explains the touches.
struct LevelEvidence {
  ModelLevel level;
  double log_evidence = 0.0;  ///< natural logarithm, prior of the level included
  double probability = 0.0;   ///< among all levels considered
};

/// How the level was taken that a calibration's parameters belong to.
enum class LevelChoice {
  kNone,  ///< by methods that know no levels
  kAskedFor,
  kMeanByEvidence,     ///< of all that were considered
  kNothingIdentified,  ///< the nominal arm
  kRecorded            ///< in the words of a file that holds no more
};
struct LevelReason {
  LevelChoice choice = LevelChoice::kNone;
  std::string text = {};  ///< kRecorded
  bool operator==(const LevelReason&) const = default;
};

/// The cell with the priors of this level; the files' own where the level leaves them alone.
Cell at_level(const Cell& cell, const ModelLevel& level);
/// The same for an estimate from these touches: tools beside the first that none of them is of stay
/// as they are stated.
Cell at_level(const Cell& cell, const ModelLevel& level, std::span<const Touch> touches);

/// "geometry, tool bending, joint compliance, transmission 10 arcsec, ripple 5 arcsec"
std::string words(const Cell& cell, const ModelLevel& level);

// Why a model level was taken.

/// "mean over 24 levels, weighted by evidence. Joint compliance: 0.1 x prior (2 %), ...";
/// empty of methods that know no levels.
std::string reason_words(const Calibration& calibration);
/// The same after the level itself, as files have it.
std::string level_and_reason_words(const Calibration& calibration);

}  // namespace cellcal::calib
