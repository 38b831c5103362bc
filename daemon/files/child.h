#pragma once
// Another program, run to its end within a time limit, without a shell.

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

namespace cellcal::daemon {

struct Child {
  /// The program, searched for on PATH unless it has a '/', and its arguments.
  std::vector<std::string> words;
  std::string input{};  ///< on its standard input
  std::chrono::milliseconds limit = std::chrono::seconds(30);
  std::size_t most_output = 0;             ///< bytes kept of each stream; more end it. 0: discarded
  std::vector<std::string> environment{};  ///< "PATH=/usr/bin"; empty: this process's own
};

struct ChildEnd {
  enum class Why {
    kEnded,       ///< see `status`
    kNotStarted,  ///< see `error`
    kTooLong,     ///< terminated after the limit
    kTooMuch      ///< terminated for its output
  };
  Why why = Why::kEnded;
  int status = -1;  ///< exit status; -1: a signal
  int error = 0;    ///< errno, ENOENT: no such program
  std::string out{}, err{};
};

/// It inherits no descriptor and no blocked signal. Blocks the calling thread; at the end nothing of the child
/// is left.
ChildEnd run_child(const Child& child);

}  // namespace cellcal::daemon
