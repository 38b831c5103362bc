// A journal with many short completed sessions, as after years of nightly checks.

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <string>

#include "daemon/journal/journal.h"
#include "tests/command_line/command_line.h"

int main(int argc, char** argv) {
  using namespace cellcal;
  std::string file;
  int sessions = 20'000, touches = 8;
  CommandLine app(
      "A journal of many short sessions.\nExample: fill_journal --file /tmp/j/journal.db");
  app.option("--file", file, "Where; its folder has to be there");
  app.option("--sessions", sessions, "");
  app.option("--touches", touches, "Per session");
  if (const auto code = app.parse(argc, argv)) return *code;
  try {
    daemon::Journal journal(file);
    calib::Touch touch;
    touch.joint_rad.assign(6, 0.1);
    touch.target = "S1";
    for (int i = 0; i < sessions; ++i) {
      const std::string utc = fmt::format("20{:02}-01-01T00:00:00.000Z", i % 100);
      const std::int64_t id = journal.begin({"/c", "cell", "/r", "robot", "{}"}, utc);
      for (int k = 0; k < touches; ++k)
        journal.record(id, daemon::RecordTouch{static_cast<std::size_t>(k), touch});
      journal.record(id, daemon::RecordEnd{daemon::Ending::kDone, ""}, utc);
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fill_journal: %s\n", error.what());
    return 1;
  }
}
