#include "sim/emulator/rsi_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>

#include "drivers/kuka/krl_read.h"
#include "drivers/kuka/wire_text.h"

namespace cellcal::sim {
namespace {

using drivers::RsiChannelFile;
using drivers::RsiContextFile;
using drivers::RsiElement;
using drivers::RsiObject;

constexpr int kAxes = 6;
// What the objects take where their parameters do not stand in the context.
constexpr double kUsualPrecision = 1, kUsualTimeout = 10, kUsualClampDeg = 5, kUsualMonitorDeg = 6;

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file && text.empty()) throw std::invalid_argument(path.string() + ": cannot be read");
  return text;
}

bool sends(const RsiChannelFile& file, const char* tag) {
  return std::any_of(file.send.begin(), file.send.end(),
                     [&](const RsiElement& one) { return drivers::wire::same_name(one.tag, tag); });
}

/// The tag in front of ".A1", and the channel of each axis in order.
struct Axes {
  std::string tag;
  bool hold_on = true;
  std::vector<int> channels;
};

Axes axes_of(const RsiChannelFile& file) {
  Axes axes;
  for (const RsiElement& one : file.receive) {
    const std::size_t dot = one.tag.find(".A");
    if (dot == std::string::npos) continue;
    if (axes.channels.empty()) axes = {one.tag.substr(0, dot), one.hold_on.value_or(true), {}};
    const std::string next =
        axes.tag + ".A" + std::to_string(static_cast<int>(axes.channels.size()) + 1);
    if (one.tag != next || one.hold_on.value_or(true) != axes.hold_on) {
      throw std::invalid_argument(
          fmt::format("{}:{}: {}: axes in another order, or some with HOLDON and some without, are "
                      "not emulated",
                      file.name, one.line, one.tag));
    }
    axes.channels.push_back(one.index);
  }
  if (axes.channels.size() != kAxes) {
    throw std::invalid_argument(file.name + ": RECEIVE holds no six axes TAG.A1 to TAG.A6");
  }
  return axes;
}

double number(const RsiObject& object, const std::string& name, double usual) {
  const drivers::RsiParameter* found = object.parameter(name);
  double value = usual;
  if (found != nullptr && !drivers::wire::parse_number(found->value, value)) {
    throw std::invalid_argument(fmt::format("RSI_CREATE: {} of {} is no number", name, object.id));
  }
  return value;
}

/// As the pendant says it.
void check_index(const RsiChannelFile& channel, const RsiContextFile& context,
                 const drivers::RsiInput& input) {
  const bool known = std::any_of(channel.receive.begin(), channel.receive.end(),
                                 [&](const RsiElement& e) { return e.index == input.from_index; });
  if (known) return;
  throw std::invalid_argument(fmt::format(
      "RSI_CREATE: Invalid index - signal output ({}:{}: {} output {}, which {} does not "
      "have)",
      context.name, input.line, input.from, input.from_index, channel.name));
}

void take_context(const RsiContextFile& context, const RsiChannelFile& channel, const Axes& axes,
                  ControllerConfig& controller) {
  const RsiObject* ethernet = context.only("ETHERNET");
  const RsiObject* corrector = context.only("AXISCORR");
  if (ethernet == nullptr || corrector == nullptr) {
    throw std::invalid_argument(context.name + ": no ETHERNET or no AXISCORR object");
  }
  const drivers::RsiParameter* named = ethernet->parameter("ConfigFile");
  if (named == nullptr || !drivers::wire::same_name(named->value, channel.name)) {
    throw std::invalid_argument(fmt::format("RSI_CREATE: {}: file {} not found", context.name,
                                            named == nullptr ? "" : named->value));
  }
  controller.precision = static_cast<int>(number(*ethernet, "Precision", kUsualPrecision));
  controller.timeout_cycles = static_cast<int>(number(*ethernet, "Timeout", kUsualTimeout));
  controller.clamp_deg = controller.monitor_deg = std::numeric_limits<double>::infinity();
  const RsiObject* monitor = context.only("AXISCORRMON");
  for (int i = 1; i <= kAxes; ++i) {
    const drivers::RsiInput* input = corrector->input(i);
    if (input == nullptr) throw std::invalid_argument(context.name + ": AXISCORR is not wired");
    check_index(channel, context, *input);
    if (input->from_index != axes.channels[static_cast<std::size_t>(i) - 1]) {
      throw std::invalid_argument(
          fmt::format("{}:{}: AXISCORR input {} takes another axis' channel, which is not emulated",
                      context.name, input->line, i));
    }
    const double low = number(*corrector, fmt::format("LowerLimA{}", i), -kUsualClampDeg);
    const double high = number(*corrector, fmt::format("UpperLimA{}", i), kUsualClampDeg);
    controller.clamp_deg = std::min({controller.clamp_deg, -low, high});
    controller.monitor_deg =
        std::min(controller.monitor_deg,
                 monitor == nullptr ? kUsualMonitorDeg
                                    : number(*monitor, fmt::format("MaxA{}", i), kUsualMonitorDeg));
  }
  if (const RsiObject* stop = context.only("STOP"); stop != nullptr && stop->input(1) != nullptr) {
    check_index(channel, context, *stop->input(1));
  }
}

}  // namespace

void load_rsi_files(const std::filesystem::path& channel_path,
                    const std::filesystem::path& context_path, EmulatorOptions& options) {
  const RsiChannelFile channel =
      drivers::read_rsi_channel(content(channel_path), channel_path.filename().string());
  if (channel.only_send.value || !sends(channel, "DEF_AIPos")) {
    throw std::invalid_argument(channel.name +
                                ": ONLYSEND, or packets without DEF_AIPos, are not emulated");
  }
  const Axes axes = axes_of(channel);
  ControllerConfig& controller = options.controller;
  options.pc_address = channel.ip_number.value;
  options.pc_port = static_cast<std::uint16_t>(channel.port.value);
  controller.sentype = channel.sentype.value;
  controller.axis_tag = axes.tag;
  controller.hold_on = axes.hold_on;
  controller.send_setpoint = sends(channel, "DEF_ASPos");
  controller.send_delay = sends(channel, "DEF_Delay");
  for (const RsiElement& one : channel.receive) {
    if (drivers::wire::same_name(one.type, "BOOL")) controller.stop_tag = one.tag;
  }
  if (context_path.empty()) return;
  take_context(drivers::read_rsi_context(content(context_path), context_path.filename().string()),
               channel, axes, controller);
}

}  // namespace cellcal::sim
