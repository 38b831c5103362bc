#include "tests/daemon/krl/krl_controller.h"

#include <algorithm>
#include <cmath>

#include "tests/daemon/krl/emulated_controller.h"

namespace cellcal::daemon::testing {

namespace {

using calib::JointVector;
using calib::kDegPerRad;
using calib::kRadPerDeg;
using calib::kRadPerTurn;
using Eigen::Isometry3d;
using sim::krl::Motion;
using sim::krl::Value;

constexpr const char* kVariables = R"(
ENUM KRLMSGPARTYPE_T VALUE,KEY,EMPTY
ENUM EKRLMSGTYPE NOTIFY,STATE,QUIT,WAITING
STRUC KRLMSG_T CHAR MODUL[24],INT NR,CHAR MSG_TXT[80]
STRUC KRLMSGPAR_T KRLMSGPARTYPE_T PAR_TYPE,CHAR PAR_TXT[26],INT PAR_INT,REAL PAR_REAL,BOOL PAR_BOOL
STRUC KRLMSGOPT_T BOOL VL_STOP,CLEAR_P_RESET,CLEAR_P_SAW,LOG_TO_DB
INT $KR_SERIALNO=4711
INT $EX_AX_NUM=0
IPO_MODE $IPO_MODE=#BASE
FRAME $TOOL,$BASE,$ROBROOT
FRAME TOOL_DATA[16],BASE_DATA[32]
LOAD $LOAD={M -1.0,CM {X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}
STRUC MACHINE_FRAME_T INT MACH_DEF_INDEX
MACHINE_FRAME_T MACHINE_FRAME_DAT[32]
E6AXIS $AXIS_ACT
E6POS $POS_ACT
BOOL $BWDSTART
PDAT PDAT_ACT
PDAT PDEFAULT={VEL 100.0,ACC 100.0,APO_DIST 100.0}
LDAT LDAT_ACT
FDAT FDAT_ACT
FDAT FHOME={TOOL_NO 0,BASE_NO 0,IPO_FRAME #BASE}
E6AXIS XHOME={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 30.0,A6 0.0}
EXTFCT E6POS FORWARD(E6AXIS :IN,INT :OUT)
EXTFCT E6AXIS INVERSE(E6POS :IN,E6AXIS :IN,INT :OUT)
EXTFCT INT SET_KRLMSG(EKRLMSGTYPE :IN,KRLMSG_T :IN,KRLMSGPAR_T[] :OUT,KRLMSGOPT_T :IN)
)";

calib::FrameMmDeg frame_of_value(const Value& value) {
  calib::FrameMmDeg f;
  for (std::size_t i = 0; i < 6; ++i)
    (i < 3 ? f.xyz_mm[i] : f.abc_deg[i - 3]) = value.parts[i].given ? value.parts[i].r : 0.0;
  return f;
}

bool given(const Value& value, const char* part) {
  const int at = value.type->index_of(part);
  return at >= 0 && value.parts[static_cast<std::size_t>(at)].given;
}

void put_frame(Value& value, const Isometry3d& pose) {
  const calib::FrameMmDeg f = calib::to_frame(pose);
  for (std::size_t i = 0; i < 6; ++i) value.parts[i].set(i < 3 ? f.xyz_mm[i] : f.abc_deg[i - 3]);
}

/// E1 to E6 as far as present.
KrlController::External external_of(const Value& value, KrlController::External missing) {
  for (std::size_t i = 0; i < missing.size(); ++i)
    if (const std::string name = "E" + std::to_string(i + 1); given(value, name.c_str()))
      missing[i] = value.part(name).r;
  return missing;
}

void put_axes(Value& value, const JointVector& q, const KrlController::External& e) {
  for (std::size_t i = 0; i < 6; ++i) value.parts[i].set(q[i] * kDegPerRad);
  for (std::size_t i = 6; i < value.parts.size(); ++i) value.parts[i].set(e[i - 6]);
}

double distance2(const JointVector& a, const JointVector& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

}  // namespace

KrlController::KrlController(const calib::Robot& robot,
                             const std::map<std::string, std::string>& files)
    : at(6, 0.0),
      robot_(robot),
      arm_(robot, calib::Tool{}),
      ways_(arm_, 0.0),
      stretched_rad_(stretched_a3(robot)),
      program_(files, kVariables),
      interpreter_(program_, this) {
  at = {0.0, -90.0 * kRadPerDeg, 90.0 * kRadPerDeg, 0.0, 30.0 * kRadPerDeg, 0.0};
  for (const char* name : {"$TOOL", "$BASE", "$ROBROOT"}) set_frame(name, {});
  for (Value& one : program_["MACHINE_FRAME_DAT"].parts) one.part("MACH_DEF_INDEX").set_whole(0);
  bind();
}

void KrlController::set_frame(const char* name, const calib::FrameMmDeg& frame) {
  put_frame(program_[name], calib::to_isometry(frame));
}

Isometry3d KrlController::frame(const char* name) {
  return calib::to_isometry(frame_of_value(program_[name]));
}

Isometry3d KrlController::base(const External& e) {
  const Isometry3d here = foot ? foot(e) : frame("$ROBROOT");
  return here.inverse() * (on_table ? table(e) : Isometry3d::Identity()) * frame("$BASE");
}

Isometry3d KrlController::tcp(const JointVector& q, const External& e) {
  return base(e).inverse() * arm_.nominal_tcp(q) * frame("$TOOL");
}

std::optional<JointVector> KrlController::joints(const Value& point, const JointVector& near,
                                                 bool keeps, const External& e) {
  const Isometry3d flange =
      base(e) * calib::to_isometry(frame_of_value(point)) * frame("$TOOL").inverse();
  const bool posture = keeps || given(point, "S"), turn = !keeps && given(point, "T");
  const int status = keeps               ? status_and_turn(arm_, stretched_rad_, near).status
                     : given(point, "S") ? point.part("S").i & 7
                                         : 0;
  std::optional<JointVector> best;
  for (JointVector q : ways_.reach(flange)) {
    if (posture && status_and_turn(arm_, stretched_rad_, q).status != status) continue;
    bool inside = true;
    for (std::size_t i = 0; i < q.size(); ++i) {
      const bool below = turn && (point.part("T").i >> i & 1) != 0;
      if (!turn) q[i] += kRadPerTurn * std::round((near[i] - q[i]) / kRadPerTurn);
      if (turn && (q[i] < 0.0) != below && std::abs(q[i]) > 1e-6)
        q[i] += below ? -kRadPerTurn : kRadPerTurn;
      inside = inside && q[i] >= robot_.joints[i].min_rad && q[i] <= robot_.joints[i].max_rad;
    }
    if (inside && (!best || distance2(q, near) < distance2(*best, near))) best = q;
  }
  return best;
}

JointVector KrlController::axes(const Value& value, const JointVector& missing) const {
  JointVector q = missing;
  for (std::size_t i = 0; i < 6; ++i)
    if (value.parts[i].given) q[i] = value.parts[i].r * kRadPerDeg;
  return q;
}

JointVector KrlController::target_of(const Motion& motion) {
  const Value& to = motion.target;
  const bool axial = to.type->index_of("A1") == 0;
  if (axial && motion.kind == Motion::Kind::kPtp) return axes(to, at);
  if (axial) {
    const JointVector by = axes(to, JointVector(6, 0.0));
    JointVector q = at;
    for (std::size_t i = 0; i < 6; ++i) q[i] += by[i];
    return q;
  }
  const bool relative =
      motion.kind == Motion::Kind::kLinRel || motion.kind == Motion::Kind::kPtpRel;
  Value point = to;
  if (relative) {
    const Isometry3d by = calib::to_isometry(frame_of_value(to));
    Isometry3d pose = tcp(at, external);
    if (motion.in_tool)
      pose = pose * by;
    else
      pose.translation() += by.translation();
    point = Value(program_.type("FRAME"));
    put_frame(point, pose);
  }
  const auto q = joints(point, at, motion.kind != Motion::Kind::kPtp, external_of(point, external));
  if (!q) throw sim::krl::RunError("work envelope exceeded");
  return *q;
}

void KrlController::move(const Motion& motion) {
  at = target_of(motion);
  reached.push_back(at);
  const Value& to = motion.target;
  const bool relative =
      motion.kind == Motion::Kind::kLinRel || motion.kind == Motion::Kind::kPtpRel;
  const External by = external_of(to, relative ? External{} : external);
  for (std::size_t i = 0; i < by.size(); ++i) external[i] = relative ? external[i] + by[i] : by[i];
  external_reached.push_back(external);
  targets.push_back(to.type->name +
                    (given(to, "S") ? " " + std::to_string(to.part("S").i) : std::string()));
}

void KrlController::run(const std::string& routine) {
  interpreter_.select(routine);
  press_start();
}

void KrlController::press_start() {
  interpreter_.go_on();
  constexpr int kMost = 1'000'000'000;
  interpreter_.run(0.0, kMost);
}

bool KrlController::run_interrupted(const std::string& routine, const char* within, std::int64_t n,
                                    const char* condition) {
  program_[condition].set_whole(0);
  interpreter_.select(routine);
  while (interpreter_.running() && !interpreter_.is_in(within)) interpreter_.run(0.0, 1);
  const std::int64_t first = executed().statements;
  while (interpreter_.running() && executed().statements < first + n) interpreter_.run(0.0, 1);
  const bool inside = interpreter_.is_in(within);
  program_[condition].set_whole(1);
  interpreter_.poll_interrupts();
  press_start();
  return inside;
}

void KrlController::activate(const std::string& what, std::size_t number) {
  Value& all = program_[what + "_DATA"];
  if (what == "BASE")
    on_table = number > 0 &&
               program_["MACHINE_FRAME_DAT"].parts.at(number - 1).part("MACH_DEF_INDEX").i > 0;
  put_frame(program_["$" + what],
            number == 0 ? Isometry3d::Identity()
                        : calib::to_isometry(frame_of_value(all.parts.at(number - 1))));
}

void KrlController::put_data(const char* data, std::size_t number, const Isometry3d& frame) {
  put_frame(program_[data].parts.at(number - 1), frame);
}

void KrlController::put_pose(Value& value, const JointVector& q, const External& e) {
  put_frame(value, tcp(q, e));
  for (std::size_t i = 0; i < e.size(); ++i) value.part("E" + std::to_string(i + 1)).set(e[i]);
  const StatusAndTurn st = status_and_turn(arm_, stretched_rad_, q);
  value.part("S").set_whole(st.status);
  value.part("T").set_whole(st.turn);
}

void KrlController::bind() {
  program_.variable("$AXIS_ACT").read = [this](Value& value, std::size_t) {
    put_axes(value, at, external);
  };
  program_.variable("$POS_ACT").read = [this](Value& value, std::size_t) {
    put_pose(value, at, external);
  };
  program_.bind("FORWARD", [this](std::span<Value* const> a) {
    Value result(program_.type("E6POS"));
    put_pose(result, axes(*a[0], JointVector(6, 0.0)), external_of(*a[0], {}));
    a[1]->set_whole(0);
    return result;
  });
  program_.bind("INVERSE", [this](std::span<Value* const> a) {
    Value result(program_.type("E6AXIS"));
    const JointVector near = axes(*a[1], JointVector(6, 0.0));
    const External e = external_of(*a[0], external_of(*a[1], {}));
    const auto q = joints(*a[0], near, false, e);
    put_axes(result, q.value_or(near), e);
    a[2]->set_whole(q ? 0 : 1);
    return result;
  });
  program_.bind("SET_KRLMSG", [this](std::span<Value* const> a) {
    messages.push_back(a[1]->part("MSG_TXT").text());
    Value result(program_.type("INT"));
    result.set_whole(static_cast<std::int32_t>(messages.size()));
    return result;
  });
  program_.bind("BAS", [this](std::span<Value* const> a) {
    const auto& names = a[0]->type->names;
    const std::string& command = names.at(static_cast<std::size_t>(a[0]->i - 1));
    const auto number = static_cast<std::size_t>(std::lround(a[1]->r));
    if (command == "TOOL" || command == "BASE") activate(command, number);
    if (command == "PTP_PARAMS" || command == "CP_PARAMS" || command == "FRAMES")
      for (const char* what : {"TOOL", "BASE"})
        activate(what,
                 static_cast<std::size_t>(program_["FDAT_ACT"].part(std::string(what) + "_NO").i));
    return Value();
  });
}

}  // namespace cellcal::daemon::testing
