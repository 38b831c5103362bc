// Any text as priors of a fleet: refused with FileError, or read as spreads valid in a robot file, and
// written such that they are read back equal. Also replayed over priors_corpus as an ordinary test.

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "calib/files/cell_file.h"
#include "calib/files/priors_file.h"
#include "calib/files/robot_file.h"
#include "calib/model/error.h"
#include "calib/priors/learn.h"

namespace {

using namespace cellcal::calib;  // NOLINT: a fuzz target's own file

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

/// An arm with these joints.
Robot robot_of(const FleetPriors& priors) {
  Robot robot;
  robot.name = "fuzzed";
  for (const JointPriors& prior : priors.joints) {
    Joint joint;
    joint.name = prior.joint;
    joint.errors = {JointError::kTheta};
    joint.max_rad = 1.0;
    joint.d_m = 0.4;
    joint.tolerance_length_m = joint.tolerance_angle_rad = 1e-3;
    joint.compliance_sigma_rad_per_nm = 1e-5;
    robot.joints.push_back(joint);
  }
  return robot;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FleetPriors priors;
  try {
    priors = parse_priors({reinterpret_cast<const char*>(data), size}, "fuzz.toml");
  } catch (const FileError&) {
    return 0;
  }
  require(priors.arms > 0 && !priors.joints.empty(), "priors are of arms and joints");
  for (const JointPriors& joint : priors.joints)
    for (const auto& spread : joint.spreads)
      require(!spread || (std::isfinite(offered(*spread)) && offered(*spread) >= spread->found),
              "what is offered is a number, and wider than what was found");
  const FleetPriors again = parse_priors(priors_to_toml(priors), "again.toml");
  require(again.joints.size() == priors.joints.size(), "what was read can be written and read");
  const Robot robot = robot_of(priors);
  FleetPriors own = priors;
  own.nominal_geometry = nominal_geometry_sha256(robot);
  require(std::holds_alternative<Accepted>(accept(robot, own)),
          "priors of the nominal geometry are accepted");
  require(std::holds_alternative<OtherNominalGeometry>(accept(robot, priors)) ||
              own.nominal_geometry == priors.nominal_geometry,
          "those of another are not");
  return 0;
}
