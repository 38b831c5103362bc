// A file is written completely, or unchanged.

#include "daemon/files/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace cellcal::daemon {
namespace {

namespace fs = std::filesystem;

class AtomicFile : public ::testing::Test {
 protected:
  AtomicFile() : folder_(fs::temp_directory_path() / ("atomic-" + std::to_string(::getpid()))) {
    fs::create_directory(folder_);
  }
  ~AtomicFile() override { fs::remove_all(folder_); }

  std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& entry : fs::directory_iterator(folder_))
      all.push_back(entry.path().filename().string());
    return all;
  }
  std::string content(const char* name) const {
    std::ostringstream out;
    out << std::ifstream(folder_ / name).rdbuf();
    return out.str();
  }

  fs::path folder_;
};

/// Like a full disk: no file may grow beyond `bytes`.
class NoRoom {
 public:
  explicit NoRoom(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit now{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &now);
  }
  ~NoRoom() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST_F(AtomicFile, IsNotWrittenThroughALinkThatStandsUnderItsTemporaryName) {
  std::ofstream(folder_ / "of_others") << "untouched";
  fs::create_symlink(folder_ / "of_others", folder_ / "a.part");
  write_atomically(folder_ / "a", "text");
  EXPECT_EQ(content("of_others"), "untouched");
  EXPECT_EQ(content("a"), "text");
  EXPECT_FALSE(fs::is_symlink(folder_ / "a"));
}

TEST_F(AtomicFile, LeavesNothingBehindWhereTheDiskIsFull) {
  write_atomically(folder_ / "out.json", "before");
  {
    const NoRoom full(1000);
    EXPECT_THROW(write_atomically(folder_ / "out.json", std::string(5000, 'x')),
                 std::runtime_error);
    EXPECT_THROW(write_atomically(folder_ / "new.json", std::string(5000, 'x')),
                 std::runtime_error);
  }
  EXPECT_EQ(names(), std::vector<std::string>{"out.json"});
  EXPECT_EQ(content("out.json"), "before");
}

TEST_F(AtomicFile, LeavesNothingBehindWhereTheNameIsTaken) {
  fs::create_directories(folder_ / "taken" / "by_a_folder");
  EXPECT_THROW(write_atomically(folder_ / "taken", "text"), std::runtime_error);
  EXPECT_EQ(names(), std::vector<std::string>{"taken"});
}

TEST_F(AtomicFile, NamesTheFileThatWasGivenWhateverFails) {
  const auto words = [&](const char* name) {
    try {
      write_atomically(folder_ / name, std::string(5000, 'x'));
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  fs::create_directories(folder_ / "taken" / "by_a_folder");
  EXPECT_EQ(words("taken"), (folder_ / "taken").string() + ": cannot be replaced: Is a directory");
  EXPECT_EQ(words("no/a"),
            (folder_ / "no/a").string() + ": cannot be opened: No such file or directory");
  const NoRoom full(1000);
  EXPECT_EQ(words("a"), (folder_ / "a").string() + ": cannot be written: File too large");
}

TEST_F(AtomicFile, IsReplacedWhole) {
  write_atomically(folder_ / "out.json", "before");
  write_atomically(folder_ / "out.json", "after");
  EXPECT_EQ(names(), std::vector<std::string>{"out.json"});
  EXPECT_EQ(content("out.json"), "after");
}

}  // namespace
}  // namespace cellcal::daemon
