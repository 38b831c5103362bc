#include "daemon/krl/krl_numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "calib/export/krl_text.h"

namespace cellcal::daemon::krl {

using namespace calib::krl;

namespace {

/// Decimals of a number's text; with an exponent as many as represent its digits.
int decimals_of(std::string_view text) {
  if (text.find('\'') != std::string_view::npos) return 0;  // 'H1F'
  const auto mark = text.find_first_of("eE");
  if (mark != std::string_view::npos) return 9;
  const auto point = text.find('.');
  return point == std::string_view::npos ? 0 : static_cast<int>(text.size() - point - 1);
}

double off_turns(double degrees, double near) {
  return near + std::remainder(degrees - near, 360.0);
}

double distance(const calib::FrameMmDeg& a, const calib::FrameMmDeg& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 3; ++i) sum += std::abs(a.abc_deg[i] - b.abc_deg[i]);
  return sum;
}

}  // namespace

double value_of(std::string_view text) {
  const bool minus = text.starts_with('-');
  while (!text.empty() && (text.front() == '-' || text.front() == '+' || text.front() == ' ' ||
                           text.front() == '\t'))
    text.remove_prefix(1);
  double value = 0.0;
  if (const auto based = based_constant(text))
    value = *based;
  else
    std::from_chars(text.data(), text.data() + text.size(), value);
  return minus ? -value : value;
}

std::string rewritten(std::string_view old, double value, int least) {
  constexpr int kMost = 9;
  const int decimals = std::clamp(decimals_of(old), least, kMost);
  const double step = std::pow(10.0, -decimals);
  if (std::abs(value - value_of(old)) < 0.5 * step) return std::string(old);
  const std::string digits = fmt::format("{:.{}f}", std::abs(value), decimals);
  const bool is_zero = digits.find_first_of("123456789") == std::string::npos;
  const bool has_sign = old.starts_with('-') || old.starts_with('+');
  const std::string sign = value < 0.0 && !is_zero ? "-" : old.starts_with('+') ? "+" : "";
  // Blanks after a sign stay: Y -  393.4
  const std::size_t first = has_sign ? old.find_first_not_of(" \t", 1) : 0;
  return sign + std::string(old.substr(has_sign, first - has_sign)) + digits;
}

double degrees_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle() * calib::kDegPerRad;
}

calib::FrameMmDeg nearest_turns(const Eigen::Isometry3d& pose, const calib::FrameMmDeg& near) {
  calib::FrameMmDeg first = calib::to_frame(pose);
  auto& [a, b, c] = first.abc_deg;
  const Eigen::Matrix3d r = pose.linear();
  // A and C are one rotation here, within the resolution of the file's digits.
  constexpr double kOneAxis = 1e-6;
  if (std::hypot(r(0, 0), r(1, 0)) < kOneAxis) {
    const double sum = std::atan2(-r(0, 1), r(1, 1)) * calib::kDegPerRad;  // A -+ C, with C = 0
    c = near.abc_deg[2];
    a = r(2, 0) < 0.0 ? sum + c : sum - c;
  }
  calib::FrameMmDeg second = first;
  second.abc_deg = {a + 180.0, 180.0 - b, c + 180.0};
  for (calib::FrameMmDeg* one : {&first, &second})
    for (std::size_t i = 0; i < 3; ++i)
      one->abc_deg[i] = off_turns(one->abc_deg[i], near.abc_deg[i]);
  return distance(second, near) < distance(first, near) ? second : first;
}

std::string edited(const std::string& text, std::vector<Edit> edits) {
  std::sort(edits.begin(), edits.end(),
            [](const Edit& a, const Edit& b) { return a.begin < b.begin; });
  std::string result;
  std::size_t at = 0;
  for (const Edit& edit : edits) {
    result.append(text, at, edit.begin - at);
    result += edit.text;
    at = edit.end;
  }
  return result.append(text, at);
}

}  // namespace cellcal::daemon::krl
