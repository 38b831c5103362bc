#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/kuka/krl/krl_rsi.h"
#include "drivers/kuka/krl/krl_rsi_parts.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers::krl {
namespace {

constexpr std::size_t kFencedAxes = 6;
constexpr std::string_view kLimit = "LIMIT=", kOfTravel = "_E";
/// Difference between measured angles, which the limits are computed from, and commanded ones:
/// targets at the end of a range stay reachable.
constexpr double kRangeSlackDeg = 0.1;

const char* corrector(const RsiFilesConfig& config) {
  return config.rsi_version == 3 ? "AXISCORR1" : "AxisCorr_1";
}

bool sets_limits(const std::string& text, const RsiFilesConfig& config) {
  const std::vector<Placed<std::string>> lines = statements(text);
  return std::any_of(lines.begin(), lines.end(), [&](const Placed<std::string>& one) {
    return find_call(one.value, calls_of(config).set) != std::string::npos;
  });
}

/// A function of the limits of an external axis, by its heading.
bool bounds_travel(const std::string& heading) {
  return std::ranges::any_of(std::array{"CC_LOW", "CC_HIGH"}, [&](const char* function) {
    return heading.find(fmt::format("{}{}", function, kOfTravel)) != std::string::npos;
  });
}

/// Lower and upper limit of an axis, degrees or millimetres; `range`: null if unknown.
void add_limits(std::vector<FenceLimit>& limits, const char* object, const std::string& axis,
                std::size_t number, const AxisRange* range, const std::string& ending) {
  for (const bool lower : {true, false}) {
    const std::string soft = fmt::format("$SOFT{}_END[{}]", lower ? 'N' : 'P', number);
    std::string span = soft;
    if (range != nullptr)
      span = fmt::format(
          "{:.1f}", lower ? range->low_deg - kRangeSlackDeg : range->high_deg + kRangeSlackDeg);
    limits.push_back({object, fmt::format("{}Lim{}", lower ? "Lower" : "Upper", axis),
                      fmt::format("{}{}({},{},$AXIS_ACT_MEAS.{})", lower ? "CC_LOW" : "CC_HIGH",
                                  ending, soft, span, axis),
                      lower});
  }
}

}  // namespace

std::string travel_fence(std::size_t axis) { return fmt::format("{}{}", kOfTravel, axis + 1); }

std::vector<FenceLimit> fence_limits(const RsiFilesConfig& config) {
  std::vector<FenceLimit> limits;
  for (std::size_t i = 0; i < kFencedAxes; ++i) {
    const AxisRange* range = config.ranges_deg.empty() ? nullptr : &config.ranges_deg.at(i);
    add_limits(limits, corrector(config), fmt::format("A{}", i + 1), i + 1, range, "");
  }
  for (std::size_t i = 0; i < config.external.size(); ++i)
    add_limits(limits, travel_corrector(config), fmt::format("E{}", i + 1), kFencedAxes + 1 + i,
               config.ranges_deg.empty() ? nullptr : &config.external[i], travel_fence(i));
  return limits;
}

void check_public(const ControllerFiles& files, const RsiContextFile& context,
                  const RsiFilesConfig& config, Findings& findings) {
  const RsiObject *arm = context.only("AXISCORR"), *external = context.only("AXISCORREXT");
  if (arm == nullptr || config.space.on) return;  // reported already
  for (const auto& [name, text] : files) {
    if (!(name.ends_with(".src") || name.ends_with(".SRC")) || !sets_limits(text, config)) continue;
    for (const FenceLimit& one : fence_limits(config)) {
      const RsiObject* object = one.object == travel_corrector(config) ? external : arm;
      const RsiParameter* limit = object == nullptr ? nullptr : object->parameter(one.parameter);
      if (limit == nullptr || limit->open) continue;
      return findings.refuse(context.name, limit->line,
                             "{} of {} lacks IsPublic=\"true\": {} cannot set it and halts. Make "
                             "the files again",
                             one.parameter, object->id, name);
    }
  }
}

void leave_out_limits(const std::string& scope, std::string& statement) {
  double limit = 0.0;
  const std::size_t span = statement.find(',');
  if (scope == "CC_FENCE" && statement.starts_with("LIMIT=CC_") && span != std::string::npos) {
    statement.erase(span, statement.find(',', span + 1) - span);
  } else if ((scope == "CC_LOW" || scope == "CC_HIGH") && statement.starts_with(kLimit) &&
             wire::parse_number(statement.substr(kLimit.size()), limit)) {
    statement = limit < 0.0 ? "LIMIT=-" : "LIMIT=";
  }
}

void check_fence(const std::string& name, const std::string& text, const RsiFilesConfig& config,
                 Findings& findings) {
  const std::vector<Placed<std::string>> lines = statements(text);
  const auto first = [&](const std::string& part) {
    return std::find_if(lines.begin(), lines.end(), [&](const Placed<std::string>& one) {
      return one.value.find(part) != std::string::npos;
    });
  };
  const auto on = first(calls_of(config).on + std::string("("));
  if (on == lines.end()) return;
  if (!sets_limits(text, config)) {
    return findings.warn(
        name, on->line,
        "no call sets AXISCORR's limits: the correction is limited by correction_limit_deg = {:g} on both "
        "sides of the start, not by the software limit switches. Make the files again",
        config.correction_limit_deg);
  }
  bool of_travel = false;
  for (const Placed<std::string>& one : lines) {
    double limit_deg = 0.0;
    if (one.value.starts_with("DEFFCT")) of_travel = bounds_travel(one.value);
    if (of_travel || !one.value.starts_with(kLimit) ||
        !wire::parse_number(one.value.substr(kLimit.size()), limit_deg) ||
        std::abs(limit_deg) >= config.correction_limit_deg)
      continue;
    return findings.refuse(name, one.line,
                           "the fence is {:g} deg, [rsi] correction_limit_deg is {:g}: moves would "
                           "be silently clamped. Make the files again",
                           std::abs(limit_deg), config.correction_limit_deg);
  }
  const bool called = std::any_of(lines.begin(), on, [](const Placed<std::string>& one) {
    return one.value.find("CC_FENCE(") != std::string::npos && !one.value.starts_with("DEF");
  });
  if (!called) {
    return findings.refuse(name, on->line,
                           "CC_FENCE is not called before {}: nothing sets the limits. Make the "
                           "files again",
                           calls_of(config).on);
  }
  RsiFilesConfig switches_alone = config;
  switches_alone.ranges_deg.clear();
  const std::vector<FenceLimit> wide = fence_limits(switches_alone), wanted = fence_limits(config);
  const FenceLimit* other = nullptr;
  std::size_t by_switches = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const FenceLimit& one = wanted[i];
    if (first(fmt::format(",\"{}\",\"{}\",LIMIT)", one.object, one.parameter)) == lines.end()) {
      return findings.refuse(name, on->line, "no call sets {} of {}. Make the files again",
                             one.parameter, one.object);
    }
    // Ranges are unknown without a cell file, and then not compared.
    const std::string value = config.ranges_deg.empty()
                                  ? wide[i].value.substr(0, wide[i].value.find(',') + 1)
                                  : one.value;
    if (first(std::string(kLimit) + value) != lines.end()) continue;
    if (other == nullptr) other = &one;
    by_switches += first(std::string(kLimit) + wide[i].value) != lines.end() ? 1 : 0;
  }
  if (other == nullptr) return;
  if (by_switches == wanted.size()) {
    return findings.warn(name, on->line,
                         "the fence is that of the software limit switches alone, without the "
                         "cell's ranges. Make the files again with the cell file (--cell)");
  }
  findings.refuse(name, on->line,
                  "{} is not LIMIT={}: the fence is not that of this cell. Make the files again "
                  "with the cell file (--cell)",
                  other->parameter, other->value);
}

}  // namespace cellcal::drivers::krl
