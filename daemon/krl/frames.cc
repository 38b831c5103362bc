#include "daemon/krl/frames.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/files/text.h"
#include "calib/model/error.h"
#include "daemon/krl/krl_data.h"
#include "daemon/krl/krl_numbers.h"

namespace cellcal::daemon::krl {

namespace {

using calib::FrameMmDeg;
using Eigen::Isometry3d;
using Eigen::Vector3d;

std::string text_of(const FrameMmDeg& f) {
  return fmt::format("{{X {:.4f},Y {:.4f},Z {:.4f},A {:.5f},B {:.5f},C {:.5f}}}", f.xyz_mm[0],
                     f.xyz_mm[1], f.xyz_mm[2], f.abc_deg[0], f.abc_deg[1], f.abc_deg[2]);
}

/// With all digits of the file.
std::string old_text(const FrameMmDeg& f) {
  return fmt::format("{{X {:.10g},Y {:.10g},Z {:.10g},A {:.10g},B {:.10g},C {:.10g}}}", f.xyz_mm[0],
                     f.xyz_mm[1], f.xyz_mm[2], f.abc_deg[0], f.abc_deg[1], f.abc_deg[2]);
}

ProposedFrame proposed(ProposedFrame::Kind kind, const Isometry3d& frame,
                       const std::map<int, FrameMmDeg>& stated, int number) {
  ProposedFrame one;
  one.kind = kind;
  one.name =
      fmt::format("{}_DATA[{}]", kind == ProposedFrame::Kind::kTool ? "TOOL" : "BASE", number);
  one.frame = calib::to_frame(frame);
  const auto old = stated.find(number);
  if (old == stated.end()) return one;
  one.old = old->second;
  const Isometry3d before = calib::to_isometry(old->second);
  one.shift_mm = (frame.translation() - before.translation()).norm() * calib::kMmPerM;
  one.turn_deg = degrees_between(before, frame);
  return one;
}

ProposedFrame tool_frame(const calib::Calibration& c, int number, const Data& data) {
  Isometry3d tcp = c.cell.tool.tcp;
  std::array<double, 3> sigma_mm{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto* found = find(c, calib::tool_parameter(calib::ParameterKind::kTcp, 0, axis));
    if (found == nullptr) continue;
    tcp.translation()[axis] += found->correction;
    sigma_mm[static_cast<std::size_t>(axis)] = found->sigma * calib::kMmPerM;
  }
  ProposedFrame one = proposed(ProposedFrame::Kind::kTool, tcp, data.tools, number);
  one.sigma_mm = sigma_mm;
  if (one.old && !is_empty(*one.old) && one.shift_mm > kAnotherToolMm)
    throw calib::FileError(fmt::format(
        "TOOL_DATA[{}] is {:.1f} mm from the cell file's tool. Give the number of the tool that "
        "touched",
        number, one.shift_mm));
  return one;
}

Vector3d centre_of(const calib::Calibration& c, const std::string& id) {
  const auto stated = std::ranges::find(c.cell.targets, id, &calib::Target::id);
  if (stated != c.cell.targets.end() && stated->carried_by > 0)
    throw calib::FileError(fmt::format(
        "target {} stands on {} of the positioner, and BASE_DATA is in the world. Measure a base on the table at "
        "the controller; 'cellcal export-robot --as kuka' has the frames of its axes",
        calib::shown(id),
        c.cell.robot.positioner.at(static_cast<std::size_t>(stated->carried_by) - 1).name));
  for (const calib::TargetResult& target : c.targets)
    if (target.id == id) return target.centre_m;
  throw calib::FileError("no target \"" + calib::shown(id) + "\" in the calibration");
}

/// Origin at the first, x towards the second, the third on the side of +y.
Isometry3d base_of_targets(const calib::Calibration& c, const std::array<std::string, 3>& ids) {
  constexpr double kLeastM = 0.01;  // targets nearer than this to one line give no direction
  const Vector3d origin = centre_of(c, ids[0]), x = centre_of(c, ids[1]) - origin,
                 side = centre_of(c, ids[2]) - origin;
  const Vector3d y = side - x * (x.dot(side) / std::max(x.squaredNorm(), kLeastM * kLeastM));
  if (x.norm() < kLeastM || y.norm() < kLeastM)
    throw calib::FileError(
        fmt::format("targets {}, {} and {} are on one line; a base needs three that are not",
                    calib::shown(ids[0]), calib::shown(ids[1]), calib::shown(ids[2])));
  Isometry3d base = Isometry3d::Identity();
  base.translation() = origin;
  base.linear().col(0) = x.normalized();
  base.linear().col(1) = y.normalized();
  base.linear().col(2) = base.linear().col(0).cross(base.linear().col(1));
  return base;
}

std::string snippet_of(const std::vector<ProposedFrame>& frames, const FramesRequest& request) {
  std::string ascii;
  for (const char c : calib::shown(request.calibration, 80))
    ascii += static_cast<unsigned char>(c) < 0x80 ? c : '?';
  std::string text = "&ACCESS RVP\r\nDEF " + request.program + "( )\r\n; from " + ascii +
                     "\r\n; Every point that was taught in these frames moves with them. Keep a "
                     "backup of $config.dat.\r\n";
  for (const ProposedFrame& one : frames) {
    text += one.old
                ? fmt::format("; {} was\r\n;   {}={}\r\n", one.name, one.name, old_text(*one.old))
                : fmt::format("; old value of {} not in the given files\r\n", one.name);
    text += one.name + "=" + text_of(one.frame) + "\r\n";
  }
  return text + "END\r\n";
}

}  // namespace

bool is_empty(const FrameMmDeg& frame) {
  return Vector3d(frame.xyz_mm.data()).isZero(0.0) && Vector3d(frame.abc_deg.data()).isZero(0.0);
}

ProposedFrames propose_frames(const calib::Calibration& calibration, const FramesRequest& request) {
  if (!request.bases.empty())
    refuse_linear_unit(calibration.cell.robot, "a proposal of a base",
                       "Measure it at the controller");
  Data data;
  for (const KrlFile& file : request.controller) read_data(file, data);
  ProposedFrames result;
  result.robroot_stated = data.robroot.has_value();
  if (request.tool) result.frames.push_back(tool_frame(calibration, *request.tool, data));
  const Isometry3d robroot = calib::to_isometry(data.robroot.value_or(FrameMmDeg{}));
  for (const auto& [number, targets] : request.bases)
    result.frames.push_back(proposed(ProposedFrame::Kind::kBase,
                                     robroot * base_of_targets(calibration, targets), data.bases,
                                     number));
  result.mastering = calib::zero_offsets(calibration);
  for (const ProposedFrame& one : result.frames)
    result.config_lines += one.name + "=" + text_of(one.frame) + "\n";
  result.snippet = snippet_of(result.frames, request);
  return result;
}

}  // namespace cellcal::daemon::krl
