#include "drivers/contact/port/port_errors.h"

#include <fmt/format.h>
#include <grp.h>
#include <libserialport.h>
#include <sys/stat.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace cellcal::drivers {

namespace {

std::string ports_here() {
  sp_port** ports = nullptr;
  if (sp_list_ports(&ports) != SP_OK) return "not known";
  std::string list;
  for (sp_port** p = ports; *p != nullptr; ++p) {
    const char* what = sp_get_port_description(*p);
    list += fmt::format("{}{}", list.empty() ? "" : ", ", sp_get_port_name(*p));
    if (what != nullptr && *what != '\0') list += fmt::format(" ({})", what);
  }
  sp_free_port_list(ports);
  return list.empty() ? "none" : list;
}

std::string group_of(const std::string& device) {
  struct stat info {};
  if (::stat(device.c_str(), &info) != 0) return {};
  group entry{};
  group* found = nullptr;
  std::array<char, 4096> buffer{};
  if (::getgrgid_r(info.st_gid, &entry, buffer.data(), buffer.size(), &found) != 0 ||
      found == nullptr) {
    return fmt::format("{}", info.st_gid);
  }
  return found->gr_name;
}

}  // namespace

std::string no_such_device(const std::string& device) {
  return fmt::format("{}: no such device. Plug the sensor in (ports found: {})", device,
                     ports_here());
}

std::string cannot_open(const std::string& device, int error) {
  switch (error) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return no_such_device(device);
    case EACCES:
    case EPERM:
      if (group_of(device) == "root")  // membership in root would grant this program everything
        return fmt::format(
            "{}: no permission: no group but root may open the device. Install systemd/70-cellcal.rules "
            "(group 'dialout'), unplug and plug the sensor",
            device);
      return fmt::format(
          "{}: no permission: the device belongs to group '{}'. Add this program's user to it "
          "(usermod -aG {} USER) and log in again",
          device, group_of(device), group_of(device));
    case EBUSY:
    case EAGAIN:
      return fmt::format("{}: in use by another program. Stop it first (fuser -v {})", device,
                         device);
    case ENOTTY:
      return fmt::format("{}: not a serial port", device);
    default:
      return fmt::format("{}: cannot be opened: {}", device, std::strerror(error));
  }
}

}  // namespace cellcal::drivers
