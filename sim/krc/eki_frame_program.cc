// Handling of TOOL_DATA and BASE_DATA by the submit program (CC_FRAME of cellcal_sub.sub).

#include <algorithm>
#include <cmath>
#include <string>

#include "drivers/kuka/wire/xml_values.h"
#include "drivers/units.h"
#include "sim/krc/eki_programs.h"

namespace cellcal::sim {

namespace {

using drivers::EkiFrameDone;
using drivers::EkiFrameKind;
using drivers::EkiFrameValues;

constexpr std::chrono::milliseconds kRest{300};
constexpr double kRestRad = 0.01 * drivers::kRadPerDeg;

std::string component(const char* element, std::size_t i) {
  return std::string("Robot") + element + "/@" + drivers::wire::kFrameNames[i];
}

}  // namespace

void EkiPrograms::take_frame_telegram(TimePoint now) {
  bool whole = channel.waiting("RobotCommand/Frame/@C") > 0;
  const auto number = [&](const std::string& path) {
    const auto value = channel.get(path);
    whole = whole && value.has_value();
    return value.value_or(0.0);
  };
  drivers::EkiFrameCommand asked;
  asked.ask = static_cast<std::uint32_t>(std::max(0.0, number("RobotCommand/Frame/@Ask")));
  if (whole) {
    asked.set = number("RobotCommand/Frame/@Do") == 2.0;
    asked.kind = static_cast<EkiFrameKind>(static_cast<int>(number("RobotCommand/Frame/@Kind")));
    asked.number = static_cast<int>(number("RobotCommand/Frame/@Number"));
    for (std::size_t i = 0; i < asked.values.size(); ++i)
      asked.values[i] = number(component("Command/Frame", i));
  }
  frame_waits = whole;
  if (!whole) {
    ++bad;
    frame_answer.ask = asked.ask;
    frame_answer.done = EkiFrameDone::kIncomplete;
    for (const auto& [path, type] : channel.config().receive) {
      while (channel.get(path)) {
      }
    }
    return;
  }
  frame_order = asked;
  frame_answer = {.ask = asked.ask, .set = asked.set, .kind = asked.kind, .number = asked.number};
  frame_rest = arm.actual_at(now);
  frame_at = now;
}

EkiFrameDone EkiPrograms::frame_objection(TimePoint now) const {
  if (frame_order.kind == EkiFrameKind::kAdvice && config.takes_advice) {
    const double code = frame_order.values[1];
    return frame_order.number == 1 && code >= 0.0 && code <= 5.0 ? EkiFrameDone::kNotYet
                                                                 : EkiFrameDone::kNoSuchNumber;
  }
  if (session != 0 || busy) return EkiFrameDone::kInSession;
  const std::vector<double> at = arm.actual_at(now);
  for (std::size_t i = 0; i < axes; ++i)
    if (!(std::abs(at[i] - frame_rest[i]) < kRestRad)) return EkiFrameDone::kMoves;
  const bool known = config.takes_frames && (frame_order.kind == EkiFrameKind::kTool ||
                                             frame_order.kind == EkiFrameKind::kBase);
  if (!known || frame_order.number < 1 ||
      static_cast<std::size_t>(frame_order.number) > frames_of(frame_order.kind).size())
    return EkiFrameDone::kNoSuchNumber;
  if (program_state() == ProgramState::kActive && !ours) return EkiFrameDone::kOtherProgram;
  return EkiFrameDone::kNotYet;
}

void EkiPrograms::attend_frame(TimePoint now) {
  if (!channel.connected()) return;
  if (channel.waiting("RobotCommand/Frame/@Ask") > 0) take_frame_telegram(now);
  if (!frame_waits) return;
  frame_answer.done = frame_objection(now);
  if (frame_answer.done == EkiFrameDone::kNotYet && frame_order.kind == EkiFrameKind::kAdvice) {
    const auto values = [this] {
      return EkiFrameValues{static_cast<double>(config.advice_until),
                            static_cast<double>(config.advice)};
    };
    frame_answer.old_values = values();
    if (frame_order.set) {  // KRL rounds a REAL assigned to an INT
      config.advice_until = static_cast<int>(std::lround(frame_order.values[0]));
      config.advice = static_cast<int>(std::lround(frame_order.values[1]));
    }
    frame_answer.new_values = values();
    frame_answer.done = EkiFrameDone::kDone;
  } else if (frame_answer.done == EkiFrameDone::kNotYet && now - frame_at >= kRest) {
    auto& all = frame_order.kind == EkiFrameKind::kTool ? config.tool_data : config.base_data;
    EkiFrameValues& one = all[static_cast<std::size_t>(frame_order.number) - 1];
    frame_answer.old_values = one;
    if (frame_order.set) {
      one = frame_order.values;
      ++frames_set;
    }
    frame_answer.new_values = one;
    frame_answer.done = EkiFrameDone::kDone;
  }
  if (frame_answer.done != EkiFrameDone::kNotYet) frame_waits = false;
}

void EkiPrograms::send_frame() {
  const auto put = [&](const char* name, auto value) {
    channel.set(std::string("RobotState/Frame/@") + name,
                std::to_string(static_cast<std::uint64_t>(value)));
  };
  put("Ask", frame_answer.ask);
  put("Do", frame_answer.set ? 2 : 1);
  put("Kind", frame_answer.kind);
  put("Number", frame_answer.number);
  put("Done", frame_answer.done);
  for (std::size_t i = 0; i < frame_answer.old_values.size(); ++i) {
    channel.set(component("State/FrameOld", i), krl_real(frame_answer.old_values[i]));
    channel.set(component("State/FrameNew", i), krl_real(frame_answer.new_values[i]));
  }
}

}  // namespace cellcal::sim
