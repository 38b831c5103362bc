#pragma once
// The operator of an emulated controller: one command per line, from a FIFO or standard input.

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace cellcal::sim {

class KrcUdp;
class EkiServer;

/// What a command comes to, as a line for people. Unknown ones get the list of those known.
std::string obey(KrcUdp& krc, std::string_view line);
std::string obey(EkiServer& krc, std::string_view line);
/// The commands, for --help.
const char* control_help();

/// Reads lines in a thread of its own and prints what came of each.
class Control {
 public:
  /// `path`: a FIFO, made if it is not there, or "-". Throws std::runtime_error.
  Control(const std::string& path, std::function<std::string(std::string_view line)> obey);
  ~Control();
  Control(const Control&) = delete;
  Control& operator=(const Control&) = delete;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::sim
