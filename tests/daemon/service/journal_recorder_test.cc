// The end of a session in journal and log.

#include "daemon/service/journal_recorder.h"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <sstream>

#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

TEST(AJournalRecorder, LogsTheFailureOfASessionWhoseEndTheJournalDoesNotTake) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  FakeBackend backend;
  constexpr std::int64_t kOfAnotherJournal = 7;
  JournalRecorder recorder(journal, kOfAnotherJournal, backend);
  std::ostringstream log;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
  EXPECT_THROW(recorder.record(RecordEnd{Ending::kFailed, "the disk is full"}), JournalError);
  spdlog::set_default_logger(before);
  EXPECT_NE(log.str().find("session 7 failed: the disk is full"), std::string::npos) << log.str();
}

}  // namespace
}  // namespace cellcal::daemon::testing
