#pragma once
// Hardware of a device, according to /sys: a USB adapter and its suitability, or the network interface
// on the route to a board on Ethernet.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace cellcal::drivers {

struct Adapter {
  std::uint16_t vendor = 0, product = 0;
  std::string name;               ///< its product string
  std::optional<int> latency_ms;  ///< maximum buffering time; FTDI only
};

/// Current buffering time of the adapter; empty if it has no such timer.
std::optional<int> latency_ms_of(const std::string& device,
                                 const std::filesystem::path& sysfs = "/sys");

/// Empty: not a USB device, or absent. `sysfs` is /sys except in tests.
std::optional<Adapter> adapter_of(const std::string& device,
                                  const std::filesystem::path& sysfs = "/sys");

inline constexpr int kBestLatencyMs = 1;

enum class AdapterFit {
  kFits,
  kUntried,      ///< no evidence for or against it
  kRateUntried,  ///< the rate is in its data sheet
  kNoSuchRate,
  kHoldsBack,  ///< above 1 ms: delays every contact
  kTooLate,    ///< one lost heartbeat stops the arm
};

/// For this baud rate. Unknown adapters are not rejected.
AdapterFit fit_of(const Adapter& adapter, int baud);

/// Network interface used to reach the board.
struct BoardInterface {
  std::string name;
  bool wireless = false;
  bool carrier = true;            ///< false: no cable connected
  std::optional<int> speed_mbit;  ///< for wired links
};
std::optional<BoardInterface> interface_to(const std::string& device,
                                           const std::filesystem::path& sysfs = "/sys");

}  // namespace cellcal::drivers
