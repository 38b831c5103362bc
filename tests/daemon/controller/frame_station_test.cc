#include "daemon/controller/frame_station.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "calib/files/input_file.h"
#include "drivers/error.h"
#include "tests/daemon/controller/corrected_tool.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon {
namespace {

using drivers::EkiFrameChoice;
using drivers::EkiFrameEnd;
using drivers::EkiFrameKind;
using drivers::EkiFrameRequest;
using drivers::EkiFrameResult;
using drivers::EkiFrameTrouble;
using drivers::EkiFrameValues;
using drivers::same_frame;
using testing::kNew;
using testing::kOld;
using testing::kTool3;
using Why = FrameNotSent::Why;

/// A controller with one frame and a scripted answer to the next set.
struct StationRig {
  testing::TemporaryDirectory dir;
  EkiFrameValues now = kOld;
  int sets = 0, connections = 0;
  bool configured = true;
  EkiFrameEnd next = EkiFrameEnd::kSet;
  bool obeys = true;                 ///< true if a set changes the frame
  std::function<void()> before_set;  ///< inspects the disk
  FrameStation station{parts()};

  FrameStation::Parts parts() {
    return {dir / "frames.json",
            [this] {
              return configured ? FrameStation::Exchange([this](const EkiFrameRequest& r,
                                                                const EkiFrameChoice& choice) {
                EXPECT_FALSE(r.values) << "the choice says what is set";
                ++connections;
                return answer(choice);
              })
                                : FrameStation::Exchange();
            },
            [] { return std::string("2026-11-20T10:00:00.000Z"); }};
  }
  EkiFrameResult answer(const EkiFrameChoice& choice) {
    EkiFrameResult result;
    result.old_values = now;
    if (const auto values = choice ? choice(now) : std::nullopt) {
      if (before_set) before_set();
      ++sets;
      if (obeys) now = *values;
      result.end = next;
      if (next == EkiFrameEnd::kUnknown) result.trouble = EkiFrameTrouble::kClosed;
      if (next == EkiFrameEnd::kUnknown || next == EkiFrameEnd::kRefused) {
        result.old_values.reset();
        return result;
      }
    } else {
      result.end = EkiFrameEnd::kRead;
    }
    result.new_values = now;
    return result;
  }
  FrameOrder order() const { return {kTool3, kNew, kOld, "anna", "calibration cal.json"}; }
  std::vector<FrameRecord> on_disk() const {
    return frames_from_json(calib::read_file(dir / "frames.json"), "frames.json");
  }
};

template <class Act>
std::optional<Why> refusal(Act act) {
  try {
    act();
    return std::nullopt;
  } catch (const FrameNotSent& not_sent) {
    return not_sent.why;
  }
}

TEST(FrameStation, HasTheOldValuesOnDiskBeforeAnythingIsSent) {
  StationRig rig;
  rig.before_set = [&] {
    const auto records = rig.on_disk();
    ASSERT_EQ(records.size(), 1U);
    EXPECT_EQ(records[0].outcome, FrameOutcome::kUnknown);
    EXPECT_EQ(records[0].before, kOld);
  };
  const FrameRecord record = rig.station.set(rig.order());
  EXPECT_EQ(rig.sets, 1);
  EXPECT_EQ(rig.connections, 1) << "read and set on one: nobody is served in between";
  EXPECT_EQ(record.outcome, FrameOutcome::kSet);
  const auto records = rig.on_disk();
  ASSERT_EQ(records.size(), 1U);
  EXPECT_EQ(records[0].outcome, FrameOutcome::kSet);
  EXPECT_EQ(records[0].before, kOld);
  EXPECT_EQ(records[0].sent, kNew);
  EXPECT_EQ(records[0].by, "anna");
}

TEST(FrameStation, SetsTheOldValuesAgainAlsoBehindARestart) {
  StationRig rig;
  const int id = rig.station.set(rig.order()).id;
  FrameStation later(rig.parts());
  const FrameRecord back = later.restore(id, "bert");
  EXPECT_EQ(back.outcome, FrameOutcome::kSet);
  EXPECT_EQ(back.restores, id);
  EXPECT_GT(back.id, id);
  EXPECT_EQ(rig.now, kOld);
}

TEST(FrameStation, ALostAnswerIsKeptAsUnknownAndCanBeSetBack) {
  for (const bool obeys : {true, false}) {
    StationRig rig;
    rig.obeys = obeys;
    rig.next = EkiFrameEnd::kUnknown;
    const FrameRecord record = rig.station.set(rig.order());
    EXPECT_EQ(record.outcome, FrameOutcome::kUnknown);
    EXPECT_NE(record.words.find("pendant"), std::string::npos);
    EXPECT_NE(record.words.find("'cellcal frames --restore 1' reads it"), std::string::npos);
    EXPECT_EQ(record.before, kOld);
    rig.next = EkiFrameEnd::kSet;
    rig.obeys = true;
    EXPECT_EQ(rig.station.restore(record.id, "anna").outcome, FrameOutcome::kSet);
    EXPECT_EQ(rig.now, kOld);
  }
}

TEST(FrameStation, WhatTheControllerReadsBackOtherwiseIsNoSuccess) {
  StationRig rig;
  rig.next = EkiFrameEnd::kDiffers;
  EXPECT_EQ(rig.station.set(rig.order()).outcome, FrameOutcome::kDiffers);
}

TEST(FrameStation, ARefusalByTheControllerIsThrownAndKept) {
  StationRig rig;
  rig.obeys = false;
  rig.next = EkiFrameEnd::kRefused;
  EXPECT_EQ(refusal([&] { rig.station.set(rig.order()); }), Why::kController);
  EXPECT_EQ(rig.on_disk().at(0).outcome, FrameOutcome::kRefused);
}

TEST(FrameStation, SendsNothingWhereTheControllerHasAnotherFrameThanWasConfirmed) {
  StationRig rig;
  rig.now[1] += 0.01;
  EXPECT_EQ(refusal([&] { rig.station.set(rig.order()); }), Why::kChanged);
  EXPECT_EQ(rig.sets, 0);
}

TEST(FrameStation, TakesAToolFarAwayForAnotherNumber) {
  StationRig rig;
  FrameOrder order = rig.order();
  order.values[2] += 10.5;
  EXPECT_EQ(refusal([&] { rig.station.set(order); }), Why::kUnusable);
  EXPECT_EQ(rig.sets, 0);
  order.name.kind = EkiFrameKind::kBase;
  EXPECT_EQ(refusal([&] { rig.station.set(order); }), std::nullopt) << "a base may lie anywhere";
}

TEST(FrameStation, TakesAToolThatIsTurnedForAnotherNumber) {
  StationRig rig;
  FrameOrder order = rig.order();
  order.values[5] += 1.5;
  EXPECT_EQ(refusal([&] { rig.station.set(order); }), Why::kUnusable);
  EXPECT_EQ(rig.sets, 0);
  // A and A - 360 are the same orientation, and so are (A, B, C) and (A + 180, 180 - B, C + 180).
  order.values = {kNew[0], kNew[1], kNew[2], kNew[3] - 180.0, 180.0 - kNew[4], kNew[5] + 180.5};
  EXPECT_EQ(refusal([&] { rig.station.set(order); }), std::nullopt);
}

TEST(FrameStation, ReadsAndReplacesNothingThatCouldNotBeSetBack) {
  StationRig rig;
  const int id = rig.station.set(rig.order()).id;
  rig.now[0] = 1e30;
  EXPECT_EQ(refusal([&] { rig.station.read(kTool3); }), Why::kController);
  EXPECT_EQ(refusal([&] { rig.station.restore(id, "anna"); }), Why::kController);
  EXPECT_EQ(rig.sets, 1);
}

/// A file edited by hand.
TEST(FrameStation, RestoresNoNumberThatIsNone) {
  StationRig rig;
  FrameRecord record;
  record.id = 7;
  record.name = kTool3;
  record.before[0] = 1e9;
  record.sent = kOld;
  std::ofstream(rig.dir / "frames.json") << frames_to_json({record});
  FrameStation station(rig.parts());
  EXPECT_EQ(refusal([&] { station.restore(7, "anna"); }), Why::kUnusable);
  EXPECT_EQ(rig.sets, 0);
}

TEST(FrameStation, SendsNoNumberThatIsNone) {
  for (const double wrong : {std::nan(""), HUGE_VAL, 30001.0, -1e9}) {
    StationRig rig;
    FrameOrder order = rig.order();
    order.values[4] = wrong;
    EXPECT_EQ(refusal([&] { rig.station.set(order); }), Why::kUnusable) << wrong;
    EXPECT_EQ(rig.sets, 0);
  }
}

TEST(FrameStation, RestoresNothingThatSomebodyHasChangedSince) {
  StationRig rig;
  const int id = rig.station.set(rig.order()).id;
  rig.now[0] += 1.0;
  EXPECT_EQ(refusal([&] { rig.station.restore(id, "anna"); }), Why::kChanged);
  EXPECT_EQ(refusal([&] { rig.station.restore(id + 1, "anna"); }), Why::kNoSuchRecord);
  EXPECT_EQ(rig.sets, 1);
}

TEST(FrameStation, AsksNothingOfAControllerThatTheConfigurationDoesNotAllow) {
  StationRig rig;
  rig.configured = false;
  EXPECT_FALSE(rig.station.configured());
  EXPECT_EQ(refusal([&] { rig.station.read(kTool3); }), Why::kNotConfigured);
  EXPECT_EQ(refusal([&] { rig.station.set(rig.order()); }), Why::kNotConfigured);
}

TEST(FrameStation, SendsNothingWhereTheOldValuesCannotBeKept) {
  StationRig rig;
  std::filesystem::create_directories(rig.dir / "frames.json" / "in the way");
  EXPECT_EQ(refusal([&] { rig.station.set(rig.order()); }), Why::kStorage);
  EXPECT_EQ(rig.sets, 0);
}

TEST(FrameStation, KeepsADamagedFileAndSetsNothing) {
  for (const char* text : {"", "[]", "{\"format\": \"cellcal.frames/1\"}",
                           "{\"format\": \"cellcal.frames/2\", \"frames\": []}",
                           "{\"format\": \"cellcal.frames/1\", \"frames\": [{\"id\": 1}]}",
                           "{\"format\": \"cellcal.frames/1\", \"frames\": [7]}"}) {
    StationRig rig;
    std::ofstream(rig.dir / "frames.json") << text;
    FrameStation station(rig.parts());
    EXPECT_NE(station.problem().find("frames.json"), std::string::npos) << text;
    EXPECT_EQ(refusal([&] { station.set(rig.order()); }), Why::kStorage) << text;
    EXPECT_EQ(refusal([&] { station.restore(7, "anna"); }), Why::kStorage)
        << "not that there is no number 7: " << text;
    EXPECT_EQ(calib::read_file(rig.dir / "frames.json"), text);
  }
}

TEST(FrameName, IsOneOfBothArraysWithANumber) {
  EXPECT_EQ(frame_name("TOOL_DATA[3]"), kTool3);
  EXPECT_EQ(frame_name("BASE_DATA[128]"), (FrameName{EkiFrameKind::kBase, 128}));
  for (const char* text : {"", "TOOL_DATA", "TOOL_DATA[", "TOOL_DATA[]", "TOOL_DATA[0]",
                           "TOOL_DATA[129]", "TOOL_DATA[-1]", "TOOL_DATA[3", "TOOL_DATA[3]]",
                           "TOOL_DATA[99999999999]", "tool_data[3]", "LOAD_DATA[1]"})
    EXPECT_EQ(frame_name(text), std::nullopt) << text;
}

}  // namespace
}  // namespace cellcal::daemon
