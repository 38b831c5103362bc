#pragma once
// Operator interface of an emulated controller: one command per line, from a FIFO or standard
// input.

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace cellcal::sim {

class KrcUdp;
class EkiServer;

/// Executes a command and returns its result as a line of text. For unknown ones the list of
/// commands.
std::string obey(KrcUdp& krc, std::string_view line);
std::string obey(EkiServer& krc, std::string_view line);
/// The commands, for --help.
const char* control_help();

/// Reads lines in a separate thread and prints the results.
class Control {
 public:
  /// `path`: a FIFO, created if absent, or "-". Throws std::runtime_error.
  Control(const std::string& path, std::function<std::string(std::string_view line)> obey);
  ~Control();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::sim
