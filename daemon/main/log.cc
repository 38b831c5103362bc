#include "daemon/main/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <string_view>

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

/// The message on one line of its own, whatever foreign words are in it: line ends as " / ", other
/// control characters as '?', so that no id or path forges a line or steers a terminal.
class OneLine final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& out) override {
    constexpr std::string_view kBetween = " / ";
    for (const char c : message.payload) {
      if (c == '\n') {
        out.append(kBetween.begin(), kBetween.end());
      } else {
        out.push_back(static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c);
      }
    }
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return spdlog::details::make_unique<OneLine>();
  }
};

}  // namespace

void set_up_log(bool verbose) {
  auto logger = spdlog::stderr_logger_mt("cellcald");
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<OneLine>('*');
  if (std::getenv("JOURNAL_STREAM") != nullptr) {
    formatter->add_flag<JournalPriority>('$').set_pattern("%$%*");
  } else {
    formatter->set_pattern("%Y-%m-%d %H:%M:%S.%e %l: %*");
  }
  logger->set_formatter(std::move(formatter));
  logger->set_level(verbose ? spdlog::level::debug : spdlog::level::info);
  spdlog::set_default_logger(std::move(logger));
}

}  // namespace cellcal::daemon
