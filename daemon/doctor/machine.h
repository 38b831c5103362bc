#pragma once
// This computer, as far as a cell depends on it: addresses, ports, rights. Linux.

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace cellcal::daemon {

/// IPv4 addresses of this computer's interfaces, as "192.168.1.10".
/// None where the kernel may not be asked for them, as in the service's sandbox.
std::vector<std::string> own_addresses();
/// Whether this IPv4 address is one of this computer's; in the sandbox, too.
bool is_own_address(const std::string& address);

/// Who has a UDP socket on this port: "TestServer (process 812)", or only whose it is where the
/// program may not be looked at ("a program of user kuka"). Nothing: nobody has.
std::optional<std::string> holder_of_udp_port(std::uint16_t port);

/// What a process may do.
struct ProcessRights {
  std::string who;  ///< "cellcald (process 77)", or "the service's unit"
  std::optional<uid_t> uid;
  std::vector<gid_t> groups;
  bool realtime = false;       ///< SCHED_FIFO at the robot's priority
  bool locked_memory = false;  ///< without a limit
};

/// From /proc. Nothing where it does not exist any more.
std::optional<ProcessRights> rights_of_process(pid_t process);

/// The process that listens on this Unix-domain socket; nothing where nobody does.
std::optional<pid_t> process_behind(const std::filesystem::path& socket);

/// What the installed unit file grants to a daemon that does not run; nothing where none is
/// installed. Drop-ins are not looked at.
std::optional<ProcessRights> rights_of_unit();
/// The same from a unit file's text.
ProcessRights rights_in_unit(const std::string& text);

/// Whether such a process may read and write the device, by owner, group and mode. Nothing where
/// the device cannot be looked at, or who the process is is not known.
std::optional<bool> may_use(const ProcessRights& rights, const std::filesystem::path& device);

/// "dialout"; a number where it has no name.
std::string group_of(const std::filesystem::path& device);

}  // namespace cellcal::daemon
