// Checks without devices: cell, robot, controller files.

#include <algorithm>

#include "calib/files/files.h"
#include "calib/model/kinematics.h"
#include "calib/model/long_work.h"
#include "calib/model/units.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/finder.h"
#include "calib/plan/lowest.h"
#include "calib/plan/plan.h"
#include "daemon/doctor/doctor.h"
#include "daemon/files/correction_limit.h"
#include "drivers/kuka/krl/krl_read.h"

namespace cellcal::daemon {

namespace {

using calib::Phrase;

/// KUKA's usual home position: A1..A6 [deg].
constexpr double kHomeDeg[] = {0, -90, 90, 0, 90, 0};

/// Two public drawings exist for the name plate KR 5 R1400, with the same reach (calib/robots/kr5_arc.toml):
/// true if the flange is at its position in one of them.
bool is_of_either_kr5(const Eigen::Vector3d& flange_mm) {
  const Eigen::Vector3d arc_mm{800.0, 0.0, 1005.0}, r1400_mm{800.0, 0.0, 960.0};
  // An individual arm differs from its drawing by less; the next model, KR 10 R1420, by 11 mm.
  constexpr double kOfOneDrawingMm = 5.0;
  return (flange_mm - arc_mm).norm() < kOfOneDrawingMm ||
         (flange_mm - r1400_mm).norm() < kOfOneDrawingMm;
}

/// Flange position of the robot file at home, to be compared with the pendant.
void examine_geometry(const calib::Robot& robot, Findings& findings) {
  const std::string check = "robot geometry";
  if (robot.joints.size() != std::size(kHomeDeg)) return;
  std::vector<double> home;
  for (const double deg : kHomeDeg) home.push_back(deg * calib::kRadPerDeg);
  const Eigen::Vector3d flange_mm =
      calib::ArmModel(robot, {}).nominal_tcp(home).translation() * calib::kMmPerM;
  const Phrase found{"say.doctor.geometry",
                     {{"robot", robot.name}, {"x", flange_mm.x()}, {"z", flange_mm.z()}}};
  if (is_of_either_kr5(flange_mm)) {
    findings.warn(check, found, "say.doctor.geometry.kr5.do");
  } else {
    findings.ok(check, found);
  }
}

/// Contradictions within the file.
void examine_contradictions(const calib::Cell& cell, Findings& findings) {
  const std::string check = "cell itself";
  const std::vector<calib::CellFault> faults = calib::faults_of(cell);
  for (const calib::CellFault& fault : faults) {
    if (fault.refused) {
      findings.fail(check, found_phrase(fault), advice_phrase(fault));
    } else {
      findings.warn(check, found_phrase(fault), advice_phrase(fault));
    }
  }
  if (faults.empty()) findings.ok(check, "say.doctor.cell.good");
}

/// Plan of a session, and the axis travel that it requires.
void examine_plan(const DaemonConfig& config, const calib::Cell& cell, Findings& findings) {
  const std::string check = "plan";
  if (calib::must_find(cell)) return findings.skip(check, "say.doctor.plan.find");
  try {
    calib::PlanOptions options;
    const bool known = config.backend == BackendKind::kMock &&
                       config.mock.start_rad.size() == cell.robot.joints.size();
    const calib::Plan plan =
        calib::make_plan(cell, options, known ? config.mock.start_rad : calib::JointVector{});
    if (const auto fault = calib::fault_of(cell, plan))
      findings.warn("required accuracy", found_phrase(*fault), advice_phrase(*fault));
    if (const auto low = calib::below_feet(cell, plan))
      findings.warn("floor", found_phrase(*low), floor_advice_phrase(*low));
    const Phrase foreseen{
        "say.doctor.plan",
        {{"touches", plan.touches.size()}, {"mm", plan.predicted_mean_m * calib::kMmPerM}}};
    if (wire_of(config) != WireKind::kRsi) return findings.ok(check, foreseen);
    const LimitNeeded needed = limit_needed(plan, cell.robot, plan.start);
    const double limit = config.rsi.correction_limit_deg.at(0);
    const Phrase found{"say.doctor.plan.travel",
                       {{"plan", foreseen},
                        {"axis", needed.widest_axis},
                        {"deg", needed.range_deg},
                        {"limit", limit}}};
    // From the middle of its range an axis travels half of it.
    if (limit < needed.range_deg / 2.0 || (known && limit < needed.turn_deg)) {
      findings.fail(check, found, widen_phrase(needed));
    } else if (limit < std::min(needed.range_deg, kWidestLimitDeg)) {
      findings.warn(check, found, {"say.doctor.plan.travel.do", {{"widen", widen_phrase(needed)}}});
    } else {
      findings.ok(check, found);
    }
  } catch (const calib::PlanError& error) {
    findings.fail(check, error.what(), "say.doctor.plan.none.do");
  }
}

}  // namespace

std::optional<calib::Cell> examine_cell(const DoctorRequest& request, const DaemonConfig& config,
                                        Findings& findings) {
  if (request.cell.empty()) {
    findings.warn("cell file", "say.doctor.cell_file.none", "say.doctor.cell_file.none.do");
    return std::nullopt;
  }
  try {
    const calib::Watch watch([&] { return request.stop.stop_requested(); });
    calib::Cell cell = calib::load_cell(request.cell);
    if (wire_of(config) == WireKind::kRsi) {
      rsi_config_for(config, cell);
    } else {
      eki_config_for(config, cell);
    }
    findings.ok("cell file", {"say.doctor.cell_file",
                              {{"file", request.cell.string()},
                               {"targets", cell.targets.size()},
                               {"joints", cell.robot.joints.size()}}});
    examine_geometry(cell.robot, findings);
    examine_contradictions(cell, findings);
    examine_plan(config, cell, findings);
    return cell;
  } catch (const calib::Cancelled&) {
    return std::nullopt;  // cancelled on request; the findings are discarded
  } catch (const std::exception& error) {
    findings.fail("cell file", error.what(), "say.doctor.cell_file.do");
    return std::nullopt;
  }
}

std::vector<drivers::FileFinding> verify_files(const DaemonConfig& config, WireKind wire,
                                               const drivers::ControllerFiles& files,
                                               const std::optional<calib::Cell>& cell) {
  if (wire == WireKind::kEki) return drivers::verify_eki_files(files, config.controller);
  return drivers::verify_rsi_files(files, cell ? rsi_files_for(config, *cell) : config.rsi_files,
                                   config.rsi.mode);
}

void examine_schedule(const DaemonConfig& config, Findings& findings) {
  const std::string check = "unattended start";
  const ScheduleConfig& schedule = config.schedule;
  if (!schedule.unattended || schedule.sessions.empty()) return;
  if (const std::string obstacle = unattended_obstacle(config); !obstacle.empty())
    return findings.fail(check, obstacle, "say.doctor.unattended.do");
  // The PLC calls the program within this time; after a shorter timeout a late program finds no listener.
  constexpr std::chrono::minutes kEnough{5};
  if (schedule.program_start == ProgramStart::kCell && config.timeouts.connecting < kEnough)
    return findings.warn(
        check,
        {"say.doctor.unattended.short",
         {{"s", std::chrono::duration<double>(config.timeouts.connecting).count()}}},
        "say.doctor.unattended.short.do");
  findings.ok(check, "say.doctor.unattended");
}

void examine_files(const DoctorRequest& request, const DaemonConfig& config,
                   const std::optional<calib::Cell>& cell, Findings& findings) {
  const std::string check = "controller files";
  if (request.files.empty()) {
    if (wire_of(config) == WireKind::kRsi)
      findings.skip(check,
                    {"say.doctor.files.none", {{"deg", config.rsi.correction_limit_deg.at(0)}}});
    return;
  }
  try {
    const auto objections =
        verify_files(config, wire_of(config), request.read_files(request.files), cell);
    for (const drivers::FileFinding& one : objections) {
      if (one.refused) {
        findings.fail(check, to_string(one), "say.doctor.files.refused.do");
      } else {
        findings.warn(check, to_string(one), "say.doctor.files.warned.do");
      }
    }
    if (objections.empty()) {
      findings.ok(check, {"say.doctor.files", {{"folder", request.files.string()}}});
    }
  } catch (const std::exception& error) {
    findings.fail(check, error.what(), "say.doctor.files.do");
  }
}

}  // namespace cellcal::daemon
