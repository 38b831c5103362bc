#include "tests/daemon/fleet/faults/wires.h"

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <initializer_list>
#include <stdexcept>
#include <thread>
#include <vector>

#include "tests/daemon/cli/process.h"

namespace cellcal::daemon::fleet::testing {

namespace {

using Side = Wires::Side;

/// Locally administered; not used by any interface.
constexpr const char* kUnusedMac = "02:00:00:00:00:99";
constexpr const char* kSideEnd = "plant0";

std::size_t index(Side side) { return side == Side::kCells ? 0 : 1; }
const char* plant_end(Side side) { return side == Side::kCells ? "cells0" : "collect0"; }
std::string address(Side side, int host) {
  return (side == Side::kCells ? "10.77.1." : "10.77.2.") + std::to_string(host);
}

int this_network() { return ::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC); }

int another_network() {
  int made = -1;
  std::thread([&] {
    if (::unshare(CLONE_NEWNET) == 0) made = this_network();
  }).join();
  return made;
}

void ip(std::initializer_list<std::string> words) {
  std::vector<std::string> command{"/usr/bin/env", "ip"};
  command.insert(command.end(), words);
  const daemon::testing::Outcome outcome = daemon::testing::run_program(command);
  if (outcome.status == 0) return;
  std::string line;
  for (const std::string& word : words) line += " " + word;
  throw std::runtime_error("ip" + line + ": " + outcome.err);
}

}  // namespace

std::string Wires::plant(Side side) { return address(side, 1); }

std::unique_ptr<Wires> Wires::lay(std::string& why_not) {
  if (daemon::testing::run_program({"/usr/bin/env", "ip", "-V"}).status != 0) {
    why_not = "the program ip is missing (apt install iproute2)";
    return nullptr;
  }
  if (::unshare(CLONE_NEWNET) != 0) {
    why_not = std::string("no network namespace: ") + std::strerror(errno) + " (root may)";
    return nullptr;
  }
  std::unique_ptr<Wires> wires(new Wires);
  wires->plant_ = this_network();
  ip({"link", "set", "lo", "up"});
  for (const Side side : {Side::kCells, Side::kCollectors}) {
    const int there = another_network();
    wires->sides_[index(side)] = there;
    ip({"link", "add", plant_end(side), "type", "veth", "peer", "name", kSideEnd});
    ip({"link", "set", kSideEnd, "netns",
        "/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(there)});
    ip({"address", "add", address(side, 1) + "/24", "dev", plant_end(side)});
    ip({"link", "set", plant_end(side), "up"});
    wires->within(side, [&] {
      ip({"link", "set", "lo", "up"});
      ip({"address", "add", address(side, 2) + "/24", "dev", kSideEnd});
      ip({"link", "set", kSideEnd, "up"});
    });
  }
  return wires;
}

Wires::~Wires() {
  for (const int one : sides_) ::close(one);
  ::close(plant_);
}

void Wires::within(Side side, const std::function<void()>& start) const {
  struct Back {
    explicit Back(int there) : to(there) {}
    ~Back() { ::setns(to, CLONE_NEWNET); }
    int to;
  };
  const Back back(plant_);
  if (::setns(sides_[index(side)], CLONE_NEWNET) != 0)
    throw std::runtime_error(std::string("setns: ") + std::strerror(errno));
  start();
}

void Wires::cut(Side side, Cut how) const {
  if (how == Cut::kClean) {
    within(side, [] { ip({"link", "set", kSideEnd, "down"}); });
    return;
  }
  ip({"neigh", "replace", address(side, 2), "lladdr", kUnusedMac, "dev", plant_end(side), "nud",
      "permanent"});
  within(side, [&] {
    ip({"neigh", "replace", address(side, 1), "lladdr", kUnusedMac, "dev", kSideEnd, "nud",
        "permanent"});
  });
}

void Wires::mend(Side side) const {
  ip({"neigh", "flush", "dev", plant_end(side), "nud", "permanent"});
  within(side, [] {
    ip({"link", "set", kSideEnd, "up"});
    ip({"neigh", "flush", "dev", kSideEnd, "nud", "permanent"});
  });
}

}  // namespace cellcal::daemon::fleet::testing
