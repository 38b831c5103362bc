#include "drivers/contact/port/adapter.h"

#include <ifaddrs.h>
#include <sys/socket.h>
#include <unistd.h>

#include <charconv>
#include <chrono>
#include <cstdlib>
#include <fstream>

#include "drivers/contact.h"
#include "drivers/contact/port/port.h"
#include "drivers/contact/wire/ctp.h"

namespace cellcal::drivers {

namespace {

namespace fs = std::filesystem;

enum Vendor : std::uint16_t {
  kFtdi = 0x0403,
  kSilabs = 0x10C4,
  kWch = 0x1A86,
  kArduino = 0x2341,
  kArduinoOrg = 0x2A03,
};
/// The Uno's ATmega16U2, by either manufacturer; their other boards have other processors.
constexpr std::uint16_t kUno = 0x0043, kUnoFirst = 0x0001, kUnoLater = 0x0243;

/// Allows for one lost heartbeat and a delay of the next within the host's timeout.
constexpr int kLongestLatencyMs =
    static_cast<int>(kHeartbeatLimit.count()) - 2 * int{CTP_KEEPALIVE_MS} - 1;
/// Highest exact rate of older CP210x (AN205, table 1: then 256 000 ... 921 600).
constexpr int kOldSilabsBaud = 250'000;

std::string line_of(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

std::optional<std::uint16_t> hex_of(const fs::path& file) {
  const std::string text = line_of(file);
  std::uint16_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc{} || text.empty()) return std::nullopt;
  return value;
}

/// The device node after resolving links.
fs::path node_of(const std::string& device) {
  std::error_code error;
  const fs::path real = fs::weakly_canonical(device, error);
  return error ? fs::path(device) : real;
}

fs::path tty_of(const std::string& device, const fs::path& sysfs) {
  return sysfs / "class/tty" / node_of(device).filename() / "device";
}

/// Directory of the USB device at /dev/bus/usb/BBB/DDD. Empty: none.
fs::path usb_of(const fs::path& node, const fs::path& sysfs) {
  if (node.string().rfind("/dev/bus/usb/", 0) != 0) return {};
  const auto number = [](const std::string& text) { return std::atoi(text.c_str()); };
  std::error_code error;
  for (const fs::directory_entry& at : fs::directory_iterator(sysfs / "bus/usb/devices", error)) {
    if (number(line_of(at.path() / "busnum")) == number(node.parent_path().filename().string()) &&
        number(line_of(at.path() / "devnum")) == number(node.filename().string())) {
      return at;
    }
  }
  return {};
}

fs::path device_of(const std::string& device, const fs::path& sysfs) {
  const fs::path usb = usb_of(node_of(device), sysfs);
  return usb.empty() ? tty_of(device, sysfs) : usb;
}

/// These derive any rate from 48 MHz; older ones use a table.
bool calculates_rates(const std::string& name) {
  for (const char* one : {"CP2102N", "CP2104", "CP2105", "CP2108"}) {
    if (name.find(one) != std::string::npos) return true;
  }
  return false;
}

BoardInterface read_interface(const std::string& name, const fs::path& sysfs) {
  const fs::path at = sysfs / "class/net" / name;
  BoardInterface found;
  found.name = name;
  std::error_code error;
  found.wireless = fs::exists(at / "wireless", error);
  found.carrier = line_of(at / "carrier") != "0";
  const std::string speed = line_of(at / "speed");
  int mbit = 0;
  std::from_chars(speed.data(), speed.data() + speed.size(), mbit);
  if (mbit > 0) found.speed_mbit = mbit;
  return found;
}

/// This computer's address on the route to the board.
std::optional<in_addr> own_address(const sockaddr_in& board) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return std::nullopt;
  sockaddr_in own{};
  socklen_t size = sizeof own;
  const bool known = ::connect(fd, reinterpret_cast<const sockaddr*>(&board), sizeof board) == 0 &&
                     ::getsockname(fd, reinterpret_cast<sockaddr*>(&own), &size) == 0;
  ::close(fd);
  if (!known) return std::nullopt;
  return own.sin_addr;
}

}  // namespace

std::optional<int> latency_ms_of(const std::string& device, const fs::path& sysfs) {
  std::ifstream in(tty_of(device, sysfs) / "latency_timer");
  int ms = 0;
  if (!(in >> ms) || ms < 0) return std::nullopt;
  return ms;
}

std::optional<Adapter> adapter_of(const std::string& device, const fs::path& sysfs) {
  std::error_code error;
  fs::path at = fs::canonical(device_of(device, sysfs), error);
  if (error) return std::nullopt;
  const fs::path top = fs::canonical(sysfs, error);
  for (; !at.empty() && at != top && at != at.root_path(); at = at.parent_path()) {
    const auto vendor = hex_of(at / "idVendor"), product = hex_of(at / "idProduct");
    if (vendor && product) {
      return Adapter{*vendor, *product, line_of(at / "product"), latency_ms_of(device, sysfs)};
    }
  }
  return std::nullopt;
}

AdapterFit fit_of(const Adapter& adapter, int baud) {
  if (adapter.latency_ms && *adapter.latency_ms > kLongestLatencyMs) return AdapterFit::kTooLate;
  if (adapter.latency_ms && *adapter.latency_ms > kBestLatencyMs) return AdapterFit::kHoldsBack;
  switch (adapter.vendor) {
    case kFtdi:
    case kWch: return AdapterFit::kFits;
    case kSilabs:
      if (baud <= kOldSilabsBaud) return AdapterFit::kFits;
      return calculates_rates(adapter.name) ? AdapterFit::kRateUntried : AdapterFit::kNoSuchRate;
    case kArduino:
    case kArduinoOrg:
      return adapter.product == kUno || adapter.product == kUnoFirst || adapter.product == kUnoLater
                 ? AdapterFit::kFits
                 : AdapterFit::kUntried;
    default: return AdapterFit::kUntried;
  }
}

std::optional<BoardInterface> interface_to(const std::string& device, const fs::path& sysfs) {
  const std::optional<sockaddr_in> board = udp_device_of(device);
  const std::optional<in_addr> own = board ? own_address(*board) : std::nullopt;
  ifaddrs* all = nullptr;
  if (!own || ::getifaddrs(&all) != 0) return std::nullopt;
  std::optional<BoardInterface> found;
  for (const ifaddrs* one = all; one != nullptr && !found; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    const auto* address = reinterpret_cast<const sockaddr_in*>(one->ifa_addr);
    if (address->sin_addr.s_addr == own->s_addr) found = read_interface(one->ifa_name, sysfs);
  }
  ::freeifaddrs(all);
  return found;
}

}  // namespace cellcal::drivers
