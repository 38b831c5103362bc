#include "tests/daemon/krl/emulated_controller.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "calib/model/inverse.h"
#include "calib/model/units.h"

namespace cellcal::daemon::testing {

namespace {

using calib::JointVector;
using Eigen::Isometry3d;
using Eigen::Vector3d;

std::string text(const calib::FrameMmDeg& f) {
  return fmt::format("X {:.4f},Y {:.4f},Z {:.4f},A {:.5f},B {:.5f},C {:.5f}", f.xyz_mm[0],
                     f.xyz_mm[1], f.xyz_mm[2], f.abc_deg[0], f.abc_deg[1], f.abc_deg[2]);
}

/// Intersection of axes 4, 5 and 6: the origin of axis 5.
Vector3d wrist(const calib::ArmModel& arm, const JointVector& q, Vector3d* shoulder = nullptr) {
  calib::ArmChain chain;
  arm.walk(arm.prepare(q), arm.errors(nullptr), chain);
  if (shoulder != nullptr) *shoulder = chain.link[1].z_origin;
  return chain.link[4].z_origin;
}

/// A3 at which the wrist is farthest from axis 2, by a coarse and a fine search.
double stretched(const calib::ArmModel& arm) {
  double at = 0.0;
  for (double step = 0.02, width = 1.0; step > 1e-6; width = 2.0 * step, step /= 50.0) {
    const double middle = at;
    double farthest = 0.0;
    for (double a3 = middle - width; a3 <= middle + width; a3 += step) {
      Vector3d shoulder;
      const double far = (wrist(arm, {0.0, 0.0, a3, 0.0, 0.0, 0.0}, &shoulder) - shoulder).norm();
      if (far <= farthest) continue;
      farthest = far;
      at = a3;
    }
  }
  return at;
}

calib::ArmModel arm_with(const calib::Robot& robot, const Isometry3d& tool) {
  calib::Tool tip;
  tip.tcp = tool;
  return {robot, tip};
}

}  // namespace

double stretched_a3(const calib::Robot& robot) { return stretched(calib::ArmModel(robot, {})); }

StatusAndTurn status_and_turn(const calib::Robot& robot, const JointVector& q) {
  const calib::ArmModel arm(robot, {});
  return status_and_turn(arm, stretched(arm), q);
}

StatusAndTurn status_and_turn(const calib::ArmModel& arm, double stretched_rad,
                              const JointVector& q) {
  StatusAndTurn result;
  // A1 rotates clockwise as seen from above.
  const Vector3d ahead(std::cos(q[0]), -std::sin(q[0]), 0.0);
  if (wrist(arm, q).dot(ahead) < 0.0) result.status |= 1;
  if (q[2] >= stretched_rad) result.status |= 2;
  if (q[4] < 0.0) result.status |= 4;
  for (std::size_t i = 0; i < 6; ++i)
    if (q[i] < 0.0) result.turn |= 1 << i;
  return result;
}

KrlProgram taught(const calib::Robot& robot, const Frames& frames,
                  const std::vector<JointVector>& points) {
  const calib::ArmModel arm = arm_with(robot, frames.tool);
  KrlProgram p;
  p.config =
      "DEFDAT  $CONFIG PUBLIC\r\nDECL E6AXIS XHOME={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 0.0,"
      "A6 0.0,E1 0.0}\r\nDECL FDAT FHOME={TOOL_NO 0,BASE_NO 0,IPO_FRAME #BASE}\r\nTOOL_DATA[1]={" +
      text(calib::to_frame(frames.tool)) + "}\r\nTOOL_NAME[1,]=\"Fr\xe4ser\"\r\nBASE_DATA[3]={" +
      text(calib::to_frame(frames.base)) + "}\r\nENDDAT\r\n";
  p.src =
      "&ACCESS RVP\r\n&REL 7\r\nDEF weld( )\r\n;FOLD INI;%{PE}\r\nBAS (#INITMOV,0)\r\n;ENDFOLD (INI)\r\n"
      "\r\n;FOLD PTP HOME Vel=100 % DEFAULT;%{PE}%R 8.3.44,%MKUKATPBASIS,%CMOVE,%VPTP\r\n"
      "$BWDSTART=FALSE\r\nPDAT_ACT=PDEFAULT\r\nFDAT_ACT=FHOME\r\nBAS(#PTP_PARAMS,100)\r\nPTP XHOME\r\n;ENDFOLD\r\n"
      "; N\xe4hte am St\xfc"
      "ck\r\n";
  p.dat = "&ACCESS RVP\r\nDEFDAT WELD\r\nEXT BAS (BAS_COMMAND :IN,REAL :IN )\r\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [s, t] = status_and_turn(robot, points[i]);
    const auto frame = calib::to_frame(frames.base.inverse() * arm.nominal_tcp(points[i]));
    const std::size_t n = i + 1;
    // LIN keeps its initial posture.
    const bool line = i % 2 == 1 && status_and_turn(robot, points[i - 1]).status == s;
    p.dat += fmt::format(
        "DECL E6POS XP{0}={{{1},S {2},T {3},E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}}\r\n"
        "DECL FDAT FP{0}={{TOOL_NO 1,BASE_NO 3,IPO_FRAME #BASE,POINT2[] \" \",TQ_STATE FALSE}}\r\n"
        "DECL {4}\r\n",
        n, text(frame), s, t,
        line ? fmt::format("LDAT LCPDAT{}={{VEL 2.0,ACC 100.0,APO_DIST 100.0}}", n)
             : fmt::format("PDAT PPDAT{}={{VEL 100.0,ACC 100.0,APO_DIST 100.0}}", n));
    p.src += fmt::format(
        ";FOLD {1} P{0} Vel={2} {3}PDAT{0} Tool[1]:torch Base[3] ;%{{PE}}%R "
        "8.3.44,%MKUKATPBASIS,%CMOVE\r\n$BWDSTART=FALSE\r\n{4}\r\nFDAT_ACT=FP{0}\r\n{5}\r\n{1} "
        "XP{0}{6}\r\n;ENDFOLD\r\n",
        n, line ? "LIN" : "PTP", line ? "2 m/s" : "100 %", line ? "C" : "",
        line ? fmt::format("LDAT_ACT=LCPDAT{}", n) : fmt::format("PDAT_ACT=PPDAT{}", n),
        line ? "BAS(#CP_PARAMS,2)" : "BAS(#PTP_PARAMS,100)", line ? " C_DIS" : "");
  }
  p.dat += "ENDDAT\r\n";
  p.src += "END\r\n";
  return p;
}

std::vector<JointVector> run(const calib::Robot& robot, const Frames& frames,
                             const std::string& dat) {
  const calib::ArmModel arm = arm_with(robot, frames.tool);
  const calib::Configurations ways(arm, 0.0);
  std::vector<JointVector> all;
  for (int n = 1;; ++n) {
    const std::string head = fmt::format("E6POS XP{}={{", n);
    const auto at = dat.find(head);
    if (at == std::string::npos) return all;
    calib::FrameMmDeg f;
    int s = 0, t = 0;
    if (std::sscanf(dat.c_str() + at + head.size(), "X %lf,Y %lf,Z %lf,A %lf,B %lf,C %lf,S %d,T %d",
                    &f.xyz_mm[0], &f.xyz_mm[1], &f.xyz_mm[2], &f.abc_deg[0], &f.abc_deg[1],
                    &f.abc_deg[2], &s, &t) != 8)
      return all;
    JointVector taken;
    constexpr double kTurn = 2.0 * std::numbers::pi;
    for (JointVector q : ways.reach(frames.base * calib::to_isometry(f))) {
      if (status_and_turn(robot, q).status != s) continue;
      bool inside = true;
      for (std::size_t i = 0; i < 6; ++i) {
        const bool below = (t >> i & 1) != 0;
        if ((q[i] < 0.0) != below) q[i] += below ? -kTurn : kTurn;
        inside = inside && q[i] >= robot.joints[i].min_rad && q[i] <= robot.joints[i].max_rad;
      }
      if (inside) taken = q;
    }
    all.push_back(taken);
  }
}

}  // namespace cellcal::daemon::testing
