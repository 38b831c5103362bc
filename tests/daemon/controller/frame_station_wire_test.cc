// The station with the emulated controller over a real socket, assembled as in the daemon.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "daemon/controller/frame_station.h"
#include "drivers/kuka/krl/krl_files.h"
#include "sim/krc/eki_server.h"
#include "tests/daemon/controller/corrected_tool.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon {
namespace {

using namespace std::chrono_literals;
using drivers::EkiFrameKind;
using drivers::EkiFrameValues;
using drivers::same_frame;
using testing::kNew;
using testing::kOld;
using testing::kTool3;

struct StationWire {
  testing::TemporaryDirectory dir;
  sim::EkiServer krc{controller(), {.address = "127.0.0.1", .port = 0}};
  FrameStation station{{dir / "frames.json",
                        [this] {
                          return [port = krc.port()](const drivers::EkiFrameRequest& request,
                                                     const drivers::EkiFrameChoice& choice) {
                            return drivers::exchange_frame("127.0.0.1", port, request, choice);
                          };
                        },
                        [] { return std::string("2026-11-20T10:00:00.000Z"); }}};

  StationWire() { krc.start(); }
  static sim::EkiControllerConfig controller() {
    drivers::EkiFilesConfig files;
    files.write_frames = true;
    sim::EkiControllerConfig config;
    config.files = drivers::eki_files(files);
    config.tool_data[2] = kOld;
    return config;
  }
  EkiFrameValues now() {
    EkiFrameValues values{};
    krc.with([&](sim::EkiController& c) { values = c.frame(EkiFrameKind::kTool, 3); });
    return values;
  }
};

/// In immediate succession: the controller opens its port again 0.1 s after each.
TEST(FrameStationWire, SetsAndSetsBackAtOnceThoughThePortNeedsAMomentAfterEachClient) {
  StationWire wire;
  EXPECT_TRUE(same_frame(kOld, wire.station.read(kTool3)));
  const FrameRecord record = wire.station.set({kTool3, kNew, kOld, "anna", "calibration"});
  EXPECT_EQ(record.outcome, FrameOutcome::kSet) << record.words;
  EXPECT_TRUE(same_frame(kNew, wire.now()));
  const FrameRecord back = wire.station.restore(record.id, "anna");
  EXPECT_EQ(back.outcome, FrameOutcome::kSet) << back.words;
  EXPECT_TRUE(same_frame(kOld, wire.now()));
}

TEST(FrameStationWire, AFrameThatIsNotWhatWasConfirmedIsLeftAsItIs) {
  StationWire wire;
  EXPECT_THROW(wire.station.set({kTool3, kNew, kNew, "anna", "calibration"}), FrameNotSent);
  wire.krc.with([](sim::EkiController& c) { EXPECT_EQ(c.frames_set(), 0U); });
  EXPECT_TRUE(wire.station.records().empty());
}

/// The cable is unplugged longer than the wait for a state; the kernel accepts the connection.
TEST(FrameStationWire, WaitsForAControllerThatSaysNothingForAWhile) {
  StationWire wire;
  wire.krc.unplug(true);
  std::thread plug([&] {
    std::this_thread::sleep_for(4s);
    wire.krc.unplug(false);
  });
  EXPECT_NO_THROW(wire.station.read(kTool3));
  plug.join();
}

}  // namespace
}  // namespace cellcal::daemon
