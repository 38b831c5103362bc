#include "tests/daemon/cli/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <stdexcept>
#include <string>

namespace cellcal::daemon::testing {

namespace {

std::vector<char*> pointers(const std::vector<std::string>& strings) {
  std::vector<char*> result;
  for (const std::string& one : strings) result.push_back(const_cast<char*>(one.c_str()));
  result.push_back(nullptr);
  return result;
}

int status_of(int raw) { return WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw); }

}  // namespace

Outcome run_program(const std::vector<std::string>& arguments) {
  int out[2], err[2];
  if (::pipe(out) != 0 || ::pipe(err) != 0) throw std::runtime_error("no pipe");
  const std::vector<char*> argv = pointers(arguments);
  const pid_t pid = ::fork();
  if (pid < 0) throw std::runtime_error("no process");
  if (pid == 0) {
    ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
    ::dup2(out[1], STDOUT_FILENO);
    ::dup2(err[1], STDERR_FILENO);
    for (int fd : {out[0], out[1], err[0], err[1]}) ::close(fd);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  ::close(out[1]);
  ::close(err[1]);
  Outcome outcome;
  pollfd both[2] = {{out[0], POLLIN, 0}, {err[0], POLLIN, 0}};
  std::string* texts[2] = {&outcome.out, &outcome.err};
  while (both[0].fd >= 0 || both[1].fd >= 0) {
    ::poll(both, 2, -1);
    for (int i = 0; i < 2; ++i) {
      if (both[i].fd < 0 || both[i].revents == 0) continue;
      char buffer[4096];
      const ssize_t got = ::read(both[i].fd, buffer, sizeof buffer);
      if (got > 0) {
        texts[i]->append(buffer, static_cast<std::size_t>(got));
      } else {
        ::close(both[i].fd);
        both[i].fd = -1;
      }
    }
  }
  int raw = 0;
  ::waitpid(pid, &raw, 0);
  outcome.status = status_of(raw);
  return outcome;
}

Background::Background(const std::vector<std::string>& arguments, const std::string& log_file,
                       const std::vector<std::string>& environment) {
  const std::vector<char*> argv = pointers(arguments);
  pid_ = ::fork();
  if (pid_ < 0) throw std::runtime_error("no process");
  if (pid_ > 0) return;
  const int log = ::open(log_file.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  ::dup2(log, STDOUT_FILENO);
  ::dup2(log, STDERR_FILENO);
  for (const std::string& one : environment) ::putenv(const_cast<char*>(one.c_str()));
  ::execv(argv[0], argv.data());
  ::_exit(127);
}

Background::~Background() {
  if (!running_) return;
  signal(SIGKILL);
  wait();
}

pid_t Background::working() const {
  const std::string own = std::to_string(pid_);
  std::ifstream children("/proc/" + own + "/task/" + own + "/children");
  pid_t child = 0;
  children >> child;
  return child;
}

void Background::signal(int number) const { ::kill(pid_, number); }

int Background::wait() {
  int raw = 0;
  ::waitpid(pid_, &raw, 0);
  running_ = false;
  return status_of(raw);
}

}  // namespace cellcal::daemon::testing
