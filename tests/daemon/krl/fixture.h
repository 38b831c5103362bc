#pragma once
// A program of the demo cell, a calibration of its arm, and both ways of correction.

#include <cstdio>
#include <string>
#include <vector>

#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "daemon/krl/correct_program.h"
#include "tests/calib/random_calibration.h"
#include "tests/calib/simulate.h"
#include "tests/daemon/krl/emulated_controller.h"

namespace cellcal::daemon::testing {

inline const calib::Cell& cell() { return calib::testing::demo_cell(); }

inline Frames frames() {
  Frames f;
  f.tool = calib::to_isometry({{59.9, 50.5, 410.3}, {38.84, 3.59, 0.0}});  // the cell's
  f.base = calib::to_isometry({{700.0, -250.0, 300.0}, {30.0, 2.0, -1.0}});
  return f;
}

/// Over the whole range of the joints, away from the singularities.
inline std::vector<calib::JointVector> postures(int count, unsigned seed = 1) {
  calib::Random random(seed);
  std::vector<calib::JointVector> all;
  const calib::ArmModel arm(cell());
  while (static_cast<int>(all.size()) < count) {
    calib::JointVector q;
    for (const calib::Joint& joint : cell().robot.joints)
      q.push_back(random.uniform(joint.min_rad + 0.1, joint.max_rad - 0.1));
    const auto j = arm.nominal_jacobian(q);
    if (std::abs((j * j.transpose()).determinant()) > 1e-2) all.push_back(q);
  }
  return all;
}

/// {X ...,S 2,T 19} of the demo cell's tool in the robot's base, with or without S and T.
inline std::string pose_text(const calib::JointVector& q, bool status = true) {
  const auto at = calib::to_frame(calib::ArmModel(cell()).nominal_tcp(q));
  const StatusAndTurn st = status_and_turn(cell().robot, q);
  char text[250];
  std::snprintf(text, sizeof text, "{X %.4f,Y %.4f,Z %.4f,A %.5f,B %.5f,C %.5f", at.xyz_mm[0],
                at.xyz_mm[1], at.xyz_mm[2], at.abc_deg[0], at.abc_deg[1], at.abc_deg[2]);
  return text +
         (status ? ",S " + std::to_string(st.status) + ",T " + std::to_string(st.turn) : "") + "}";
}

inline krl::ProgramFiles files(const KrlProgram& program) {
  return {{"weld.src", program.src},
          krl::KrlFile{"weld.dat", program.dat},
          {{"$config.dat", program.config}}};
}

inline calib::Calibration calibration(unsigned seed = 1, double scale = 1.0) {
  calib::Random random(seed);
  return calib::testing::random_calibration(cell(), random, scale);
}

inline std::string all_words(const krl::CorrectedProgram& result) {
  std::string all;
  for (const krl::Refusal& one : result.refusals) all += words(one, cell().robot) + "\n";
  return all;
}

}  // namespace cellcal::daemon::testing
