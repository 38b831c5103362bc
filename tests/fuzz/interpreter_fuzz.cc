// Any text as a KRL module: loading results in a program or in an error with file and line, and execution
// ends or waits.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "calib/model/error.h"
#include "sim/krl/interpreter.h"

namespace {

using namespace cellcal::sim::krl;

struct Arm : Mover {
  void move(const Motion&) override { busy = true; }
  bool moving() const override { return busy; }
  void brake(bool) override { busy = false; }
  void drop_motion() override { busy = false; }
  void go_on() override {}
  bool busy = false;
};

void execute(Program& program) {
  Arm arm;
  Interpreter robot(program, &arm);
  robot.select("FUZZ");
  constexpr int kCycles = 20, kInstructions = 500;
  for (int cycle = 0; cycle < kCycles; ++cycle) {
    program["$IN"].parts[0].set_whole(cycle % 2);
    robot.poll_interrupts();
    robot.run(0.004 * cycle, kInstructions);
    if (cycle % 3 == 0) arm.busy = false;
    robot.go_on();
  }
}

void load(const std::string& name, const std::string& text) {
  try {
    Program program(std::map<std::string, std::string>{{name, text}},
                    "BOOL $IN[8]\nBOOL $OUT[8]\n");
    if (name.ends_with(".src")) execute(program);
  } catch (const cellcal::calib::FileError& error) {
    if (std::string_view(error.what()).starts_with("fuzz.")) return;
    std::fprintf(stderr, "interpreter_fuzz: an error without its file: %s\n", error.what());
    std::abort();
  } catch (const std::out_of_range&) {
    // The text has no module FUZZ.
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  load("fuzz.src", text);
  load("fuzz.dat", text);
  return 0;
}
