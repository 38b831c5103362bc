#include "daemon/krl/fix_lines.h"

#include <fmt/format.h>

#include <cmath>

#include "calib/model/error.h"

namespace cellcal::daemon::krl {

using calib::FrameMmDeg;

std::string real(double value) {
  if (!(std::abs(value) < 1e30)) throw calib::FileError("a number of the calibration is no REAL");
  std::string text = fmt::format("{:.9g}", value);
  const auto exponent = text.find('e');
  const std::string digits = text.substr(0, exponent);
  const std::string point = digits.find('.') == std::string::npos ? ".0" : "";
  return digits + point + (exponent == std::string::npos ? "" : "E" + text.substr(exponent + 1));
}

std::string frame(const FrameMmDeg& f) {
  return fmt::format("{{X {},Y {},Z {},A {},B {},C {}}}", real(f.xyz_mm[0]), real(f.xyz_mm[1]),
                     real(f.xyz_mm[2]), real(f.abc_deg[0]), real(f.abc_deg[1]), real(f.abc_deg[2]));
}
std::string frame(const Eigen::Isometry3d& f) { return frame(calib::to_frame(f)); }
std::string frame(const Eigen::Vector3d& mm) {
  return frame(FrameMmDeg{{mm.x(), mm.y(), mm.z()}, {0.0, 0.0, 0.0}});
}

void Lines::value(const std::string& type, const std::string& name, const std::string& value) {
  line(fmt::format("DECL {} {}={}", type, name, value));
}

void Lines::blank(const std::string& type, const std::string& names) {
  line(fmt::format("DECL {} {}", type, names));
}

void Lines::array(const std::string& type, const std::string& name,
                  const std::vector<std::string>& values, const std::string& none) {
  blank(type, fmt::format("{}[{}]", name, std::max<std::size_t>(1, values.size())));
  for (std::size_t i = 0; i < values.size(); ++i)
    line(fmt::format("{}[{}]={}", name, i + 1, values[i]));
  if (values.empty()) line(fmt::format("{}[1]={}", name, none));
}

}  // namespace cellcal::daemon::krl
