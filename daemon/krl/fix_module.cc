#include "daemon/krl/fix_module.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <span>

#include "calib/model/error.h"
#include "calib/model/inverse.h"
#include "calib/model/linear.h"
#include "daemon/krl/carriers.h"
#include "daemon/krl/controller_view.h"
#include "daemon/krl/fix_lines.h"
#include "drivers/kuka/krl/krl_template.h"

namespace cellcal::daemon::krl {

/// cellcal_fix.src.in and what follows it for external axes, compiled in by the build.
extern const std::string_view kFixTemplate, kFixExternalTemplate;

namespace {

using calib::ArmModel;
using calib::ArmParameter;
using calib::FrameMmDeg;
using calib::kDegPerRad;
using calib::kMmPerM;
using calib::ParameterKind;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr std::size_t kJoints = 6, kMostTools = 64;
/// A load that moves the TCP of the cell file's tool by less is that of this tool.
constexpr double kOwnLoadMm = 0.1;
/// Scale of directions in the module: points 1 m along them.
constexpr double kAlongMm = 1000.0;
constexpr double kTiltDeg = kDegPerRad / kAlongMm;
/// Orders per turn that the table holds; faster waves are computed one by one.
constexpr int kHighestInTable = calib::kFastestOrder;

/// The joints that turn: a linear unit is written by fix_external.cc.
std::span<const calib::Joint> arm_of(const calib::Robot& robot) {
  return std::span(robot.joints).subspan(robot.first_turning());
}

/// The calibrated arm as the module computes with it.
struct Wave {
  int joint = 0;
  double per_turn = 0.0, cosine_rad = 0.0, sine_rad = 0.0;
};
struct Joints {
  struct One {
    Isometry3d nominal, real;  ///< behind the turn about the axis
    double sign = 1.0, offset_rad = 0.0, theta_rad = 0.0, mass_kg = 0.0;
    Vector3d com_m = Vector3d::Zero();
    double compliance = 0.0, play_rad = 0.0, stiffening_rad = 0.0, tilt_x = 0.0, tilt_y = 0.0;
  };
  std::array<One, kJoints> joint;
  std::map<std::pair<int, int>, Vector3d> loads;  ///< by joint and link
  std::map<std::pair<int, double>, Wave> waves;   ///< by joint and periods per turn of the axis
  int first = 0;                                  ///< of them in the robot's

  /// Index among these of a joint of the robot; negative: none.
  int of(int joint) const { return joint - first; }
};

Isometry3d behind(double d, double a, double alpha, double beta) {
  Isometry3d result = Isometry3d::Identity();
  result.translate(Vector3d(a, 0.0, d));
  result.rotate(Eigen::AngleAxisd(alpha, Vector3d::UnitX()));
  result.rotate(Eigen::AngleAxisd(beta, Vector3d::UnitY()));
  return result;
}

void add_wave(const ArmModel& arm, const ArmParameter& p, double x, Joints& joints) {
  const bool of_gear = p.kind == ParameterKind::kCosine || p.kind == ParameterKind::kSine;
  const int joint = joints.of(p.joint);
  const auto at = static_cast<std::size_t>(joint);
  const double per_turn = p.harmonic * (of_gear ? arm_of(arm.robot())[at].gear_ratio : 1.0);
  Wave& wave = joints.waves[{joint, per_turn}];
  wave.joint = joint;
  wave.per_turn = per_turn;
  const bool cosine = p.kind == ParameterKind::kCosine || p.kind == ParameterKind::kFunctionCosine;
  (cosine ? wave.cosine_rad : wave.sine_rad) += x;
}

/// Errors that depend on the posture. No kind is left to a default: one that the module lacks must not go unnoticed.
void add_by_posture(const ArmModel& arm, const ArmParameter& p, double x, Joints& joints) {
  const int joint = joints.of(p.joint);
  if (joint < 0) return;
  Joints::One& one = joints.joint[static_cast<std::size_t>(joint)];
  switch (p.kind) {
    case ParameterKind::kCompliance: one.compliance = x; break;
    case ParameterKind::kPlay: one.play_rad = x; break;
    case ParameterKind::kStiffening: one.stiffening_rad = x; break;
    case ParameterKind::kLoad:
      joints.loads.try_emplace({joint, joints.of(p.link)}, Vector3d::Zero())
          .first->second[p.axis] += x;
      break;
    case ParameterKind::kBearing: (p.axis == 0 ? one.tilt_x : one.tilt_y) = x; break;
    case ParameterKind::kCosine:
    case ParameterKind::kSine:
    case ParameterKind::kFunctionCosine:
    case ParameterKind::kFunctionSine: add_wave(arm, p, x, joints); break;
    case ParameterKind::kTheta:
    case ParameterKind::kD:
    case ParameterKind::kA:
    case ParameterKind::kAlpha:
    case ParameterKind::kBeta:
    case ParameterKind::kDeflection:
    case ParameterKind::kTcp: break;  // errors() has them
    case ParameterKind::kGuide:
    case ParameterKind::kPositioner: break;  // fix_external.cc has them
    case ParameterKind::kEffectiveRadius:
    case ParameterKind::kLatchDelay:
    case ParameterKind::kCentre:
    case ParameterKind::kTilt:
    case ParameterKind::kShift:
    case ParameterKind::kTurn:
    case ParameterKind::kRadius:
    case ParameterKind::kProbeTurn: break;  // not of the arm
  }
}

Joints joints_of(const ArmModel& arm, const Eigen::VectorXd& x) {
  const calib::ArmErrors errors = arm.errors(x.data());
  Joints joints;
  joints.first = static_cast<int>(arm.robot().first_turning());
  for (std::size_t i = 0; i < kJoints; ++i) {
    const calib::Joint& joint = arm_of(arm.robot())[i];
    const calib::ArmErrors::OfJoint& its = errors.joint[arm.robot().first_turning() + i];
    Joints::One& one = joints.joint[i];
    one.nominal = behind(joint.d_m, joint.a_m, joint.alpha_rad, joint.beta_rad);
    one.real = behind(its.d_m, its.a_m, std::atan2(its.sin_alpha, its.cos_alpha),
                      std::atan2(its.sin_beta, its.cos_beta));
    one.sign = joint.sign;
    one.offset_rad = joint.offset_rad;
    one.theta_rad = its.theta_rad;
    one.mass_kg = joint.mass_kg;
    one.com_m = joint.com_m;
  }
  for (int p = 0; p < arm.size(); ++p)
    if (x[p] != 0.0)
      add_by_posture(arm, arm.parameters()[static_cast<std::size_t>(p)], x[p], joints);
  return joints;
}

/// Over the range of the joints.
struct Corrections {
  double most_m = 0.0, most_rad = 0.0;
  std::vector<Vector3d> tips;  ///< real TCP with the last tool, each time in the same postures
};

/// One tool's part of the arm.
FixTool tool_of(const calib::Calibration& calibration, const FrameMmDeg& stated,
                const std::optional<LoadData>& load, Corrections& corrections) {
  const Isometry3d tcp = calib::to_isometry(stated);
  const calib::Calibration c = real_arm(calibration, tcp, load, true);
  const ArmModel arm(at_level(c.cell, c.level));
  const Eigen::VectorXd x = arm_values(arm, c);
  const calib::ArmErrors errors = arm.errors(x.data());
  FixTool tool;
  tool.stated = stated;
  tool.load = load;
  tool.cells = is_the_cells_tool(calibration, tcp);
  tool.tip = arm.tool().tcp;
  tool.tip.translation() = errors.tool[0].tcp_m;
  tool.bend_m_per_accel = errors.tool[0].bend_m_per_accel;
  tool.turn_rad_per_accel = errors.tool[0].turn_rad_per_accel;
  for (int k = 0; k < arm.tool_count(); ++k) {
    tool.mass_kg += arm.tool(k).mass_kg;
    tool.com_m += arm.tool(k).mass_kg * arm.tool(k).com_m;
  }
  if (tool.mass_kg > 0.0) tool.com_m /= tool.mass_kg;
  for (const calib::Joint& joint : arm_of(arm.robot()))
    tool.play_closes_nm.push_back(joint.play_closes_nm);
  calib::Random random(1);
  constexpr int kPostures = 2000;
  corrections.tips.clear();
  for (int k = 0; k < kPostures; ++k) {
    calib::JointVector q;
    for (const calib::Joint& joint : arm.robot().joints)
      q.push_back(random.uniform(joint.min_rad, joint.max_rad));
    Isometry3d nominal = arm.nominal_tcp(q);
    if (tool.cells) nominal = nominal * arm.tool().tcp.inverse() * tcp;
    const Isometry3d real = arm.shape(arm.prepare(q), x.data()).tcp;
    const Isometry3d off = nominal.inverse() * real;
    corrections.tips.push_back(real.translation());
    corrections.most_m = std::max(corrections.most_m, off.translation().norm());
    corrections.most_rad = std::max(corrections.most_rad, calib::turn_vector(off.linear()).norm());
  }
  return tool;
}

double farthest_m(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, (a[i] - b[i]).norm());
  return most;
}

/// The cell's tool as stated and as identified, the bare flange, and the controller's; those for any load last.
std::vector<FixTool> tools_of(const calib::Calibration& c, const Data& data,
                              Corrections& corrections) {
  std::vector<FixTool> all;
  std::vector<Vector3d> own;  ///< tips with the cell's tool
  const auto add = [&](const FrameMmDeg& stated, const std::optional<LoadData>& load) {
    if (std::ranges::any_of(all, [&](const FixTool& t) { return t.is(stated) && t.load == load; }))
      return;
    if (all.size() == kMostTools)
      throw calib::FileError("more than 64 tools. Give a $config.dat with the tools in use");
    FixTool tool = tool_of(c, stated, load, corrections);
    if (all.empty()) own = corrections.tips;
    if (!tool.cells || !load || farthest_m(own, corrections.tips) * kMmPerM > kOwnLoadMm)
      all.push_back(std::move(tool));
  };
  add(calib::to_frame(c.cell.tool.tcp), {});
  add(calib::to_frame(identified_tcp(c)), {});
  add({}, {});
  for (const auto& [number, stated] : data.tools) add(stated, load_of(data, number));
  std::ranges::stable_partition(all, [](const FixTool& one) { return one.load.has_value(); });
  for (FixTool& one : all)
    one.by_load =
        std::ranges::count_if(all, [&](const FixTool& t) { return t.is(one.stated); }) > 1;
  return all;
}

bool in_table(const Wave& wave) {
  return wave.per_turn == std::round(wave.per_turn) && wave.per_turn <= kHighestInTable;
}

/// Sum of a joint's slow waves, and of their second derivatives.
std::pair<double, double> slow_waves(const Joints& joints, int joint, double angle_rad) {
  double sum = 0.0, bent = 0.0;
  for (const auto& [key, wave] : joints.waves) {
    if (wave.joint != joint || !in_table(wave)) continue;
    const double phase = wave.per_turn * angle_rad;
    const double one = wave.cosine_rad * std::cos(phase) + wave.sine_rad * std::sin(phase);
    sum += one;
    bent -= wave.per_turn * wave.per_turn * one;
  }
  return {sum, bent};
}

double reach_m(const calib::Robot& robot, const calib::Tool& tool) {
  double sum = tool.tcp.translation().norm();
  for (const calib::Joint& joint : robot.joints) sum += std::hypot(joint.a_m, joint.d_m);
  return sum;
}

struct Table {
  int steps = 0;  ///< per turn; 0: no joint has slow waves
  double off_m = 0.0;
};

/// As few steps as keep straight lines within 2 um at the arm's reach, at most 720.
Table table_of(const Joints& joints, double reach) {
  if (std::ranges::none_of(joints.waves, [](const auto& one) { return in_table(one.second); }))
    return {};
  double bent = 0.0;
  for (int i = 0; i < static_cast<int>(kJoints); ++i) {
    double most = 0.0;
    constexpr int kSamples = 1440;
    for (int k = 0; k < kSamples; ++k)
      most =
          std::max(most, std::abs(slow_waves(joints, i, k * calib::kRadPerTurn / kSamples).second));
    bent += most;
  }
  constexpr double kOffM = 2e-6;
  constexpr std::array<int, 4> kSteps = {90, 180, 360, 720};
  Table table;
  for (const int steps : kSteps) {
    const double step = calib::kRadPerTurn / steps;
    table = {steps, reach * bent * step * step / 8.0};
    if (table.off_m <= kOffM) break;
  }
  return table;
}

/// Every message, in the order of CCF_STOP.
constexpr std::array<const char*, 11> kMessages = {
    "cellcal_fix.src and .dat are of two calibrations. Copy both again",
    "this robot has another serial number than the calibrated one",
    "no correction for the active tool and load. Correct again with this $config.dat",
    "tool fixed in the cell (IPO_MODE #TCP): not corrected",
    "point not reached when corrected, or near a singularity. Move the point",
    "controller computes another place: machine data, ROBROOT, moving base",
    "correction larger than any of this calibration. Do not go on",
    "posture changes (S). Go there by PTP, or touch up S and T",
    "posture unknown. Begin with a PTP to a point with S and T",
    "relative motion turns in the base: use #TOOL or a point",
    "linear unit or positioner outside of what was calibrated"};

/// The last one is of external axes.
void write_messages(bool external, Lines& out) {
  std::vector<std::string> all;
  for (std::size_t i = 0; i + (external ? 0 : 1) < kMessages.size(); ++i)
    all.push_back(
        fmt::format("{{MODUL[] \"CELLCAL_FIX\",NR {},MSG_TXT[] \"{}\"}}", i + 1, kMessages[i]));
  out.array("KRLMSG_T", "CCF_MSG", all, "");
  out.array("KRLMSGPAR_T", "CCF_PAR", std::vector<std::string>(3, "{PAR_TYPE #EMPTY}"), "");
  out.value("KRLMSGOPT_T", "CCF_OPT",
            "{VL_STOP TRUE,CLEAR_P_RESET TRUE,CLEAR_P_SAW FALSE,LOG_TO_DB TRUE}");
}

/// As KRL counts, from 1.
std::string number(int index) { return std::to_string(index + 1); }
std::string frame_mm(const Vector3d& place_m) { return frame(Vector3d(place_m * kMmPerM)); }

void write_joints(const calib::Robot& robot, const Joints& joints, Lines& out) {
  const auto& all = joints.joint;
  const bool bearings = std::ranges::any_of(
      all, [](const auto& one) { return one.tilt_x != 0.0 || one.tilt_y != 0.0; });
  out.comment("joints: nominal and calibrated, behind their turns; zeros, signs, masses in kg");
  out.value("FRAME", "CCF_F0", frame(robot.base_fixed));
  out.value("FRAME", "CCF_FE", frame(robot.flange_fixed));
  out.each("FRAME", "CCF_KN", all, [](const auto& one) { return frame(one.nominal); });
  out.each("FRAME", "CCF_KR", all, [](const auto& one) { return frame(one.real); });
  out.each("FRAME", "CCF_COM", all, [](const auto& one) { return frame_mm(one.com_m); });
  out.reals("CCF_SIGN", all, [](const auto& one) { return one.sign; });
  out.reals("CCF_ZERO", all, [](const auto& one) { return one.offset_rad * kDegPerRad; });
  out.reals("CCF_D", all, [](const auto& one) { return one.theta_rad * kDegPerRad; });
  out.reals("CCF_M", all, [](const auto& one) { return one.mass_kg; });
  out.comment("what gravity's moment does: degrees per N m, play in degrees");
  out.reals("CCF_K", all, [](const auto& one) { return one.compliance * kDegPerRad; });
  out.reals("CCF_PLAY", all, [](const auto& one) { return one.play_rad * kDegPerRad; });
  out.comment("a gear of rising stiffness: degrees, and one over the N m at which it is stiff");
  out.reals("CCF_STIFF_DEG", all, [](const auto& one) { return one.stiffening_rad * kDegPerRad; });
  out.reals("CCF_STIFF_AT", arm_of(robot),
            [](const calib::Joint& j) { return 1.0 / j.stiffening_nm; });
  out.value("BOOL", "CCF_BEARINGS", truth(bearings));
  out.reals("CCF_TILT_X", all, [](const auto& one) { return one.tilt_x * kTiltDeg; });
  out.reals("CCF_TILT_Y", all, [](const auto& one) { return one.tilt_y * kTiltDeg; });
  const Vector3d& g = robot.gravity_m_s2;
  out.value("REAL", "CCF_GX", real(g.x()));
  out.value("REAL", "CCF_GY", real(g.y()));
  out.value("REAL", "CCF_GZ", real(g.z()));
}

void write_loads(const Joints& joints, Lines& out) {
  const auto& all = joints.loads;
  out.value("INT", "CCF_LOADS", std::to_string(all.size()));
  out.each(
      "INT", "CCF_L_OF", all, [](const auto& one) { return number(one.first.first); }, "1");
  out.each(
      "INT", "CCF_L_ON", all, [](const auto& one) { return number(one.first.second); }, "1");
  out.each(
      "FRAME", "CCF_L_BY", all,
      [](const auto& one) { return frame(Vector3d(one.second.normalized() * kAlongMm)); },
      frame(FrameMmDeg{}));
  out.reals("CCF_L_DEG", all,
            [](const auto& one) { return one.second.norm() * kDegPerRad / (kAlongMm * kAlongMm); });
}

void write_waves(const Joints& joints, const Table& table, Lines& out) {
  std::vector<Wave> fast;
  for (const auto& [key, wave] : joints.waves)
    if (!in_table(wave)) fast.push_back(wave);
  out.value("INT", "CCF_WAVES", std::to_string(fast.size()));
  out.each(
      "INT", "CCF_V_OF", fast, [](const Wave& wave) { return number(wave.joint); }, "1");
  out.reals("CCF_V_H", fast, [](const Wave& wave) { return wave.per_turn; });
  out.reals("CCF_V_COS", fast, [](const Wave& wave) { return wave.cosine_rad * kDegPerRad; });
  out.reals("CCF_V_SIN", fast, [](const Wave& wave) { return wave.sine_rad * kDegPerRad; });
  out.comment("what each joint adds by its own angle, over a turn, in degrees");
  out.value("INT", "CCF_STEPS", std::to_string(table.steps));
  out.blank("REAL", fmt::format("CCF_OWN[{},{}]", kJoints, table.steps + 1));
  for (int i = 0; i < static_cast<int>(kJoints) && table.steps > 0; ++i)
    for (int k = 0; k <= table.steps; ++k) {
      const double angle = k * calib::kRadPerTurn / table.steps;
      out.line(fmt::format("CCF_OWN[{},{}]={}", i + 1, k + 1,
                           real(slow_waves(joints, i, angle).first * kDegPerRad)));
    }
}

void write_tools(const std::vector<FixTool>& tools, Lines& out) {
  out.comment("tools: as $TOOL and $LOAD have them (-1: any load), as they are; bending per m/s2");
  out.value("INT", "CCF_TOOLS", std::to_string(tools.size()));
  out.each("FRAME", "CCF_TF", tools, [](const FixTool& t) { return frame(t.stated); });
  out.each("BOOL", "CCF_BY_LOAD", tools, [](const FixTool& t) { return truth(t.by_load); });
  out.reals("CCF_LM", tools, [](const FixTool& t) { return t.load ? t.load->mass_kg : -1.0; });
  out.each("FRAME", "CCF_LC", tools, [](const FixTool& t) {
    return frame(FrameMmDeg{t.load.value_or(LoadData{}).com_mm, {}});
  });
  out.each("FRAME", "CCF_TR", tools, [](const FixTool& t) { return frame(t.tip); });
  out.each("BOOL", "CCF_STIFF", tools, [](const FixTool& t) { return truth(!t.cells); });
  out.each("FRAME", "CCF_TC", tools, [](const FixTool& t) { return frame_mm(t.com_m); });
  out.reals("CCF_TM", tools, [](const FixTool& t) { return t.mass_kg; });
  out.reals("CCF_BEND", tools, [](const FixTool& t) { return t.bend_m_per_accel * kMmPerM; });
  out.reals("CCF_TURN", tools, [](const FixTool& t) { return t.turn_rad_per_accel * kDegPerRad; });
  out.blank("REAL", fmt::format("CCF_CLOSES[{},{}]", tools.size(), kJoints));
  for (std::size_t n = 0; n < tools.size(); ++n)
    for (std::size_t i = 0; i < kJoints; ++i)
      out.line(fmt::format("CCF_CLOSES[{},{}]={}", n + 1, i + 1,
                           real(1.0 / tools[n].play_closes_nm[i])));
}

/// Memory of a call for the next one, and its own state.
void write_state(bool external, Lines& out) {
  const std::string axes =
      "{A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 0.0,A6 0.0,E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}";
  const std::string of_external =
      ",BOOL XUNSEEN,INT XON,XMACHINE,FRAME XWAY,XGO,XFOOT,XACT,XSHIFT,E6AXIS X,REAL XE[6]";
  out.comment("the axes before as programmed (W) and as commanded (Q), their S; the tool before");
  out.line("STRUC CCF_MEMORY BOOL SEEN,STAYED,INT S,N,FRAME T,E6AXIS W,Q");
  out.value("CCF_MEMORY", "CCF_MEM",
            fmt::format("{{SEEN FALSE,STAYED FALSE,S 0,N 0,T {},W {},Q {}}}", frame(FrameMmDeg{}),
                        axes, axes));
  out.comment("of a single call");
  out.line("STRUC CCF_CALL CCF_MEMORY MEM,BOOL OK,OWN,INT TT,FRAME P,C,B,R,F,ROOT,E6AXIS A,LOAD L" +
           (external ? of_external : ""));
  out.value("FRAME", "CCF_UP", frame(Vector3d(0.0, 0.0, kAlongMm)));
  out.value("FRAME", "CCF_ALONG", frame(Vector3d(kAlongMm, 0.0, 0.0)));
  out.value("FRAME", "CCF_ASIDE", frame(Vector3d(0.0, kAlongMm, 0.0)));
}

/// A positive INT of the calibration's sum.
int id_of(const std::string& sha256) {
  constexpr std::size_t kDigits = 7;
  int id = 0;
  for (const char c : sha256.substr(0, kDigits))
    id = 16 * id + (c >= 'a' ? c - 'a' + 10 : c >= '0' && c <= '9' ? c - '0' : 0);
  return id;
}

/// The module's program. Lines of its templates are there with external axes, without, or once for each of them.
std::string program_text(const std::vector<std::string>& external, const std::string& id) {
  using drivers::krl::once_if, drivers::krl::Places;
  std::vector<Places> axes;
  for (const std::string& name : external)
    axes.push_back({{"NAME", name}, {"N", std::to_string(axes.size() + 1)}});
  std::string text(kFixTemplate);
  if (!external.empty()) text += "\n" + std::string(kFixExternalTemplate);
  return drivers::krl::fill(text, {{"VERSION", drivers::krl::release()}, {"ID", id}},
                            {{"EXTERNAL", once_if(!external.empty())},
                             {"ARM_ALONE", once_if(external.empty())},
                             {"AXIS", axes}});
}

}  // namespace

bool FixTool::is(const FrameMmDeg& tool) const {
  return same_tool(calib::to_isometry(tool), calib::to_isometry(stated));
}

FixModule fix_module(const calib::Calibration& c, const Data& data,
                     const FixModuleOptions& options) {
  const ArmModel arm(at_level(c.cell, c.level));
  if (arm_of(c.cell.robot).size() != kJoints || !calib::Configurations(arm, 0.0).closed_form())
    throw calib::FileError(
        "a correction at run time needs a six-axis arm with a spherical wrist. Correct the points "
        "without --at-run-time");
  const std::vector<std::string> external = external_names(c.cell.robot);
  const Joints joints = joints_of(arm, arm_values(arm, c));
  const Table table = table_of(joints, reach_m(c.cell.robot, c.cell.tool));
  FixModule module;
  Corrections corrections;
  module.tools = tools_of(c, data, corrections);
  // Postures between those looked at.
  constexpr double kMargin = 1.3, kLeastMm = 1.0, kLeastDeg = 0.2;
  module.most_mm = std::ceil(10.0 * (kMargin * corrections.most_m * kMmPerM + kLeastMm)) / 10.0;
  module.most_deg =
      std::ceil(100.0 * (kMargin * corrections.most_rad * kDegPerRad + kLeastDeg)) / 100.0;
  module.table_mm = table.off_m * kMmPerM;
  const std::string id = std::to_string(id_of(options.calibration_sha256));

  Lines out;
  out.line("&ACCESS RVP");
  out.line("&REL 1");
  out.line("DEFDAT CELLCAL_FIX PUBLIC");
  out.comment(fmt::format("cellcal {}: numbers of cellcal_fix.src", drivers::krl::release()));
  out.comment("calibration SHA-256 " + options.calibration_sha256);
  out.comment("FALSE: the program's points as they are");
  out.line("DECL GLOBAL BOOL CC_FIX_ON=TRUE");
  out.comment("number of the last message");
  out.line("DECL GLOBAL INT CC_FIX_WHY=0");
  out.value("INT", "CCF_ID", id);
  out.value("INT", "CCF_SERIAL", std::to_string(options.serial));
  out.comment("a larger correction holds the arm");
  out.value("REAL", "CCF_MOST_MM", real(module.most_mm));
  out.value("REAL", "CCF_MOST_DEG", real(module.most_deg));
  write_joints(c.cell.robot, joints, out);
  write_loads(joints, out);
  write_waves(joints, table, out);
  write_tools(module.tools, out);
  write_state(!external.empty(), out);
  if (!external.empty()) write_external(c, Carriers(c, data), options.anywhere, out);
  write_messages(!external.empty(), out);
  out.line("ENDDAT");
  module.dat = {"cellcal_fix.dat", out.text()};
  module.src = {"cellcal_fix.src", program_text(external, id)};
  return module;
}

}  // namespace cellcal::daemon::krl
