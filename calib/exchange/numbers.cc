#include "calib/exchange/numbers.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "calib/syntax/trimmed.h"

namespace cellcal::calib {

std::string shortest(double value) { return fmt::format("{}", value == 0.0 ? 0.0 : value); }

std::string shortest(const Eigen::Vector3d& values) {
  return shortest(values.x()) + ' ' + shortest(values.y()) + ' ' + shortest(values.z());
}

std::optional<double> number(std::string_view text) {
  text = trimmed(text);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-')
    text.remove_prefix(1);  // from_chars takes no plus
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

std::optional<Eigen::Vector3d> three_numbers(std::string_view text) {
  Eigen::Vector3d values;
  text = trimmed(text);
  for (int k = 0; k < 3; ++k) {
    const auto end = k < 2 ? text.find_first_of(kBlanks) : text.size();
    if (end == std::string_view::npos) return std::nullopt;
    const auto value = number(text.substr(0, end));
    if (!value) return std::nullopt;
    values[k] = *value;
    text = trimmed(text.substr(end));
  }
  if (!text.empty()) return std::nullopt;
  return values;
}

std::string robot_joint_name(const std::string& name) {
  constexpr std::string_view kBefore = "joint_";
  const bool ros = name.starts_with(kBefore) && name.size() > kBefore.size();
  std::string result;
  for (const char c : ros ? name.substr(kBefore.size()) : name)
    result += c >= 'a' && c <= 'z' && ros ? static_cast<char>(c - 'a' + 'A')
              : static_cast<unsigned char>(c) <= ' ' || c == ',' || c == '"' || c == '#' ? '_'
                                                                                         : c;
  return result;
}

std::string ros_joint_name(const std::string& name) {
  std::string result = "joint_";
  for (const char c : name) result += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return result;
}

}  // namespace cellcal::calib
