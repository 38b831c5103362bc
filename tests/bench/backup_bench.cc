// Time a session's touch waits for the journal, alone and during a backup of the whole journal.

#include <fmt/format.h>
#include <stdlib.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <thread>

#include "daemon/journal/journal.h"
#include "tests/bench/times.h"
#include "tests/command_line/command_line.h"

namespace cellcal::bench {
namespace {

using Clock = std::chrono::steady_clock;

class Folder {
 public:
  explicit Folder(const std::string& below) {
    std::string name = below + "/cellcal-backup-XXXXXX";
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error(name + ": cannot be made");
    path = name;
  }
  ~Folder() { std::filesystem::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::filesystem::path path;
};

calib::Touch touch() {
  calib::Touch touch;
  touch.joint_rad.assign(6, 0.1);
  touch.target = "S1";
  return touch;
}

/// About the bytes of a session with its calibration, the preceding one, and a hundred touches.
void fill(daemon::Journal& journal) {
  constexpr std::size_t kCalibration = 400'000;
  const std::int64_t id = journal.begin({"/c", "cell", "/r", "robot", "{}"}, "t");
  journal.store_calibration(id, std::string(kCalibration, 'c'),
                            daemon::Compared{"session", false, std::string(kCalibration, 'd')});
  journal.record(id, daemon::RecordEnd{daemon::Ending::kDone, ""}, "t");
}

void record(daemon::Journal& journal, std::int64_t id, std::size_t& index, Times& times) {
  const auto begun = Clock::now();
  journal.record(id, daemon::RecordTouch{index++, touch()});
  times.add(Clock::now() - begun);
  // Far more often than in a session.
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

void run(const std::string& below, int sessions, int alone) {
  const Folder folder(below);
  daemon::Journal journal(folder.path / "journal.db");
  for (int i = 0; i < sessions; ++i) fill(journal);
  const std::int64_t id = journal.begin({"/c", "cell", "/r", "robot", "{}"}, "t");
  std::size_t index = 0;
  Times idle, busy;
  for (int i = 0; i < alone; ++i) record(journal, id, index, idle);
  std::atomic<bool> copied{false};
  const auto begun = Clock::now();
  double seconds = 0.0;
  std::thread copier([&] {
    journal.backup(folder.path / "copy.db");
    seconds = std::chrono::duration<double>(Clock::now() - begun).count();
    copied = true;
  });
  while (!copied) record(journal, id, index, busy);
  copier.join();
  fmt::print("journal of {:.0f} MB, copied, read back and named in {:.1f} s\n",
             static_cast<double>(std::filesystem::file_size(folder.path / "copy.db")) * 1e-6,
             seconds);
  fmt::print("a touch on disk, us     {}\nalone                   {}\nwhile it is copied      {}\n",
             Times::columns(), idle.row(), busy.row());
}

}  // namespace
}  // namespace cellcal::bench

int main(int argc, char** argv) {
  cellcal::CommandLine app(
      "What a session's touch waits for the journal, alone and while all of it is copied");
  std::string below = ".";
  int sessions = 250, alone = 500;
  app.option("--below", below, "Directory on the disk to measure");
  app.option("--sessions", sessions, "In the journal, 0.8 MB each");
  app.option("--alone", alone, "Touches without a copy beside");
  if (const auto code = app.parse(argc, argv)) return *code;
  try {
    cellcal::bench::run(below, sessions, alone);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "backup_bench: %s\n", error.what());
    return 1;
  }
}
