// The head file and the lock file: content, state after interruptions, and messages if the file system
// refuses.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <functional>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "daemon/journal/chain.h"
#include "daemon/journal/store/sqlite.h"
#include "daemon/journal/store/store_files.h"
#include "images.h"
#include "temporary_directory.h"

namespace {

/// Called for each attempt to lock a file; returns errno, 0: continue.
std::function<int()> before_lock;

}  // namespace

/// The library's call, with a hook for actions of another program between opening and locking.
extern "C" int fcntl(int descriptor, int command, ...) {
  va_list arguments;
  va_start(arguments, command);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  if (command == F_OFD_SETLK && before_lock) {
    if (const int code = before_lock()) {
      errno = code;
      return -1;
    }
  }
  return static_cast<int>(::syscall(SYS_fcntl, descriptor, command, argument));
}

namespace cellcal::daemon::testing {
namespace {

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

bool has(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

mode_t mode_of(const std::filesystem::path& path) {
  struct stat info {};
  EXPECT_EQ(::stat(path.c_str(), &info), 0);
  return info.st_mode & 0777;
}

/// Closes descriptor 0 during its lifetime, as for a service without standard input.
class NoStandardInput {
 public:
  NoStandardInput() : kept_(::dup(0)) { ::close(0); }
  ~NoStandardInput() {
    ::dup2(kept_, 0);
    ::close(kept_);
  }
  NoStandardInput(const NoStandardInput&) = delete;
  NoStandardInput& operator=(const NoStandardInput&) = delete;

 private:
  int kept_;
};

TEST(AChain, GoesOnWhereItsHeadCouldNotBeWritten) {
  const TemporaryDirectory dir;
  Database database(dir / "j.db");
  database.execute(
      "CREATE TABLE chain (number INTEGER PRIMARY KEY, session, kind, row, digest, sum)");
  HeadFile full("/dev/full", dir / "j.db");
  Chain chain(database, full);
  chain.begin();
  EXPECT_THROW(chain.committed(), JournalError);
  chain.rolled_back();  // of the next transaction, such as on a full disk
  EXPECT_NO_THROW(chain.begin());
  EXPECT_THROW(chain.committed(), JournalError) << "still due";
  EXPECT_EQ(database.integer("SELECT max(number) FROM chain"), 2);
}

struct AHeadFileByItself : ::testing::Test {
  Head head(std::int64_t entries) const {
    return {entries, calib::sha256(std::to_string(entries))};
  }
  std::optional<Head> read() const { return HeadFile(path, journal).read(); }

  TemporaryDirectory dir;
  std::filesystem::path path = dir / "j.db.head", journal = dir / "j.db";
};

TEST_F(AHeadFileByItself, HasNothingToSayBeforeItWasWritten) { EXPECT_FALSE(read()); }

TEST_F(AHeadFileByItself, HoldsTwoLinesInTurnInTheFormThatAllVersionsRead) {
  HeadFile file(path, journal);
  file.write(head(7));
  const std::string words = "cellcal.journal-head/1 0000000000000000007 " + head(7).sum + " ";
  EXPECT_EQ(text_of(path), words + calib::sha256(words).substr(0, 16) + "\n");
  file.write(head(8));
  const std::string both = text_of(path);
  file.write(head(9));
  const std::size_t line = both.size() / 2;
  EXPECT_EQ(text_of(path).substr(line), both.substr(line))
      << "8 stays while 9 takes the place of 7";
  EXPECT_TRUE(has(text_of(path).substr(0, line), "0000009"));
  EXPECT_EQ(read()->entries, 9);
  EXPECT_EQ(read()->sum, head(9).sum);
}

TEST_F(AHeadFileByItself, ThatIsOpenedAgainGoesOnInThePlaceOfTheOlderLine) {
  for (std::int64_t newest : {2, 3}) {
    std::filesystem::remove(path);
    {
      HeadFile file(path, journal);
      for (std::int64_t entries = 1; entries <= newest; ++entries) file.write(head(entries));
    }
    HeadFile file(path, journal);
    ASSERT_EQ(file.read()->entries, newest);
    file.write(head(newest + 1));
    const std::string text = text_of(path);
    EXPECT_TRUE(has(text, "000" + std::to_string(newest) + " "))
        << "a power failure meets the other";
    EXPECT_TRUE(has(text, "000" + std::to_string(newest + 1) + " "));
    EXPECT_EQ(read()->entries, newest + 1);
  }
}

TEST_F(AHeadFileByItself, ThatCannotBeOpenedIsNamedWithTheReason) {
  std::filesystem::create_directory(path);
  const std::string words = error_of([&] { read(); });
  EXPECT_TRUE(has(words, "j.db: j.db.head cannot be opened (Is a directory)")) << words;
}

TEST_F(AHeadFileByItself, ThatTheDiskDoesNotTakeWholeIsAnError) {
  ::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  for (const rlim_t bytes : {rlim_t{0}, rlim_t{10}}) {
    HeadFile file(path, journal);
    rlimit limited = before;
    limited.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limited);
    const std::string words = error_of([&] { file.write(head(1)); });
    ::setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_TRUE(has(words, "j.db.head cannot be written (")) << bytes << ": " << words;
    EXPECT_TRUE(has(words, "). Make room")) << words;
    if (bytes == 0) {
      EXPECT_TRUE(has(words, "(File too large)")) << words;
    }
  }
}

TEST_F(AHeadFileByItself, IsWrittenOnceWhateverFailedBefore) {
  HeadFile file(path, journal);
  errno = EINTR;
  file.write(head(1));
  EXPECT_EQ(read()->entries, 1);
}

TEST_F(AHeadFileByItself, AndTheLockAreThereForAServiceWithoutStandardInput) {
  const NoStandardInput closed;
  {
    HeadFile file(path, journal);
    file.write(head(3));
    EXPECT_EQ(file.read()->entries, 3);
  }
  EXPECT_NO_THROW(LockFile(dir / "j.db.lock", journal));
}

TEST_F(AHeadFileByItself, AndTheLockAreNobodysToWriteButTheDaemons) {
  const mode_t before = ::umask(0);
  { const HeadFile file(path, journal); }
  { const LockFile lock(dir / "j.db.lock", journal); }
  ::umask(before);
  EXPECT_EQ(mode_of(path), 0640u);
  EXPECT_EQ(mode_of(dir / "j.db.lock"), 0640u);
}

// ---- the lock ---------------------------------------------------------------------------------------

struct ALockFile : ::testing::Test {
  ~ALockFile() override { before_lock = nullptr; }
  std::string taken() const {
    return error_of([&] { const LockFile lock(path, journal); });
  }
  TemporaryDirectory dir;
  std::filesystem::path path = dir / "j.db.lock", journal = dir / "j.db";
};

TEST_F(ALockFile, IsOneHoldersAloneUntilHeLetsGo) {
  {
    const LockFile lock(path, journal);
    EXPECT_TRUE(has(taken(), "locked by another program")) << taken();
  }
  EXPECT_EQ(taken(), "");
}

TEST_F(ALockFile, ThatWasReplacedBeforeItWasLockedIsOpenedAnew) {
  int attempts = 0;
  before_lock = [&] {
    if (++attempts == 1) {
      std::ofstream(dir / "other") << "x";
      std::filesystem::rename(dir / "other", path);
    }
    return 0;
  };
  const LockFile lock(path, journal);
  EXPECT_EQ(attempts, 2) << "a lock on a file that nobody else finds keeps nobody out";
  before_lock = nullptr;
  EXPECT_TRUE(has(taken(), "locked by another program")) << taken();
}

TEST_F(ALockFile, ThatWasRemovedBeforeItWasLockedIsMadeAnew) {
  int attempts = 0;
  before_lock = [&] {
    if (++attempts == 1) std::filesystem::remove(path);
    return 0;
  };
  const LockFile lock(path, journal);
  EXPECT_EQ(attempts, 2);
  EXPECT_TRUE(std::filesystem::exists(path));
}

TEST_F(ALockFile, ThatCannotBeLockedSaysWhyAndWhereItCould) {
  before_lock = [] { return ENOLCK; };
  const std::string words = taken();
  EXPECT_EQ(words,
            "journal " + journal.string() + ": " + path.string() +
                " cannot be locked (No locks available). Put the state directory on a local disk");
  for (const int code : {EAGAIN, EACCES}) {
    before_lock = [code] { return code; };
    EXPECT_TRUE(has(taken(), "second cellcald")) << taken();
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
