// Verification of RSI's context: objects, wiring against the ethernet XML's channels, limits.

#include "drivers/kuka/krl/krl_verify.h"

#include "drivers/kuka/krl/krl_rsi.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers::krl {

namespace {

constexpr int kContextAxes = 6;
constexpr int kFewestDecimals = 4;  // 1e-4 deg: 2.5 um at 1.4 m
constexpr int kExitMoveCorr = 4;
constexpr double kRounding = 1e-9;
constexpr const char* kLimitKey = "correction_limit_deg";

void check_ethernet(const RsiSet& set, const RsiContextFile& file, const RsiObject& ethernet) {
  const ParameterValue precision = value_of(set, file, ethernet, "Precision", kRsiPrecision);
  if (precision.value < kFewestDecimals) {
    set.findings.refuse(file.name, precision.line,
                        "Precision is {}: AIPos with {} decimals is too coarse to calibrate. "
                        "Set 4 or more",
                        precision.value, precision.value);
  }
  const ParameterValue timeout = value_of(set, file, ethernet, "Timeout", kRsiTimeout);
  if (timeout.value != set.config.timeout_cycles) {
    set.findings.warn(file.name, timeout.line, "Timeout is {}, [controller] timeout_cycles is {}",
                      timeout.value, set.config.timeout_cycles);
  }
}

void check_limits(const RsiSet& set, const RsiContextFile& file, const RsiObject& corrector) {
  const double limit = set.config.correction_limit_deg;
  for (int i = 1; i <= kContextAxes; ++i)
    for (const double sign : {-1.0, 1.0})
      check_bound(set, file, corrector,
                  {fmt::format("{}LimA{}", sign < 0.0 ? "Lower" : "Upper", i), kLimitKey, "deg",
                   limit, kRsiClamp, sign, kClamped});
}

void check_monitor(const RsiSet& set, const RsiContextFile& file, const RsiObject* monitor) {
  const double limit = set.config.correction_limit_deg;
  if (monitor == nullptr) {
    if (set.config.space.on) {
      set.findings.warn(file.name, 0,
                        "AXISCORRMON is missing: if it also counts corrections in space, it "
                        "stops at {} deg",
                        kRsiMonitor);
    } else if (limit > kRsiMonitor) {
      set.findings.refuse(file.name, 0,
                          "AXISCORRMON is missing: it then stops at {} deg, [rsi] "
                          "correction_limit_deg is {}",
                          kRsiMonitor, limit);
    }
    return;
  }
  for (int i = 1; i <= kContextAxes; ++i)
    check_bound(set, file, *monitor,
                {fmt::format("MaxA{}", i), kLimitKey, "deg", limit, kRsiMonitor, 1.0, kStopped});
}

void check_stop(const RsiSet& set, const RsiContextFile& file, const RsiObject* stop,
                const std::string& ethernet) {
  if (stop == nullptr) {
    set.findings.refuse(file.name, 0,
                        "the STOP object is missing: every session would end with a fault. Add it");
    return;
  }
  check_wire(set, file, *stop, 1, ethernet, set.config.stop_tag);
  const RsiParameter* named = stop->parameter("Mode");
  const bool by_name = named != nullptr && named->value == "ExitMoveCorr";
  const ParameterValue mode =
      by_name ? ParameterValue{kExitMoveCorr, named->line} : value_of(set, file, *stop, "Mode", 0);
  if (mode.value != kExitMoveCorr) {
    set.findings.refuse(file.name, mode.line,
                        "Mode of {} is {}. Set 4 (ExitMoveCorr): no other mode ends RSI_MOVECORR",
                        stop->id, mode.value);
  }
  const RsiParameter* channel = stop->parameter("Channel");
  if (channel != nullptr && file.rsi_version == 3) {
    // Published contexts of RSI 3 differ here, and one controller is known to have ignored
    // corrections.
    set.findings.warn(file.name, channel->line,
                      "{} has a Channel: some RSI 3 controllers then silently ignore all "
                      "corrections. Remove it if the arm does not move",
                      stop->id);
  }
}

void check_spelling(const RsiSet& set, const RsiContextFile& file) {
  for (const auto& [three, four] :
       {std::pair{"ETHERNET", "Ethernet"}, std::pair{"AXISCORR", "AxisCorr"},
        std::pair{"AXISCORRMON", "AxisCorrMon"}, std::pair{"AXISCORREXT", "AxisCorrExt"},
        std::pair{"POSCORR", "PosCorr"}, std::pair{"POSCORRMON", "PosCorrMon"},
        std::pair{"STOP", "Stop"}, std::pair{"STATUS", "Status"}, std::pair{"DIGIN", "DigIn"}}) {
    for (const RsiObject& one : file.objects) {
      const char* right = file.rsi_version == 3 ? three : four;
      if (!wire::same_name(one.type, three) || one.type == right) continue;
      set.findings.refuse(file.name, one.line, "the ObjType \"{}\" is spelled \"{}\" in RSI {}",
                          one.type, right, file.rsi_version);
    }
  }
}

}  // namespace

ParameterValue value_of(const RsiSet& set, const RsiContextFile& file, const RsiObject& object,
                        const std::string& name, double usual) {
  const RsiParameter* found = object.parameter(name);
  if (found == nullptr) return {usual, object.line};
  ParameterValue value{usual, found->line};
  if (!wire::parse_number(found->value, value.value)) {
    set.findings.refuse(file.name, found->line, "{} of {} is not a number", name, object.id);
  }
  return value;
}

void check_bound(const RsiSet& set, const RsiContextFile& file, const RsiObject& object,
                 const Bound& bound) {
  const ParameterValue have =
      value_of(set, file, object, bound.parameter, bound.sign * bound.usual);
  if (bound.sign * have.value >= bound.limit - kRounding) return;
  set.findings.refuse(file.name, have.line,
                      "{} of {} is {} {}, [rsi] {} is {}: {}. Raise the one or lower the other",
                      bound.parameter, object.id, have.value, bound.unit, bound.key, bound.limit,
                      bound.then);
}

void check_wire(const RsiSet& set, const RsiContextFile& file, const RsiObject& object, int input,
                const std::string& ethernet, const std::string& tag) {
  const RsiElement* element = set.received(tag);
  if (element == nullptr || element->index == 0) return;  // reported already
  const RsiInput* found = object.input(input);
  if (found == nullptr) {
    set.findings.refuse(file.name, object.line, "{}: input {} is not connected. Connect {}",
                        object.id, input, tag);
  } else if (found->from != ethernet || found->from_index != element->index) {
    set.findings.refuse(file.name, found->line,
                        "{}: input {} comes from {} output {}; {} is channel {} of {} (INDX in "
                        "line {}), so it must come from {} output {}",
                        object.id, input, found->from, found->from_index, tag, element->index,
                        ethernet, element->line, ethernet, element->index);
  }
}

void check_context(const RsiSet& set, const RsiContextFile& file) {
  check_spelling(set, file);
  const RsiObject* ethernet = file.only("ETHERNET");
  const bool space = set.config.space.on;
  const char* const wanted = space ? "POSCORR" : "AXISCORR";
  const char* const other = space ? "AXISCORR" : "POSCORR";
  const RsiObject* corrector = file.only(wanted);
  if (const RsiObject* beside = file.only(other); beside != nullptr) {
    if (corrector != nullptr) {
      set.findings.refuse(file.name, beside->line,
                          "{} corrects in addition to {}: the result is not defined. Remove it",
                          beside->id, wanted);
    } else {
      set.findings.refuse(file.name, beside->line,
                          "{} corrects, but [rsi] correction is \"{}\". Set it to \"{}\", or "
                          "use {} instead",
                          beside->id, space ? "space" : "axes", space ? "axes" : "space", wanted);
    }
  }
  if (ethernet == nullptr || corrector == nullptr) {
    set.findings.refuse(file.name, 0, "the {} object is missing",
                        ethernet == nullptr ? "ETHERNET" : wanted);
    return;
  }
  check_ethernet(set, file, *ethernet);
  for (int i = 1; i <= kContextAxes; ++i)
    check_wire(set, file, *corrector, i, ethernet->id, set.tag(i));
  if (space) {
    check_space(set, file, *corrector);
  } else {
    check_limits(set, file, *corrector);
  }
  check_monitor(set, file, file.only("AXISCORRMON"));
  check_stop(set, file, file.only("STOP"), ethernet->id);
}

}  // namespace cellcal::drivers::krl
