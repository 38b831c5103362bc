// One daemon at a time, whichever files this process opens and closes.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "images.h"
#include "temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

/// True if another process may open this journal.
bool another_process_gets(const std::filesystem::path& path) {
  const pid_t child = ::fork();
  if (child == 0) {
    try {
      const Journal journal(path);
      ::_exit(0);
    } catch (const JournalError& error) {
      const bool named = std::string(error.what()).find("second cellcald") != std::string::npos;
      ::_exit(named ? 1 : 2);
    }
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_NE(WEXITSTATUS(status), 2) << "refused, but not by name";
  return WEXITSTATUS(status) == 0;
}

TEST(AJournal, StaysLockedWhenItsFilesAreOpenedAndClosedByThisProcess) {
  const TemporaryDirectory dir;
  {
    Journal journal(dir / "j.db");
    EXPECT_FALSE(another_process_gets(dir / "j.db"));
    for (const auto& file : journal.files()) ::close(::open(file.c_str(), O_RDONLY));
    EXPECT_FALSE(another_process_gets(dir / "j.db"));
    journal.record(fill(journal, 1), RecordTouch{1, touch_at(2.0)});
  }
  EXPECT_TRUE(another_process_gets(dir / "j.db"));
}

TEST(AJournal, WhoseLockFileADeadDaemonLeftIsFree) {
  const TemporaryDirectory dir;
  { const Journal journal(dir / "j.db"); }
  EXPECT_TRUE(std::filesystem::exists(dir / "j.db.lock"));
  EXPECT_TRUE(another_process_gets(dir / "j.db"));
}

}  // namespace
}  // namespace cellcal::daemon::testing
