#pragma once
// Programs as subprocesses: arguments, output and exit status.

#include <sys/types.h>

#include <string>
#include <vector>

namespace cellcal::daemon::testing {

struct Outcome {
  int status = -1;  ///< exit status, or 128 + signal
  std::string out, err;
};

/// Runs to the end. Standard input is empty, standard output and error are pipes.
Outcome run_program(const std::vector<std::string>& arguments);

/// A program in the background; killed with its owner if it still runs.
class Background {
 public:
  Background(const std::vector<std::string>& arguments, const std::string& log_file,
             const std::vector<std::string>& environment = {});
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  pid_t pid() const { return pid_; }
  /// The current child of a program that runs its work in a restarted child process; 0: none.
  pid_t working() const;
  void signal(int number) const;
  /// Exit status, or 128 + signal.
  int wait();

 private:
  pid_t pid_;
  bool running_ = true;
};

}  // namespace cellcal::daemon::testing
