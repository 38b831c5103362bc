#pragma once
// One program on an arm that arrives on request.

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>

#include "calib/model/error.h"
#include "sim/krl/interpreter.h"

namespace cellcal::sim::krl {

struct Arm : Mover {
  void move(const Motion& motion) override {
    ++moves;
    kind = motion.kind;
    target = motion.target;
    approximate = motion.approximate;
    busy = true;
  }
  bool moving() const override { return busy; }
  void brake(bool fast) override {
    ++brakes;
    fast_brake = fast;
  }
  void drop_motion() override { ++dropped; }
  void go_on() override { ++continued; }

  int moves = 0, brakes = 0, dropped = 0, continued = 0;
  bool busy = false, fast_brake = false, approximate = false;
  Motion::Kind kind{};
  Value target;
};

struct KrlRig {
  using Files = std::map<std::string, std::string>;

  explicit KrlRig(const std::string& body, const std::string& data = "",
                  const std::string& more = "", const Files& others = {}) {
    Files files = others;
    files["m.src"] = "DEF M ( )\n" + body + "\nEND\n" + more;
    files["m.dat"] =
        "DEFDAT M PUBLIC\nDECL GLOBAL INT N=0\nDECL GLOBAL REAL R=0.0\nDECL GLOBAL BOOL B=FALSE\n" +
        data + "\nENDDAT\n";
    program = std::make_unique<Program>(files, "BOOL $IN[8]\nBOOL $OUT[8]\n");
    for (Value& in : (*program)["$IN"].parts) in.set_whole(0);
    interpreter = std::make_unique<Interpreter>(*program, &arm);
    interpreter->select("M");
    interpreter->run(now);
  }
  void run(double seconds = 0.0) { interpreter->run(now += seconds); }
  std::int32_t n() { return (*program)["N"].i; }
  float r() { return (*program)["R"].r; }
  bool b() { return (*program)["B"].truth(); }
  void input(int number, bool on) {
    (*program)["$IN"].parts[static_cast<std::size_t>(number) - 1].set_whole(on);
  }
  bool ended() const { return interpreter->state() == Interpreter::State::kEnded; }

  Arm arm;
  double now = 0.0;
  std::unique_ptr<Program> program;
  std::unique_ptr<Interpreter> interpreter;
};

/// The message of a program that is refused; empty: it is loaded.
inline std::string refusal(const std::map<std::string, std::string>& files) {
  try {
    const Program program(files, "BOOL $IN[8]\n");
    return "";
  } catch (const calib::FileError& error) {
    return error.what();
  }
}

}  // namespace cellcal::sim::krl
