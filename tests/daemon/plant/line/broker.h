#pragma once
// Debian's mosquitto on a free port of this computer, with its files in a directory of the test.

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace cellcal::daemon::testing {

class Broker {
 public:
  /// `more`: further lines of its configuration; without them no anonymous access.
  explicit Broker(const std::filesystem::path& dir,
                  const std::string& more = "allow_anonymous true\n");
  ~Broker();
  Broker(const Broker&) = delete;
  Broker& operator=(const Broker&) = delete;

  void start();
  /// Like a power cut: without notification.
  void kill();
  std::uint16_t port() const { return port_; }

 private:
  void end(int signal);
  std::filesystem::path dir_;
  std::uint16_t port_ = 0;
  pid_t process_ = 0;
};

/// Runs it; fails the test unless its exit status is 0.
void run_tool(const std::vector<std::string>& words);

}  // namespace cellcal::daemon::testing
