// What needs no wire: cell, robot, the controller's files.

#include <fmt/format.h>

#include <numbers>

#include "calib/files/files.h"
#include "calib/model/kinematics.h"
#include "daemon/doctor/parts.h"
#include "drivers/kuka/krl_read.h"

namespace cellcal::daemon {

namespace {

/// KUKA's usual home, as everyone can reach it: A1..A6 in degrees.
constexpr double kHomeDeg[] = {0, -90, 90, 0, 90, 0};

/// Where the robot file puts the flange there, to be compared with the pendant.
void look_at_geometry(const calib::Robot& robot, Findings& findings) {
  const std::string check = "robot geometry";
  if (robot.joints.size() != std::size(kHomeDeg)) return;
  std::vector<double> home;
  for (const double deg : kHomeDeg) home.push_back(deg * std::numbers::pi / 180.0);
  const Eigen::Vector3d flange_mm =
      calib::ArmModel(robot, {}).nominal_tcp(home).translation() * calib::kMmPerM;
  const std::string found = fmt::format(
      "{}: at A1..A6 = 0, -90, 90, 0, 90, 0 the pendant must show X {:.1f}, Z {:.1f} "
      "with $TOOL and $BASE at $NULLFRAME",
      robot.name, flange_mm.x(), flange_mm.z());
  if (robot.name.find("KR 5") != std::string::npos) {
    findings.warn(check, found,
                  "two KR 5 are called R1400: Z 1005.0 is robot = \"kr5_arc.toml\" (a3 120 mm, "
                  "flange 115 mm), Z 960.0 is \"kr5_r1400.toml\" (40 mm, 80 mm); compare once");
  } else {
    findings.ok(check, found);
  }
}

}  // namespace

std::optional<calib::Cell> look_at_cell(const DoctorRequest& request, const DaemonConfig& config,
                                        Findings& findings) {
  if (request.cell.empty()) {
    findings.warn("cell file", "not looked at", "name it: --cell CELL.toml");
    return std::nullopt;
  }
  try {
    calib::Cell cell = calib::load_cell(request.cell);
    if (wire_of(config) == WireKind::kRsi) {
      rsi_config_for(config, cell);
    } else {
      eki_config_for(config, cell);
    }
    findings.ok("cell file", fmt::format("{}, {} targets, {} joints", request.cell.string(),
                                         cell.targets.size(), cell.robot.joints.size()));
    look_at_geometry(cell.robot, findings);
    return cell;
  } catch (const std::exception& error) {
    findings.fail("cell file", error.what(),
                  "calib/README.md has all keys of cell and robot files");
    return std::nullopt;
  }
}

std::vector<drivers::FileObjection> verify_folder(const DaemonConfig& config, WireKind wire,
                                                  const std::filesystem::path& folder) {
  const drivers::ControllerFiles files = drivers::read_controller_folder(folder);
  return wire == WireKind::kEki
             ? drivers::verify_eki_files(files, config.controller)
             : drivers::verify_rsi_files(files, config.rsi_files, config.rsi.mode);
}

void look_at_files(const DoctorRequest& request, const DaemonConfig& config, Findings& findings) {
  if (request.files.empty()) return;
  const std::string check = "controller files";
  try {
    const auto objections = verify_folder(config, wire_of(config), request.files);
    for (const drivers::FileObjection& one : objections) {
      if (one.refused) {
        findings.fail(check, to_string(one),
                      "mend it there and on the controller; then cold start");
      } else {
        findings.warn(check, to_string(one), "look whether that was meant");
      }
    }
    if (objections.empty()) {
      findings.ok(check, fmt::format("{} fits the configuration", request.files.string()));
    }
  } catch (const std::exception& error) {
    findings.fail(check, error.what(), "name the folder with the controller's files");
  }
}

}  // namespace cellcal::daemon
