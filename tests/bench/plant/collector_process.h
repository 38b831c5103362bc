#pragma once
// cellcal-fleet in the background, between its own broker and database.

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

/// `number` selects client id and socket: another one with the same number continues its session.
class CollectorProcess {
 public:
  /// Waits until it is connected and subscribed, unless `wait` is false. Throws std::runtime_error.
  CollectorProcess(const std::string& program, const Folder& folder, std::uint16_t broker,
                   const std::string& database, int number, bool wait = true,
                   const std::string& broker_host = "127.0.0.1");

  void kill() { process_.signal(9); }
  /// Peak memory.
  double megabytes() const;
  /// CPU time of all its threads.
  double cpu_s() const;

 private:
  bool is_up() const;

  std::filesystem::path socket_;
  daemon::testing::Background process_;
};

/// Throws std::runtime_error with the number received if it takes longer than two minutes.
void wait_for_touches(const std::string& database, std::int64_t session, std::size_t count);

}  // namespace cellcal::bench
