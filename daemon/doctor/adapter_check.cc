#include "daemon/doctor/adapter_check.h"

#include <fmt/format.h>

#include <filesystem>

#include "drivers/contact.h"
#include "drivers/contact/wire/ctp.h"

namespace cellcal::daemon {

void judge_adapter(const std::string& device, const std::optional<drivers::Adapter>& adapter,
                   int baud, Findings& findings) {
  using drivers::AdapterFit;
  const std::string check = "contact adapter";
  if (!adapter) {
    findings.skip(check, fmt::format("{} is not a USB adapter of this computer", device));
    return;
  }
  const std::string who =
      fmt::format("{} ({:04x}:{:04x})", adapter->name.empty() ? "no name" : adapter->name,
                  adapter->vendor, adapter->product);
  const std::string tty = std::filesystem::path(device).filename().string();
  const std::string timer = fmt::format(
      "install systemd/70-cellcal.rules and plug the sensor in again. Until then, as root: "
      "echo 1 > /sys/class/tty/{}/device/latency_timer",
      tty);
  constexpr const char* kSlower =
      "connect D4 to GND, reset the board and set baud = 250000 under [contact]. Or use a "
      "board with another USB chip (drivers/contact/firmware/README.md, Adapters)";
  switch (drivers::fit_of(*adapter, baud)) {
    case AdapterFit::kFits:
      findings.ok(check, adapter->latency_ms
                             ? fmt::format("{}, latency timer {} ms", who, *adapter->latency_ms)
                             : who);
      break;
    case AdapterFit::kTooLate:
      findings.fail(
          check,
          fmt::format(
              "latency timer {1} ms of {0}: {2} ms with one lost heartbeat, and the arm stops "
              "at {3} ms",
              who, *adapter->latency_ms, *adapter->latency_ms + 2 * int{CTP_KEEPALIVE_MS},
              drivers::kHeartbeatLimit.count()),
          timer);
      break;
    case AdapterFit::kHoldsBack:
      findings.warn(check, fmt::format("{}: latency timer {} ms", who, *adapter->latency_ms),
                    timer);
      break;
    case AdapterFit::kNoSuchRate:
      findings.fail(check, fmt::format("{1} baud not supported by {0}", who, baud), kSlower);
      break;
    case AdapterFit::kRateUntried:
      findings.warn(
          check,
          fmt::format("{1} baud supported by {0} according to its data sheet, but not tested", who,
                      baud),
          std::string("if the sensor does not answer: ") + kSlower);
      break;
    case AdapterFit::kUntried:
      findings.warn(check, who + ": this adapter is not tested",
                    "if bytes come late or not at all, use a tested one "
                    "(drivers/contact/firmware/README.md, Adapters)");
      break;
  }
}

void judge_interface(const std::optional<drivers::BoardInterface>& way, Findings& findings) {
  const std::string check = "contact adapter";
  if (!way) {
    findings.fail(check, "0 network interfaces lead to the board",
                  "set an address of the board's network on its network card "
                  "(drivers/contact/firmware/README.md, Ethernet)");
  } else if (!way->carrier) {
    findings.fail(check, way->name + ": no link",
                  "plug the cable in; both lamps at the sockets light");
  } else if (way->wireless) {
    findings.warn(check, way->name + " is wireless: datagrams come late or not at all",
                  "use a cable from the board to this computer");
  } else {
    findings.ok(check, way->speed_mbit ? fmt::format("{}, {} Mbit/s", way->name, *way->speed_mbit)
                                       : way->name);
  }
}

}  // namespace cellcal::daemon
