#include "daemon/main/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdlib>

#include "daemon/files/printable.h"
#include "daemon/main/journald.h"

namespace cellcal::daemon {

namespace {

/// sd-daemon(3): "<3>" in front of a line is its priority.
class JournalPriority final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& out) override {
    const char* prefix = "<7>";
    if (message.level >= spdlog::level::info) prefix = "<6>";
    if (message.level >= spdlog::level::warn) prefix = "<4>";
    if (message.level >= spdlog::level::err) prefix = "<3>";
    out.append(prefix, prefix + 3);
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return spdlog::details::make_unique<JournalPriority>();
  }
};

/// The message in one line, whatever of others' words is in it.
class OneLine final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& out) override {
    const std::string line = printable({message.payload.data(), message.payload.size()});
    out.append(line.data(), line.data() + line.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return spdlog::details::make_unique<OneLine>();
  }
};

}  // namespace

namespace {

std::shared_ptr<spdlog::logger> make_logger() {
  if (stderr_is_journal()) {
    auto logger = std::make_shared<spdlog::logger>("cellcald", make_journal_sink());
    spdlog::register_logger(logger);
    return logger;
  }
  auto logger = spdlog::stderr_logger_mt("cellcald");
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  if (std::getenv("JOURNAL_STREAM") != nullptr) {
    formatter->add_flag<JournalPriority>('*').add_flag<OneLine>('~').set_pattern("%*%~");
  } else {
    formatter->add_flag<OneLine>('~').set_pattern("%Y-%m-%d %H:%M:%S.%e %l: %~");
  }
  logger->set_formatter(std::move(formatter));
  return logger;
}

}  // namespace

void set_up_log(bool verbose) {
  auto logger = make_logger();
  spdlog::set_default_logger(std::move(logger));
  set_log_level(verbose);
}

void set_log_level(bool verbose) {
  spdlog::default_logger()->set_level(verbose ? spdlog::level::debug : spdlog::level::info);
}

}  // namespace cellcal::daemon
