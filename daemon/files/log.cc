#include "daemon/files/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <sys/uio.h>

#include <cstdlib>

#include "calib/model/enum_table.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

/// sd-daemon(3): the prefix "<3>" of a line is its priority.
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

/// The message on one line, whatever foreign text it contains.
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

// Every line would otherwise name this file as its source, with the builder's path.
#define SD_JOURNAL_SUPPRESS_LOCATION
#include <systemd/sd-journal.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <mutex>

namespace cellcal::daemon {

namespace {

/// Priorities of syslog(3).
int priority_of(spdlog::level::level_enum level) {
  constexpr int kDebug = 7, kInfo = 6, kWarning = 4, kError = 3, kCritical = 2;
  if (level >= spdlog::level::critical) return kCritical;
  if (level >= spdlog::level::err) return kError;
  if (level >= spdlog::level::warn) return kWarning;
  return level >= spdlog::level::info ? kInfo : kDebug;
}

/// Stable identifiers, listed in systemd/README.md.
const char* message_id(LogEvent event) {
  using enum LogEvent;
  static constexpr EnumNames<LogEvent> kTable{
      {{kNone, ""},
       {kSessionBegins, "818c65f5bc044f8da37d1bba4f991551"},
       {kTouch, "c055b6ccc5774e2b952722b7bbe56434"},
       {kSessionDone, "72725e40c5c14cebbfc67f01eee722e8"},
       {kSessionAborted, "50952111fce348b0872fd8566c65bb75"},
       {kSessionFailed, "91fe2c2267324c12adce1db58e03c67b"},
       {kHangs, "c4e8df7f94b94480b7613bed51cb64b3"}}};
  return kTable[event];
}

class JournalSink final : public spdlog::sinks::base_sink<std::mutex> {
 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::vector<std::string> fields = journal_fields(
        message.level, {message.payload.data(), message.payload.size()}, log_context());
    std::vector<iovec> parts;
    for (const std::string& field : fields)
      parts.push_back({const_cast<char*>(field.data()), field.size()});
    if (sd_journal_sendv(parts.data(), static_cast<int>(parts.size())) >= 0) return;
    const std::string line = printable({message.payload.data(), message.payload.size()});
    std::fprintf(stderr, "<%d>%s\n", priority_of(message.level), line.c_str());
  }
  void flush_() override {}
};

}  // namespace

std::vector<std::string> journal_fields(spdlog::level::level_enum level, std::string_view message,
                                        const LogContext& context) {
  std::vector<std::string> fields{"PRIORITY=" + std::to_string(priority_of(level)),
                                  "MESSAGE=" + printable(message), "SYSLOG_IDENTIFIER=cellcald"};
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) fields.push_back(name + ("=" + printable(value)));
  };
  if (context.session > 0) add("CELLCAL_SESSION", std::to_string(context.session));
  if (context.touch) add("CELLCAL_TOUCH", std::to_string(*context.touch));
  add("CELLCAL_PHASE", context.phase);
  add("CELLCAL_FAILURE", context.failure);
  add("MESSAGE_ID", message_id(context.event));
  return fields;
}

bool stderr_is_journal() {
  const char* stream = std::getenv("JOURNAL_STREAM");
  unsigned long long device = 0, inode = 0;
  struct stat here {};
  if (stream == nullptr || std::sscanf(stream, "%llu:%llu", &device, &inode) != 2) return false;
  return ::fstat(STDERR_FILENO, &here) == 0 && here.st_dev == device && here.st_ino == inode;
}

std::shared_ptr<spdlog::sinks::sink> make_journal_sink() { return std::make_shared<JournalSink>(); }

}  // namespace cellcal::daemon
