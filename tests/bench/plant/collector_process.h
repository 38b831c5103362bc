#pragma once
// cellcal-fleet in the background, between a broker and a database of their own.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include "tests/daemon/cli/process.h"

namespace cellcal::bench {

/// Removed with its owner.
struct Folder {
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::filesystem::path write(const std::string& name, const std::string& text) const;

  std::filesystem::path path;
};

/// `number` makes its client id and its socket: another with the same one goes on where it was.
class CollectorProcess {
 public:
  /// It is connected and subscribed, unless it is not waited for. Throws std::runtime_error.
  CollectorProcess(const std::string& program, const Folder& folder, std::uint16_t broker,
                   const std::string& database, int number, bool wait = true,
                   const std::string& broker_host = "127.0.0.1");

  void kill() { process_.signal(9); }
  /// Most that it ever held.
  double megabytes() const;
  /// Of the processor, of all its threads.
  double cpu_s() const;

 private:
  bool is_up() const;

  std::filesystem::path socket_;
  daemon::testing::Background process_;
};

/// Throws std::runtime_error with how many came within two minutes.
void wait_for_touches(const std::string& database, std::int64_t session, std::size_t count);

}  // namespace cellcal::bench
