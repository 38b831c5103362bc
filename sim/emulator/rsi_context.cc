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

/// The channels of the axes A1 to A6, in order.
std::vector<int> axis_channels(const RsiChannelFile& file) {
  std::vector<int> channels;
  for (const RsiElement& one : file.receive) {
    const std::size_t dot = one.tag.find(".A");
    if (dot == std::string::npos) continue;
    const std::string next = ".A" + std::to_string(static_cast<int>(channels.size()) + 1);
    if (one.tag.substr(dot) != next) {
      throw std::invalid_argument(fmt::format("{}:{}: {}: axes in another order are not emulated",
                                              file.name, one.line, one.tag));
    }
    channels.push_back(one.index);
  }
  if (channels.size() != kAxes) {
    throw std::invalid_argument(file.name + ": RECEIVE holds no six axes TAG.A1 to TAG.A6");
  }
  return channels;
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

void take_context(const RsiContextFile& context, const RsiChannelFile& channel,
                  const std::vector<int>& axes, ControllerConfig& controller) {
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
    if (input->from_index != axes[static_cast<std::size_t>(i) - 1]) {
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

void load_rsi_context(EmulatorOptions& options) {
  const std::filesystem::path channel_path = options.rsi_xml, context_path = options.rsi_context;
  const RsiChannelFile channel =
      drivers::read_rsi_channel(content(channel_path), channel_path.filename().string());
  if (!options.pc_port_given) {
    options.pc_address = channel.ip_number.value;
    options.pc_port = static_cast<std::uint16_t>(channel.port.value);
  }
  take_context(drivers::read_rsi_context(content(context_path), context_path.filename().string()),
               channel, axis_channels(channel), options.controller);
}

}  // namespace cellcal::sim
