// PDF of the certificate, by an external program.

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <optional>
#include <stdexcept>
#include <thread>

#include "daemon/certificate/certificate.h"

namespace cellcal::daemon::certificate {

namespace {

constexpr const char* kProgram = "weasyprint";

/// Discards the child's output, such as font warnings on our standard error.
class Silence {
 public:
  Silence() {
    ::posix_spawn_file_actions_init(&actions_);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
      ::posix_spawn_file_actions_addopen(&actions_, stream, "/dev/null", O_RDWR, 0);
  }
  ~Silence() { ::posix_spawn_file_actions_destroy(&actions_); }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;
  const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_;
};

/// Exit status; none: terminated after the limit.
std::optional<int> end_of(pid_t child, std::chrono::milliseconds limit) {
  constexpr std::chrono::milliseconds kPause{20};
  const auto until = std::chrono::steady_clock::now() + limit;
  int status = 0;
  for (;;) {
    const pid_t ended = ::waitpid(child, &status, WNOHANG);
    if (ended == child) return status;
    if (ended < 0 && errno != EINTR) return -1;
    if (std::chrono::steady_clock::now() >= until) break;
    std::this_thread::sleep_for(kPause);
  }
  ::kill(child, SIGKILL);
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return std::nullopt;
}

}  // namespace

void write_pdf(const std::filesystem::path& html, const std::filesystem::path& pdf,
               std::chrono::milliseconds limit) {
  std::filesystem::path part = pdf;
  part += ".part";
  std::string program = kProgram, encoding = "--encoding=utf-8",
              from = std::filesystem::absolute(html).string(),
              to = std::filesystem::absolute(part).string();
  char* arguments[] = {program.data(), encoding.data(), from.data(), to.data(), nullptr};
  const Silence silence;
  pid_t child = 0;
  const int failed = ::posix_spawnp(&child, kProgram, silence.get(), nullptr, arguments, environ);
  if (failed == ENOENT)
    throw std::runtime_error(
        fmt::format("{}: not written: the program weasyprint is missing. Install the package "
                    "'weasyprint', or give --no-pdf",
                    pdf.string()));
  const std::optional<int> status = failed == 0 ? end_of(child, limit) : -1;
  std::error_code code;
  if (status == 0 && std::filesystem::exists(part, code)) {
    std::filesystem::rename(part, pdf);
    return;
  }
  std::filesystem::remove(part, code);
  if (!status)
    throw std::runtime_error(fmt::format(
        "{}: not written: weasyprint was ended after {} s. Run 'weasyprint {} {}' to see why",
        pdf.string(), std::chrono::duration<double>(limit).count(), html.string(), pdf.string()));
  throw std::runtime_error(
      fmt::format("{}: not written: weasyprint failed. Run 'weasyprint {} {}' to see why",
                  pdf.string(), html.string(), pdf.string()));
}

}  // namespace cellcal::daemon::certificate
