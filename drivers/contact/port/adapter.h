#pragma once
// What is behind a device, as the kernel's tree in /sys has it: a USB adapter, and whether it fits, or
// the network interface on the way to a board on Ethernet.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace cellcal::drivers {

struct Adapter {
  std::uint16_t vendor = 0, product = 0;
  std::string name;               ///< as it calls itself
  std::optional<int> latency_ms;  ///< it holds bytes back for so long at most; FTDI alone has this
};

/// How long the adapter holds bytes back, as it says now. Nothing: it has no such timer.
std::optional<int> latency_ms_of(const std::string& device,
                                 const std::filesystem::path& sysfs = "/sys");

/// Nothing: the device is not behind USB, or is not there. `sysfs` is /sys but in tests.
std::optional<Adapter> adapter_of(const std::string& device,
                                  const std::filesystem::path& sysfs = "/sys");

inline constexpr int kBestLatencyMs = 1;

enum class AdapterFit {
  kFits,
  kUntried,      ///< no reason known against it, and none for it
  kRateUntried,  ///< it has the rate by its data sheet
  kNoSuchRate,
  kHoldsBack,  ///< longer than 1 ms: in every contact's way
  kTooLate,    ///< so long that one lost heartbeat stops the arm
};

/// At this baud rate. No adapter is found unfit for what is not known of it.
AdapterFit fit_of(const Adapter& adapter, int baud);

/// The network interface that this computer reaches the board by.
struct BoardInterface {
  std::string name;
  bool wireless = false;
  bool carrier = true;            ///< false: nothing is plugged in
  std::optional<int> speed_mbit;  ///< of a wire that has one
};
std::optional<BoardInterface> interface_to(const std::string& device,
                                           const std::filesystem::path& sysfs = "/sys");

}  // namespace cellcal::drivers
