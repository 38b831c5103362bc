#pragma once
// Properties of this computer that a cell depends on: addresses, ports, rights. Linux.

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/words/phrase.h"

namespace cellcal::daemon {

/// IPv4 addresses of this computer's interfaces, e.g. "192.168.1.10". Empty where the kernel cannot be
/// queried, as in the service's sandbox.
std::vector<std::string> own_addresses();
/// True for an IPv4 address of this computer; works in the sandbox, too.
bool is_own_address(const std::string& address);

/// Owner of a UDP socket on this port: "TestServer (process 812)", or only the user where the process is not
/// accessible ("a program of user kuka"). None: port unused.
std::optional<calib::Phrase> holder_of_udp_port(std::uint16_t port);

/// Rights of a process.
struct ProcessRights {
  calib::Phrase who;  ///< "cellcald (process 77)", or "the service's unit"
  std::optional<uid_t> uid;
  std::vector<gid_t> groups;
  bool realtime = false;       ///< SCHED_FIFO at the robot's priority
  bool locked_memory = false;  ///< unlimited
};

/// From /proc. None where the process does not exist.
std::optional<ProcessRights> rights_of_process(pid_t process);

/// Process that listens on this Unix-domain socket; none without one.
std::optional<pid_t> process_behind(const std::filesystem::path& socket);

/// Rights that the installed unit file grants to a stopped daemon; none where it is not installed. Drop-ins
/// are ignored.
std::optional<ProcessRights> rights_of_unit();
/// The same from the text of a unit file.
ProcessRights rights_in_unit(const std::string& text);

/// True if such a process may read and write the device, by owner, group and mode. None where the device or
/// the process's user is unknown.
std::optional<bool> may_use(const ProcessRights& rights, const std::filesystem::path& device);

/// "dialout"; a number for an unnamed group.
std::string group_of(const std::filesystem::path& device);

}  // namespace cellcal::daemon
