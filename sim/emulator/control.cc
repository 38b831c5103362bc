#include "sim/emulator/control.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include "calib/model/enum_table.h"
#include "drivers/units.h"
#include "sim/krc/eki_server.h"
#include "sim/krc/krc_udp.h"

namespace cellcal::sim {
namespace {

constexpr std::size_t kLongestLine = 200;

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::size_t at = 0; at < line.size();) {
    const std::size_t from = line.find_first_not_of(" \t\r\n", at);
    if (from == std::string_view::npos) break;
    const std::size_t to = std::min(line.find_first_of(" \t\r\n", from), line.size());
    words.push_back(line.substr(from, to - from));
    at = to;
  }
  return words;
}

std::string unknown(std::string_view line) {
  return fmt::format("\"{}\" is not a command. {}", line, control_help());
}

template <typename Server, typename Machine>
bool set_override(Server& krc, std::string_view text) {
  int percent = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), percent);
  if (error != std::errc() || end != text.data() + text.size() || percent < 0 || percent > 100)
    return false;
  krc.with([&](Machine& machine) { machine.set_override(percent); });
  return true;
}

OperatingMode mode_of(std::string_view verb) {
  return verb == "t1"    ? OperatingMode::kT1
         : verb == "t2"  ? OperatingMode::kT2
         : verb == "ext" ? OperatingMode::kExt
                         : OperatingMode::kAut;
}

/// Commands common to both kinds of controller.
template <typename Server, typename Machine>
bool common(Server& krc, const std::vector<std::string_view>& words) {
  const std::string_view verb = words[0];
  const bool on = words.size() == 2 && words[1] == "on";
  const bool switched = on || (words.size() == 2 && words[1] == "off");
  if (verb == "unplug" || verb == "plug") {
    krc.unplug(verb == "unplug");
    return words.size() == 1;
  }
  if (verb == "override") return words.size() == 2 && set_override<Server, Machine>(krc, words[1]);
  bool known = true;
  krc.with([&](Machine& machine) {
    if (words.size() == 1 && (verb == "estop" || verb == "release")) {
      machine.emergency_stop(verb == "estop");
    } else if (words.size() == 1 && verb == "cancel") {
      machine.cancel_program();
    } else if (words.size() == 1 &&
               (verb == "t1" || verb == "t2" || verb == "aut" || verb == "ext")) {
      machine.mode(mode_of(verb));
    } else if (switched && verb == "drives") {
      machine.drives(on);
    } else if (switched && verb == "start") {
      machine.start_key(on);
    } else {
      known = false;
    }
  });
  return known;
}

const char* to_words(RsiPhase phase) {
  using enum RsiPhase;
  static constexpr EnumNames<RsiPhase> kTable{{{kBeforeRsiOn, "before RSI_ON"},
                                               {kRunning, "RSI runs"},
                                               {kEnded, "RSI ended"},
                                               {kFaulted, "RSI stopped"}}};
  return kTable[phase];
}

std::string status(const Controller& c) {
  std::string text = fmt::format("{}, IPOC {}, {} late of {} packets", to_words(c.phase()),
                                 c.ipoc(), c.late(), c.packets());
  text += ", setpoint [deg]";
  for (const double rad : c.setpoint_rad())
    text += fmt::format(" {:.4f}", rad * drivers::kDegPerRad);
  if (!c.message().empty()) text += ", pendant: " + c.message();
  return text;
}

}  // namespace

const char* control_help() {
  return "Commands: estop, release, drives on|off, t1, t2, aut, ext, start on|off (the start key, in T1 "
         "and T2), override PERCENT, cancel (the program), reset (acknowledge, select and start it "
         "again), unplug, plug (the cable), status; RSI alone: block on|off (the axes); EKI alone: "
         "reconfigure (the I/Os), call (by CELL.SRC: the program returns with its session), request "
         "none|brake-test|mastering-test|collision.";
}

std::string obey(KrcUdp& krc, std::string_view line) {
  const auto words = words_of(line);
  if (words.empty()) return {};
  bool known = true;
  if (words.size() == 1 && words[0] == "reset") {
    krc.with([](Controller& c) { c.rsi_on(); });
  } else if (words.size() == 2 && words[0] == "block" && (words[1] == "on" || words[1] == "off")) {
    krc.with([&](Controller& c) { c.block_drives(words[1] == "on"); });
  } else if (words.size() != 1 || words[0] != "status") {
    known = common<KrcUdp, Controller>(krc, words);
  }
  if (!known) return unknown(line);
  std::string text;
  krc.with([&](Controller& c) { text = status(c); });
  return text;
}

namespace {

std::optional<drivers::ControllerRequest> request_of(std::string_view word) {
  if (word == "none") return drivers::ControllerRequest::kNone;
  if (word == "brake-test") return drivers::ControllerRequest::kBrakeTest;
  if (word == "mastering-test") return drivers::ControllerRequest::kMasteringTest;
  if (word == "collision") return drivers::ControllerRequest::kCollision;
  return std::nullopt;
}

}  // namespace

std::string obey(EkiServer& krc, std::string_view line) {
  const auto words = words_of(line);
  if (words.empty()) return {};
  bool known = true;
  if (words.size() == 1 && words[0] == "reset") {
    krc.with([](EkiController& c) { c.start_program(); });
  } else if (words.size() == 1 && words[0] == "reconfigure") {
    krc.with([](EkiController& c) { c.reconfigure_io(); });
  } else if (words.size() == 1 && words[0] == "call") {
    krc.with([](EkiController& c) { c.call_program(); });
  } else if (words.size() == 2 && words[0] == "request") {
    const std::optional<drivers::ControllerRequest> request = request_of(words[1]);
    known = request.has_value();
    if (known) krc.with([&](EkiController& c) { c.request(*request); });
  } else if (words.size() != 1 || words[0] != "status") {
    known = common<EkiServer, EkiController>(krc, words);
  }
  if (!known) return unknown(line);
  std::string text;
  krc.with([&](EkiController& c) {
    text = fmt::format("{}, {}, {} moves", c.ready() ? "ready" : "not ready",
                       c.connected() ? "a client is connected" : "no client", c.moves());
  });
  return text;
}

struct Control::Impl {
  Impl(const std::string& path, std::function<std::string(std::string_view)> f)
      : execute_line(std::move(f)), stop(::eventfd(0, EFD_CLOEXEC)) {
    if (path == "-") {
      input = ::dup(STDIN_FILENO);
    } else {
      if (::mkfifo(path.c_str(), 0600) != 0 && errno != EEXIST)
        throw std::runtime_error("--control " + path + ": " + std::strerror(errno));
      // Also open for writing, so that the end of a writer is not the end of the file.
      input = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    }
    if (input < 0 || stop < 0)
      throw std::runtime_error("--control " + path + ": " + std::strerror(errno));
    thread = std::thread([this] { run(); });
  }

  ~Impl() {
    const std::uint64_t one = 1;
    (void)!::write(stop, &one, sizeof one);
    thread.join();
    ::close(input);
    ::close(stop);
  }

  void run() {
    std::string waiting;
    std::array<char, 256> buffer{};
    for (;;) {
      std::array<pollfd, 2> sources{pollfd{input, POLLIN, 0}, pollfd{stop, POLLIN, 0}};
      if (::poll(sources.data(), sources.size(), -1) < 0 && errno != EINTR) return;
      if (sources[1].revents != 0) return;
      if (sources[0].revents == 0) continue;
      const ssize_t got = ::read(input, buffer.data(), buffer.size());
      if (got < 0 && (errno == EAGAIN || errno == EINTR)) continue;
      if (got <= 0) return;  // end of standard input
      waiting.append(buffer.data(), static_cast<std::size_t>(got));
      for (std::size_t end = waiting.find('\n'); end != std::string::npos;
           end = waiting.find('\n')) {
        take(waiting.substr(0, end));
        waiting.erase(0, end + 1);
      }
      if (waiting.size() > kLongestLine) waiting.clear();
    }
  }

  void take(const std::string& line) {
    const std::string text = execute_line(line);
    if (text.empty()) return;
    fmt::print("emulator: {}: {}\n", line, text);
    std::fflush(stdout);
  }

  std::function<std::string(std::string_view)> execute_line;
  int input = -1, stop = -1;
  std::thread thread;
};

Control::Control(const std::string& path, std::function<std::string(std::string_view)> obey)
    : impl_(std::make_unique<Impl>(path, std::move(obey))) {}
Control::~Control() = default;

}  // namespace cellcal::sim
