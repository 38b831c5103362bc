#include "sim/emulator/rsi_context.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::sim {
namespace {

using drivers::RsiChannelFile;
using drivers::RsiContextFile;
using drivers::RsiElement;
using drivers::RsiObject;

constexpr std::size_t kAxes = 6;
// Defaults of the objects for parameters absent from the context.
constexpr double kDefaultPrecision = 1, kDefaultTimeout = 10, kDefaultClampDeg = 5,
                 kDefaultMonitorDeg = 6;
constexpr double kDefaultClampMm = 5;

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file && text.empty()) throw std::invalid_argument(path.string() + ": cannot be read");
  return text;
}

/// Inputs of AXISCORR or POSCORR, in order.
std::string value_name(bool space, std::size_t i) {
  return space ? "." + std::string(drivers::wire::kFrameNames.substr(i, 1))
               : ".A" + std::to_string(i + 1);
}

/// Channels of the axes A1 to A6, or of X to C, in order.
std::vector<int> value_channels(const RsiChannelFile& file, bool space) {
  std::vector<int> channels;
  for (const RsiElement& one : file.receive) {
    const std::size_t dot = one.tag.find('.');
    if (dot == std::string::npos || one.index == 0) continue;
    const std::string value = one.tag.substr(dot);
    const bool meant = space ? value.size() == 2 : value.starts_with(".A") && value.size() == 3;
    if (!meant) continue;
    if (channels.size() < kAxes && value == value_name(space, channels.size())) {
      channels.push_back(one.index);
      continue;
    }
    throw std::invalid_argument(fmt::format("{}:{}: {}: values in another order are not emulated",
                                            file.name, one.line, one.tag));
  }
  if (channels.size() != kAxes) {
    throw std::invalid_argument(file.name + (space
                                                 ? ": RECEIVE holds no TAG.X to TAG.C"
                                                 : ": RECEIVE holds no six axes TAG.A1 to TAG.A6"));
  }
  return channels;
}

double number(const RsiObject& object, const std::string& name, double usual) {
  const drivers::RsiParameter* found = object.parameter(name);
  double value = usual;
  if (found != nullptr && !drivers::wire::parse_number(found->value, value)) {
    throw std::invalid_argument(fmt::format("RSI: {} of {} is not a number", name, object.id));
  }
  return value;
}

/// The program's call that loads the context.
const char* load_call(const RsiContextFile& context) {
  return context.rsi_version == 6 ? "RSI_LOAD" : "RSI_CREATE";
}

/// In the pendant's wording.
void check_index(const RsiChannelFile& channel, const RsiContextFile& context,
                 const drivers::RsiInput& input) {
  const bool known = std::any_of(channel.receive.begin(), channel.receive.end(),
                                 [&](const RsiElement& e) { return e.index == input.from_index; });
  if (known) return;
  throw std::invalid_argument(fmt::format(
      "{}: Invalid index - signal output ({}:{}: {} output {}, which {} does not have)",
      load_call(context), context.name, input.line, input.from, input.from_index, channel.name));
}

void apply_axis_limits(const RsiContextFile& context, const RsiObject& corrector,
                       ControllerConfig& controller) {
  controller.clamp_deg = controller.monitor_deg = std::numeric_limits<double>::infinity();
  const RsiObject* monitor = context.only("AXISCORRMON");
  for (std::size_t i = 1; i <= kAxes; ++i) {
    const double low = number(corrector, fmt::format("LowerLimA{}", i), -kDefaultClampDeg);
    const double high = number(corrector, fmt::format("UpperLimA{}", i), kDefaultClampDeg);
    controller.clamp_deg = std::min({controller.clamp_deg, -low, high});
    controller.monitor_deg = std::min(
        controller.monitor_deg,
        monitor == nullptr ? kDefaultMonitorDeg
                           : number(*monitor, fmt::format("MaxA{}", i), kDefaultMonitorDeg));
  }
}

void apply_space_limits(const RsiContextFile& context, const RsiObject& corrector,
                        ControllerConfig& controller) {
  controller.clamp_mm = std::numeric_limits<double>::infinity();
  for (const char axis : {'X', 'Y', 'Z'}) {
    const double low = number(corrector, fmt::format("LowerLim{}", axis), -kDefaultClampMm);
    const double high = number(corrector, fmt::format("UpperLim{}", axis), kDefaultClampMm);
    controller.clamp_mm = std::min({controller.clamp_mm, -low, high});
  }
  controller.clamp_turn_deg = number(corrector, "MaxRotAngle", kDefaultClampDeg);
  const int frame = static_cast<int>(number(corrector, "RefCorrSys", 1));
  constexpr int kTool = 3;
  if (frame < 0 || frame > kTool) {
    throw std::invalid_argument(
        fmt::format("{}: RefCorrSys {} is not emulated", context.name, frame));
  }
  controller.cartesian_system = frame == kTool ? CorrectionFrame::kTool : CorrectionFrame::kBase;
  const RsiObject* monitor = context.only("POSCORRMON");
  controller.monitor_mm =
      monitor == nullptr ? kDefaultMonitorDeg : number(*monitor, "MaxTrans", kDefaultMonitorDeg);
  controller.monitor_turn_deg =
      monitor == nullptr ? kDefaultMonitorDeg : number(*monitor, "MaxRotAngle", kDefaultMonitorDeg);
}

void check_release(const RsiContextFile& context, EmulatorOptions& options) {
  if (options.rsi_version == 0) options.rsi_version = context.rsi_version;
  if (drivers::rsi_format(options.rsi_version) == context.rsi_version) return;
  throw std::invalid_argument(fmt::format("{}: {}: a context of RSI {}, the controller has RSI {}",
                                          load_call(context), context.name, context.rsi_version,
                                          options.rsi_version));
}

}  // namespace

void apply_context(const RsiContextFile& context, const RsiChannelFile& channel,
                   ControllerConfig& controller) {
  const RsiObject* ethernet = context.only("ETHERNET");
  const RsiObject* corrector = context.only("AXISCORR");
  const bool space = corrector == nullptr && context.only("POSCORR") != nullptr;
  if (space) corrector = context.only("POSCORR");
  if (ethernet == nullptr || corrector == nullptr) {
    throw std::invalid_argument(context.name + ": no ETHERNET, or neither AXISCORR nor POSCORR");
  }
  const drivers::RsiParameter* named = ethernet->parameter("ConfigFile");
  if (named == nullptr || !drivers::wire::same_name(named->value, channel.name)) {
    throw std::invalid_argument(fmt::format("{}: {}: file {} not found", load_call(context),
                                            context.name, named == nullptr ? "" : named->value));
  }
  controller.precision = static_cast<int>(number(*ethernet, "Precision", kDefaultPrecision));
  controller.timeout_cycles = static_cast<int>(number(*ethernet, "Timeout", kDefaultTimeout));
  const std::vector<int> channels = value_channels(channel, space);
  for (std::size_t i = 0; i < kAxes; ++i) {
    const drivers::RsiInput* input = corrector->input(static_cast<int>(i) + 1);
    if (input == nullptr) {
      throw std::invalid_argument(fmt::format("{}: {} is not wired", context.name, corrector->id));
    }
    check_index(channel, context, *input);
    if (input->from_index != channels[i]) {
      throw std::invalid_argument(
          fmt::format("{}:{}: {} input {} takes another value's channel, which is not emulated",
                      context.name, input->line, corrector->id, i + 1));
    }
  }
  if (space) {
    apply_space_limits(context, *corrector, controller);
  } else {
    apply_axis_limits(context, *corrector, controller);
  }
  if (const RsiObject* stop = context.only("STOP"); stop != nullptr && stop->input(1) != nullptr) {
    check_index(channel, context, *stop->input(1));
  }
}

void load_rsi(EmulatorOptions& options) {
  if (!options.rsi_context.empty()) load_rsi_context(options);
  if (options.rsi_version == 6 && options.controller.cycle_ms != 4) {
    throw std::invalid_argument("RSI 6 has a cycle of 4 ms, and no other (--cycle-ms)");
  }
}

void load_rsi_context(EmulatorOptions& options) {
  const std::filesystem::path channel_path = options.rsi_xml, context_path = options.rsi_context;
  const RsiChannelFile channel =
      drivers::read_rsi_channel(content(channel_path), channel_path.filename().string());
  if (!options.pc_port_given) {
    options.pc_address = channel.ip_number.value;
    options.pc_port = static_cast<std::uint16_t>(channel.port.value);
  }
  const RsiContextFile context =
      drivers::read_rsi_context(content(context_path), context_path.filename().string());
  check_release(context, options);
  apply_context(context, channel, options.controller);
}

}  // namespace cellcal::sim
