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
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "calib/model/enum_table.h"
#include "drivers/units.h"
#include "sim/krc/eki_server.h"
#include "sim/krc/krc_udp.h"

namespace cellcal::sim {
namespace {

constexpr std::size_t kLongestLine = 200;

/// Action of each command; "override" has a number after it.
template <typename Machine>
using Commands = std::map<std::string, void (*)(Machine&), std::less<>>;

/// Common to both kinds of controller.
template <typename Machine>
Commands<Machine> with_common(Commands<Machine> own) {
  own.merge(Commands<Machine>{{"estop", [](Machine& m) { m.emergency_stop(true); }},
                              {"release", [](Machine& m) { m.emergency_stop(false); }},
                              {"cancel", [](Machine& m) { m.cancel_program(); }},
                              {"t1", [](Machine& m) { m.mode(OperatingMode::kT1); }},
                              {"t2", [](Machine& m) { m.mode(OperatingMode::kT2); }},
                              {"aut", [](Machine& m) { m.mode(OperatingMode::kAut); }},
                              {"ext", [](Machine& m) { m.mode(OperatingMode::kExt); }},
                              {"drives on", [](Machine& m) { m.drives(true); }},
                              {"drives off", [](Machine& m) { m.drives(false); }},
                              {"start on", [](Machine& m) { m.start_key(true); }},
                              {"start off", [](Machine& m) { m.start_key(false); }},
                              {"status", [](Machine&) {}}});
  return own;
}

/// The percentage of "override 50"; nullopt: another command.
std::optional<int> override_of(std::string_view command) {
  constexpr std::string_view kOverride = "override ";
  if (!command.starts_with(kOverride)) return std::nullopt;
  int percent = -1;
  const char* const digits = command.data() + kOverride.size();
  const char* const stop = command.data() + command.size();
  const auto [end, error] = std::from_chars(digits, stop, percent);
  const bool fits = error == std::errc() && end == stop && percent >= 0 && percent <= 100;
  return fits ? std::optional(percent) : std::nullopt;
}

template <typename Machine, typename Server>
std::string obey(Server& krc, std::string_view line, const Commands<Machine>& commands,
                 std::string (*status)(Machine&)) {
  std::istringstream words{std::string(line)};
  std::string command;
  for (std::string word; words >> word;) command += (command.empty() ? "" : " ") + word;
  if (command.empty()) return {};
  const auto found = commands.find(command);
  const std::optional<int> percent = override_of(command);
  if (command == "unplug" || command == "plug") {
    krc.unplug(command == "unplug");
  } else if (found == commands.end() && !percent) {
    return fmt::format("\"{}\" is not a command. {}", line, control_help());
  }
  std::string text;
  krc.with([&](Machine& machine) {
    if (found != commands.end()) found->second(machine);
    if (percent) machine.set_override(*percent);
    text = status(machine);
  });
  return text;
}

const char* to_words(RsiPhase phase) {
  using enum RsiPhase;
  static constexpr EnumNames<RsiPhase> kTable{{{kBeforeRsiOn, "before RSI_ON"},
                                               {kRunning, "RSI runs"},
                                               {kEnded, "RSI ended"},
                                               {kFaulted, "RSI stopped"}}};
  return kTable[phase];
}

std::string status(Controller& c) {
  std::string text = fmt::format("{}, IPOC {}, {} late of {} packets", to_words(c.phase()),
                                 c.ipoc(), c.late(), c.packets());
  text += ", setpoint [deg]";
  for (const double rad : c.setpoint_rad())
    text += fmt::format(" {:.4f}", rad * drivers::kDegPerRad);
  if (!c.message().empty()) text += ", pendant: " + c.message();
  return text;
}

std::string status_of_eki(EkiController& c) {
  const std::string fault = c.fault();
  return fmt::format("{}, {}, {} moves{}", c.ready() ? "ready" : "not ready",
                     c.connected() ? "a client is connected" : "no client", c.moves(),
                     fault.empty() ? "" : ", pendant: " + fault);
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
  static const auto kCommands =
      with_common<Controller>({{"reset", [](Controller& c) { c.rsi_on(); }},
                               {"block on", [](Controller& c) { c.block_drives(true); }},
                               {"block off", [](Controller& c) { c.block_drives(false); }}});
  return obey<Controller>(krc, line, kCommands, status);
}

std::string obey(EkiServer& krc, std::string_view line) {
  using drivers::ControllerRequest;
  using Krc = EkiController;
  static const auto kCommands = with_common<Krc>(
      {{"reset", [](Krc& c) { c.start_program(); }},
       {"reconfigure", [](Krc& c) { c.reconfigure_io(); }},
       {"call", [](Krc& c) { c.call_program(); }},
       {"request none", [](Krc& c) { c.request(ControllerRequest::kNone); }},
       {"request brake-test", [](Krc& c) { c.request(ControllerRequest::kBrakeTest); }},
       {"request mastering-test", [](Krc& c) { c.request(ControllerRequest::kMasteringTest); }},
       {"request collision", [](Krc& c) { c.request(ControllerRequest::kCollision); }}});
  return obey<Krc>(krc, line, kCommands, status_of_eki);
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
