// EKI's set of controller files.

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <vector>

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_template.h"
#include "drivers/kuka/wire/eki_codec.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers {
namespace {

constexpr int kAxes = 6;
// Values queued per element before EKI closes the connection: the adapter's window of at most 8 and
// its three stops, with margin.
constexpr int kBufferLimit = 16;
// Interval between checks of the channel.
constexpr int kChannelCheckMs = 3000;
// Interval between proofs that CELLCAL_EKI waits: above the largest delay of the robot interpreter.
constexpr int kEchoMs = 300;
// m/s. LIN is used for searches and for backing off; T1's limit is the reasonable maximum.
constexpr const char* kLinLimit = "0.25";
// m/s^2. At 10 mm/s the ramp is 0.1 mm long.
constexpr const char* kAccCp = "0.5";
// Rest for this time, in steps of less than a hundredth of a degree, is not a pause within a
// motion.
constexpr int kFrameRestMs = 300;

using krl::once_if;

/// A1 to A6 and the external axes, with the names of their elements.
std::vector<krl::Places> axes_of(int external_axes) {
  std::vector<krl::Places> all;
  for (int i = 0; i < kAxes + external_axes; ++i) {
    const bool own = i < kAxes;
    all.push_back({{"NAME", fmt::format("{}{}", own ? 'A' : 'E', i % kAxes + 1)},
                   {"N", fmt::to_string(i + 1)},
                   {"ELEMENT", own ? "Axis" : "Ext"},
                   {"LATCH", own ? "Latch" : "LatchExt"}});
  }
  return all;
}

/// E`from` to E`to`.
std::vector<krl::Places> external(int from, int to) {
  std::vector<krl::Places> all;
  for (int i = from; i <= to; ++i) all.push_back({{"NAME", fmt::format("E{}", i)}});
  return all;
}

/// Requests of the controller, in order of precedence.
std::vector<krl::Places> requests(const EkiFilesConfig& c) {
  std::vector<krl::Places> all;
  for (const auto& [output, request] :
       {std::pair{c.mastering_test_output, ControllerRequest::kMasteringTest},
        std::pair{c.brake_test_output, ControllerRequest::kBrakeTest},
        std::pair{c.collision_output, ControllerRequest::kCollision}})
    if (output != 0)
      all.push_back({{"OUTPUT", fmt::to_string(output)},
                     {"NUMBER", fmt::to_string(static_cast<int>(request))}});
  return all;
}

krl::Lists lists_of(const EkiFilesConfig& c) {
  const bool any_frame = c.write_frames || c.write_advice;
  krl::Lists lists = {
      {"AXIS", axes_of(c.external_axes)},
      // Asked for no more than the servo's noise, an external axis does not move at all: deg, mm.
      {"HELD", external(1, c.external_axes)},
      // For one that no telegram names CC_TARGET has the data list's 0.0; one that does not exist reads as 0.0.
      {"STAYING", external(c.external_axes + 1, kAxes)},
      // They have separate arrays, not affected by $VEL_AXIS and $ACC_AXIS.
      {"ANY_EXTERNAL", once_if(c.external_axes > 0)},
      {"REQUEST", requests(c)},
      {"ANY_FRAME", once_if(any_frame)},
      // During production: requires neither rest nor an idle robot interpreter.
      {"OF_ADVICE", once_if(c.write_advice)},
      {"FRAMES", {}}};
  for (const char name : wire::kFrameNames)
    lists["COMPONENT"].push_back({{"NAME", std::string(1, name)}});
  lists["FRAME"] = any_frame ? lists["COMPONENT"] : std::vector<krl::Places>();
  // Sizes of TOOL_DATA and BASE_DATA in $config.dat, of every release.
  if (c.write_frames)
    lists["FRAMES"] = {{{"KIND", "1"}, {"ARRAY", "TOOL_DATA"}, {"MOST", "16"}},
                       {{"KIND", "2"}, {"ARRAY", "BASE_DATA"}, {"MOST", "32"}}};
  return lists;
}

krl::Places places_of(const EkiFilesConfig& c, const krl::Lists& lists) {
  const auto text = [](int value) { return fmt::to_string(value); };
  krl::Places places = {
      {"VERSION", krl::release()},
      {"ADDRESS", c.address},
      {"PORT", text(c.port)},
      {"BUFFER_LIMIT", text(kBufferLimit)},
      {"ALIVE_FLAG", text(c.alive_flag)},
      {"STOP_FLAG", text(c.stop_flag)},
      {"INPUT", text(c.input)},
      {"CONTACT", c.contact_is_on ? "TRUE" : "FALSE"},
      {"CONTACT_BIT", fmt::format("{}$IN[{}]", c.contact_is_on ? "" : "NOT ", c.input)},
      {"TOOL_VALUE", krl::frame_value("TOOL_DATA", c.tool)},
      {"BASE_VALUE", krl::frame_value("BASE_DATA", c.base)},
      {"LOAD_VALUE", krl::load_value(c.load)},
      {"ACC_AXIS", text(c.acceleration_percent)},
      {"EXTERNAL_AXES", text(c.external_axes)},
      {"ACC_CP", kAccCp},
      {"LIN_LIMIT", kLinLimit},
      {"INTERRUPT_INPUT", text(c.first_interrupt)},
      {"INTERRUPT_FLAG", text(c.first_interrupt + 1)},
      {"INTERRUPT_TIMER", text(c.first_interrupt + 2)},
      {"TIMER_CLOCK", text(c.first_timer)},
      {"TIMER_SEND", text(c.first_timer + 1)},
      {"TIMER_DEAD", text(c.first_timer + 2)},
      {"STATE_MS", text(c.state_ms)},
      {"LOOK_STATES", text(kChannelCheckMs / c.state_ms)},
      {"DEAD_MAN_MS", text(c.dead_man_ms)},
      {"ECHO_STATES", text(std::max(3, kEchoMs / c.state_ms))},
      {"WAIT_MS", text(c.cell_wait_s * 1000)},
      {"MAY_RUN", c.may_run ? "TRUE" : "FALSE"},
      {"FRAME_REST_MS", text(kFrameRestMs)},
      {"FRAME_AT_ONCE", c.write_advice ? "(CC_FRAME_KIND==3) OR " : ""},
      {"FRAME_WHAT",
       fmt::format("{}{}{}", c.write_frames ? "a frame of TOOL_DATA or BASE_DATA" : "",
                   c.write_frames && c.write_advice ? ", or " : "",
                   c.write_advice ? "CELLCAL_ADVICE" : "")},
      {"FRAME_PROGRAM", ""},
  };
  if (c.write_frames || c.write_advice)
    places["FRAME_PROGRAM"] = krl::part("cellcal_frames.sub.in", places, lists);
  return places;
}

}  // namespace

void EkiFilesConfig::validate() const {
  if (address.empty()) throw ConfigError("controller files: address is empty");
  for (const char c : address) {
    if ((c < '0' || c > '9') && c != '.') {
      throw ConfigError(fmt::format(
          "controller files: address = \"{}\" is not an IPv4 address, which EKI needs", address));
    }
  }
  krl::check_range("port", port, 1, 65535);
  krl::check_range("external_axes", external_axes, 0, 6);
  krl::check_range("input", input, 1, 8192);
  krl::check_range("tool", tool, 0, 128);
  krl::check_range("base", base, 0, 128);
  krl::check_range("load", load, 0, 128);
  krl::check_range("acceleration_percent", acceleration_percent, 1, 100);
  krl::check_range("alive_flag", alive_flag, 1, 1024);
  krl::check_range("stop_flag", stop_flag, 1, 1024);
  krl::check_range("first_timer", first_timer, 1, 62);
  // Three consecutive priorities; 3 and 40..80 are reserved by the controller.
  const bool low = first_interrupt >= 4 && first_interrupt + 2 <= 39;
  const bool high = first_interrupt >= 81 && first_interrupt + 2 <= 128;
  if (!low && !high) {
    throw ConfigError(
        fmt::format("controller files: first_interrupt = {} must be 4 to 37 or 81 to 126: three "
                    "priorities are used from it on, all in 4..39 or in 81..128",
                    first_interrupt));
  }
  krl::check_range("state_ms", state_ms, 12, 100);
  krl::check_range("dead_man_ms", dead_man_ms, 100, 1000);
  krl::check_range("cell_wait_s", cell_wait_s, 10, 7200);
  krl::check_range("brake_test_output", brake_test_output, 0, 8192);
  krl::check_range("mastering_test_output", mastering_test_output, 0, 8192);
  krl::check_range("collision_output", collision_output, 0, 8192);
  if (alive_flag == stop_flag) {
    throw ConfigError(fmt::format(
        "controller files: alive_flag and stop_flag are both {}: use two different flags",
        alive_flag));
  }
}

ControllerFiles eki_files(const EkiFilesConfig& config) {
  config.validate();
  const krl::Lists lists = lists_of(config);
  const krl::Places places = places_of(config, lists);
  ControllerFiles files;
  for (const char* name : {"CellcalEki.xml", "cellcal_eki.src", "cellcal_eki.dat",
                           "cellcal_sub.sub", "cellcal_loop.sub"}) {
    files[name] = krl::fill(krl::template_text(std::string(name) + ".in"), places, lists);
  }
  return files;
}

}  // namespace cellcal::drivers
