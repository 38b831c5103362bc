#include <fmt/format.h>

#include <algorithm>

#include "drivers/kuka/krl/krl_rsi_parts.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers::krl {
namespace {

constexpr double kTravelRounding = 1e-9;

/// Name of a corrected axis in messages.
std::string driven(const AxisRange& range, std::size_t axis) {
  return range.linear ? "the linear unit" : fmt::format("E{} of the positioner", axis + 1);
}

void check_external_sent(const RsiSet& set) {
  if (set.config.external_axes == 0) return;
  for (const char* tag : {"DEF_EIPos", "DEF_ESPos"}) {
    if (set.sent(tag) != nullptr || !set.config.external.empty()) {
      set.check_internal(tag);
    } else {
      set.findings.warn(set.channel.name, 0,
                        "SEND: {} is missing: external axes ([controller] external_axes) that move "
                        "unasked would not be noticed. Make the files again",
                        tag);
    }
  }
}

void check_travel_received(const RsiSet& set, std::size_t axis) {
  const std::string tag = travel_tag(set.config, axis);
  const RsiElement* one = set.received(tag);
  if (one == nullptr)
    return set.findings.refuse(set.channel.name, 0,
                               "RECEIVE: {} is missing ([rsi] external_axis_tag = \"{}\"): {} "
                               "could not move. Make the files again",
                               tag, set.config.external_axis_tag,
                               driven(set.config.external[axis], axis));
  if (one->index == 0 || !wire::same_name(one->type, "DOUBLE"))
    set.findings.refuse(set.channel.name, one->line,
                        "{} must have TYPE=\"DOUBLE\" and a channel number as its INDX", tag);
  check_hold(set, *one);
}

void check_reach(const RsiSet& set, const RsiContextFile& file, const RsiObject& corrector,
                 std::size_t axis) {
  const AxisRange& range = set.config.external[axis];
  const double limit = travel_limit(range);
  const RsiObject* monitor = file.only("AXISCORRMON");
  const std::string lower = fmt::format("LowerLimE{}", axis + 1),
                    upper = fmt::format("UpperLimE{}", axis + 1),
                    total = fmt::format("MaxE{}", axis + 1);
  const ParameterValue low = value_of(set, file, corrector, lower, -kRsiClamp);
  const ParameterValue high = value_of(set, file, corrector, upper, kRsiClamp);
  ParameterValue most{kRsiMonitor, 0};
  if (monitor != nullptr) most = value_of(set, file, *monitor, total, kRsiMonitor);
  struct Limit {
    const std::string& name;
    double reach;
    int line;
    const char* otherwise;
  };
  for (const Limit& one : {Limit{lower, -low.value, low.line, "be silently clamped"},
                           Limit{upper, high.value, high.line, "be silently clamped"},
                           Limit{total, most.value, most.line, "stop with KSS29000"}}) {
    if (one.reach >= limit - kTravelRounding) continue;
    set.findings.refuse(file.name, one.line,
                        "{} allows {} {} from the start, {} {} {}: it would {}. Make the files "
                        "again with the cell file (--cell)",
                        one.name, one.reach, range.linear ? "mm" : "deg", driven(range, axis),
                        range.linear ? "travels" : "turns by up to", limit, one.otherwise);
  }
}

void check_object(const RsiSet& set, const RsiContextFile& file) {
  const RsiObject* corrector = file.only("AXISCORREXT");
  const std::vector<AxisRange>& external = set.config.external;
  if (corrector == nullptr) {
    if (!external.empty())
      set.findings.refuse(file.name, 0,
                          "the AXISCORREXT object is missing: {} could not move. Make the files "
                          "again with the cell file (--cell)",
                          driven(external[0], 0));
    return;
  }
  if (external.empty())
    return set.findings.refuse(file.name, corrector->line,
                               "{} corrects external axes, and neither a linear unit nor a "
                               "positioner is known. Give the cell file (--cell), or remove it",
                               corrector->id);
  const int first = file.rsi_version == 3 ? kRsi3ExternalInput : 1;
  for (int input = first + static_cast<int>(external.size()); input < first + kMostExternal;
       ++input)
    if (corrector->input(input) != nullptr)
      set.findings.refuse(file.name, corrector->input(input)->line,
                          "{} corrects E{}, which the robot file does not move. Give the cell file "
                          "(--cell), or remove input {}",
                          corrector->id, input - first + 1, input);
  const RsiObject* ethernet = file.only("ETHERNET");
  if (ethernet == nullptr) return;  // reported already
  for (std::size_t i = 0; i < external.size(); ++i) {
    check_wire(set, file, *corrector, first + static_cast<int>(i), ethernet->id,
               travel_tag(set.config, i));
    check_reach(set, file, *corrector, i);
  }
}

}  // namespace

const char* travel_corrector(const RsiFilesConfig& config) {
  return config.rsi_version == 3 ? "AXISCORREXT1" : "AxisCorrExt_1";
}

std::string travel_tag(const RsiFilesConfig& config, std::size_t axis) {
  return fmt::format("{}.E{}", config.external_axis_tag, axis + 1);
}

void check_travel(const RsiSet& set, const RsiContextFile* context) {
  check_external_sent(set);
  for (std::size_t i = 0; i < set.config.external.size(); ++i) check_travel_received(set, i);
  if (context != nullptr) check_object(set, *context);
}

}  // namespace cellcal::drivers::krl
