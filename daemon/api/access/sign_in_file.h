#pragma once
// Sign-ins that outlive the daemon: a file of its own (mode 0600) in the state directory, of digests alone. Who reads it
// gets neither a cookie nor a token from it.

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace cellcal::daemon {

struct SignIn {
  std::string cookie_sha256, token_sha256;       ///< hexadecimal
  std::chrono::system_clock::time_point last{};  ///< use
};

/// Written by a thread of its own: neither an abort nor a request waits for the disk.
class SignInFile {
 public:
  explicit SignInFile(std::filesystem::path file);
  ~SignInFile();  ///< what was given last is on disk, or its failure in the log
  SignInFile(const SignInFile&) = delete;
  SignInFile& operator=(const SignInFile&) = delete;

  /// Nothing, and a warning in the log, where others may read or write the file or it is not as it was written: everybody
  /// signs in again.
  std::vector<SignIn> read() const;
  void write(std::vector<SignIn> all);

 private:
  void write_newest();

  std::filesystem::path file_;
  std::mutex mutex_;
  std::condition_variable news_;
  std::optional<std::vector<SignIn>> newest_;  ///< not written yet
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace cellcal::daemon
