#include "daemon/doctor/machine.h"

#include <arpa/inet.h>
#include <dirent.h>
#include <fmt/format.h>
#include <grp.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <pwd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <iterator>
#include <sstream>

#include "drivers/io_thread.h"

namespace cellcal::daemon {

namespace {

// Bits of the capability masks (linux/capability.h).
constexpr unsigned kCapIpcLock = 14, kCapSysNice = 23;
constexpr std::array kUnits{"/etc/systemd/system/cellcald.service",
                            "/usr/lib/systemd/system/cellcald.service",
                            "/lib/systemd/system/cellcald.service"};

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string command_of(const std::filesystem::path& process) {
  std::string name = content(process / "comm");
  if (!name.empty() && name.back() == '\n') name.pop_back();
  return name;
}

/// Result of `take` for an entry of the user or group database; `look_up` as getpwuid_r(3). None: no entry.
template <class Entry, class Key, class Take>
auto entry_of(int (*look_up)(Key, Entry*, char*, std::size_t, Entry**), Key key, Take take) {
  std::array<char, 4096> buffer{};
  Entry entry{};
  Entry* found = nullptr;
  const int failed = look_up(key, &entry, buffer.data(), buffer.size(), &found);
  return failed == 0 && found != nullptr ? std::optional(take(*found)) : std::nullopt;
}

std::string user_name(uid_t uid) {
  return entry_of(::getpwuid_r, uid, [](const passwd& one) { return std::string(one.pw_name); })
      .value_or(fmt::to_string(uid));
}

/// A socket as /proc/net lists it.
struct Listed {
  std::string inode;
  uid_t uid = 0;
};

std::optional<Listed> listed_udp(std::uint16_t port) {
  for (const char* table : {"/proc/net/udp", "/proc/net/udp6"}) {
    std::istringstream lines(content(table));
    std::string line;
    std::getline(lines, line);  // header
    while (std::getline(lines, line)) {
      // sl local rem st tx:rx tr:when retrnsmt uid timeout inode
      std::istringstream words(line);
      std::string slot, local, skipped, uid, inode;
      words >> slot >> local >> skipped >> skipped >> skipped >> skipped >> skipped >> uid >>
          skipped >> inode;
      const std::size_t colon = local.rfind(':');
      if (colon == std::string::npos) continue;
      unsigned at = 0;
      std::from_chars(local.data() + colon + 1, local.data() + local.size(), at, 16);
      if (at != port) continue;
      Listed found{inode, 0};
      std::from_chars(uid.data(), uid.data() + uid.size(), found.uid);
      return found;
    }
  }
  return std::nullopt;
}

bool is_process(const std::string& name) {
  return !name.empty() &&
         std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; });
}

bool holds(const std::filesystem::path& process, const std::string& socket) {
  std::error_code error;
  for (const auto& one : std::filesystem::directory_iterator(process / "fd", error)) {
    std::error_code gone;
    if (std::filesystem::read_symlink(one.path(), gone).string() == socket && !gone) return true;
  }
  return false;
}

/// Text after `key`, up to the end of the line.
std::string value_of(const std::string& text, const std::string& key) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind(key, 0) == 0) return line.substr(key.size());
  }
  return {};
}

/// Groups of a user by the group database, including `first`.
std::vector<gid_t> groups_of(const std::string& user, gid_t first) {
  std::vector<gid_t> groups(16);
  int count = static_cast<int>(groups.size());
  if (::getgrouplist(user.c_str(), first, groups.data(), &count) < 0) {
    groups.resize(static_cast<std::size_t>(count));
    ::getgrouplist(user.c_str(), first, groups.data(), &count);
  }
  groups.resize(static_cast<std::size_t>(std::max(0, count)));
  return groups;
}

}  // namespace

std::vector<std::string> own_addresses() {
  std::vector<std::string> found;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return found;
  for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto* address = reinterpret_cast<const sockaddr_in*>(one->ifa_addr);
    if (::inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size()) != nullptr) {
      found.emplace_back(text.data());
    }
  }
  ::freeifaddrs(list);
  return found;
}

bool is_own_address(const std::string& address) {
  sockaddr_in place{};
  place.sin_family = AF_INET;
  if (::inet_pton(AF_INET, address.c_str(), &place.sin_addr) != 1) return false;
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return false;
  const bool own = ::bind(socket, reinterpret_cast<const sockaddr*>(&place), sizeof place) == 0;
  ::close(socket);
  return own;
}

std::optional<calib::Phrase> holder_of_udp_port(std::uint16_t port) {
  const std::optional<Listed> listed = listed_udp(port);
  if (!listed) return std::nullopt;
  const std::string socket = "socket:[" + listed->inode + "]";
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", error)) {
    const std::string name = entry.path().filename().string();
    if (!is_process(name) || !holds(entry.path(), socket)) continue;
    return calib::Phrase("say.doctor.machine.process",
                         {{"name", command_of(entry.path())}, {"process", name}});
  }
  return calib::Phrase("say.doctor.machine.holder", {{"user", user_name(listed->uid)}});
}

std::optional<ProcessRights> rights_of_process(pid_t process) {
  const std::filesystem::path folder = fmt::format("/proc/{}", process);
  const std::string status = content(folder / "status"), limits = content(folder / "limits");
  if (status.empty()) return std::nullopt;
  ProcessRights rights;
  rights.who = {"say.doctor.machine.process", {{"name", command_of(folder)}, {"process", process}}};
  std::istringstream uids(value_of(status, "Uid:"));
  uid_t real = 0, effective = 0;
  if (uids >> real >> effective) rights.uid = effective;
  std::istringstream gids(value_of(status, "Gid:") + " " + value_of(status, "Groups:"));
  for (gid_t group = 0; gids >> group;) rights.groups.push_back(group);
  std::uint64_t capabilities = 0;
  std::istringstream(value_of(status, "CapEff:")) >> std::hex >> capabilities;
  const auto can = [&](unsigned bit) { return (capabilities >> bit & 1U) != 0; };
  int priority = 0;
  std::istringstream(value_of(limits, "Max realtime priority")) >> priority;
  rights.realtime = can(kCapSysNice) || priority >= drivers::kPortPriority;
  std::string locked;
  std::istringstream(value_of(limits, "Max locked memory")) >> locked;
  rights.locked_memory = can(kCapIpcLock) || locked == "unlimited";
  return rights;
}

std::optional<pid_t> process_behind(const std::filesystem::path& socket) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = socket.string();
  if (path.size() >= sizeof address.sun_path) return std::nullopt;
  path.copy(address.sun_path, path.size());
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return std::nullopt;
  std::optional<pid_t> process;
  ucred peer{};
  socklen_t size = sizeof peer;
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      ::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 && peer.pid > 0) {
    process = peer.pid;
  }
  ::close(fd);
  return process;
}

ProcessRights rights_in_unit(const std::string& text) {
  ProcessRights rights;
  rights.who = "say.doctor.machine.unit";
  const std::string priority = value_of(text, "LimitRTPRIO=");
  int granted = 0;
  std::istringstream(priority) >> granted;
  rights.realtime = priority == "infinity" || granted >= drivers::kPortPriority;
  rights.locked_memory = value_of(text, "LimitMEMLOCK=") == "infinity";
  std::istringstream names(value_of(text, "Group=") + " " + value_of(text, "SupplementaryGroups="));
  for (std::string name; names >> name;)
    if (const auto id =
            entry_of(::getgrnam_r, name.c_str(), [](const group& one) { return one.gr_gid; }))
      rights.groups.push_back(*id);
  const std::string user = value_of(text, "User=");
  if (const auto entry =
          entry_of(::getpwnam_r, user.c_str(), [](const passwd& one) { return one; });
      entry && !user.empty()) {
    rights.uid = entry->pw_uid;
    const std::vector<gid_t> own = groups_of(user, entry->pw_gid);  // systemd grants these as well
    rights.groups.insert(rights.groups.end(), own.begin(), own.end());
  }
  return rights;
}

std::optional<ProcessRights> rights_of_unit() {
  for (const char* unit : kUnits) {
    const std::string text = content(unit);
    if (!text.empty()) return rights_in_unit(text);
  }
  return std::nullopt;
}

std::optional<bool> may_use(const ProcessRights& rights, const std::filesystem::path& device) {
  struct stat info {};
  if (!rights.uid || ::stat(device.c_str(), &info) != 0) return std::nullopt;
  if (*rights.uid == 0) return true;
  const auto both = [&](mode_t mask) { return (info.st_mode & mask) == mask; };
  if (*rights.uid == info.st_uid) return both(S_IRUSR | S_IWUSR);
  const bool member =
      std::find(rights.groups.begin(), rights.groups.end(), info.st_gid) != rights.groups.end();
  return member ? both(S_IRGRP | S_IWGRP) : both(S_IROTH | S_IWOTH);
}

std::string group_of(const std::filesystem::path& device) {
  struct stat info {};
  if (::stat(device.c_str(), &info) != 0) return "unknown";
  return entry_of(::getgrgid_r, info.st_gid,
                  [](const group& one) { return std::string(one.gr_name); })
      .value_or(fmt::to_string(info.st_gid));
}

}  // namespace cellcal::daemon
