#pragma once
// A cell that can be changed at each start of its daemon.

#include "daemon_fixture.h"

namespace cellcal::daemon::testing {

class AChangedCell : public ::testing::Test {
 protected:
  /// Restarts the daemon with the same cell, changed by `more`.
  void restart(const std::string& more) {
    fixture.daemon.reset();
    std::ofstream(fixture.dir / "d.toml")
        << "format = \"cellcal.daemon/1\"\nbackend = \"mock\"\nstate_dir = \""
        << (fixture.dir / "state").string() << "\"\nsocket = \"" << fixture.socket() << "\"\n"
        << kCell << more;
    fixture.start();
  }

  nlohmann::json get(const std::string& path) const { return fixture.get(path); }

  static constexpr const char* kCell =
      "[motion]\nspeed_percent = 100\nacceleration_deg_s2 = 900\njerk_deg_s3 = 12000\n"
      "[mock]\ncontact_noise_mm = 0.02\n";
  DaemonFixture fixture{kCell};
};

}  // namespace cellcal::daemon::testing
