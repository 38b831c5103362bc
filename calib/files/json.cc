#include "calib/files/json.h"

#include <fmt/format.h>

#include "calib/files/json_fields.h"
#include "calib/model/error.h"

namespace cellcal::calib {

std::string write_json(const nlohmann::json& value) { return value.dump(); }

std::string write_lines(const nlohmann::ordered_json& value) {
  return value.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

namespace {

/// Keys of the formats have no dots, and nesting is at most a few levels.
constexpr int kMostDots = 8;
constexpr int kDeepestJson = 32;

/// Index after the TOML string that begins at `at`.
std::size_t after_string_index(std::string_view text, std::size_t at) {
  const char quote = text[at];
  const bool lines = text.substr(at).starts_with(std::string(3, quote));
  at += lines ? 3 : 1;
  while (at < text.size()) {
    if (quote == '"' && text[at] == '\\') {
      at += 2;
    } else if (lines && text.substr(at).starts_with(std::string(3, quote))) {
      at += 3;
      while (at < text.size() && text[at] == quote) ++at;  // up to two quotes precede the end
      return at;
    } else if (!lines && (text[at] == quote || text[at] == '\n')) {
      return at + 1;
    } else {
      ++at;
    }
  }
  return text.size();
}

bool is_deep_json(std::string_view text) {
  int depth = 0;
  bool inside = false;  // inside a string
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (inside && c == '\\')
      ++at;
    else if (c == '"')
      inside = !inside;
    else if (!inside && (c == '{' || c == '['))
      ++depth;
    else if (!inside && (c == '}' || c == ']'))
      --depth;
    if (depth > kDeepestJson) return true;
  }
  return false;
}

}  // namespace

void refuse_deep_toml(std::string_view text, const std::string& name) {
  int line = 1, dots = 0;
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    if (c == '"' || c == '\'') {
      const std::size_t end = std::min(after_string_index(text, at), text.size());
      for (; at < end; ++at)
        if (text[at] == '\n') ++line;
      continue;
    }
    if (c == '#')
      while (at + 1 < text.size() && text[at + 1] != '\n') ++at;
    if (c == '\n') ++line;
    if (c == '.')
      ++dots;
    else if (c == '\n' || c == ',' || c == '=' || c == '[' || c == '{')
      dots = 0;
    if (dots > kMostDots)
      throw FileError(
          name,
          fmt::format(":{}: more than {} dots in one key; cellcal keys are not nested like that",
                      line, kMostDots));
    ++at;
  }
}

void refuse_deep_json(std::string_view text, const std::string& name) {
  if (is_deep_json(text))
    throw FileError(
        name, fmt::format(": nested deeper than {} levels; not a cellcal file", kDeepestJson));
}

nlohmann::json parse_json(std::string_view text) {
  if (is_deep_json(text)) return nlohmann::json::value_t::discarded;
  return nlohmann::json::parse(text, nullptr, false);
}

}  // namespace cellcal::calib

namespace cellcal::calib::fields {

Value<double> number(double per) {
  return {[per](const double& v) { return v * per; },
          [per](const JsonReader& r) { return r.number() / per; }};
}

Value<double> not_negative(double per) {
  return {[per](const double& v) { return v * per; },
          [per](const JsonReader& r) { return r.not_negative() / per; }};
}

Value<std::string> text() {
  return {[](const std::string& v) { return v; }, [](const JsonReader& r) { return r.text(); }};
}

Value<bool> flag() {
  return {[](const bool& v) { return v; }, [](const JsonReader& r) { return r.flag(); }};
}

Value<Eigen::Vector3d> vector(double per) {
  return {[per](const Eigen::Vector3d& v) -> Json {
            return {v.x() * per, v.y() * per, v.z() * per};
          },
          [per](const JsonReader& r) -> Eigen::Vector3d {
            const auto items = r.items();
            if (items.size() != 3) r.fail("must hold three numbers");
            return Eigen::Vector3d(items[0].number(), items[1].number(), items[2].number()) / per;
          }};
}

}  // namespace cellcal::calib::fields
