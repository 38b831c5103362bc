#include <gtest/gtest.h>

#include <fstream>
#include <regex>

#include "calib/model/error.h"
#include "daemon/fleet/fleet_server.h"

namespace cellcal::daemon::fleet {
namespace {

const std::string kFormat = "format = \"cellcal.fleet/1\"\n";

std::string refusal(const std::string& text) {
  try {
    (void)parse_fleet_config(text, "fleet.toml");
  } catch (const calib::FileError& refused) {
    return refused.what();
  }
  return "";
}

TEST(FleetConfigFile, TheSampleStatesTheDefaults) {
  std::ifstream in(CELLCAL_FLEET_SAMPLE);
  const std::string sample{std::istreambuf_iterator<char>(in), {}};
  // Commented keys are defaults, except those that name files.
  std::string all = std::regex_replace(
      sample,
      std::regex(
          "\n#(?!(ca|certificate|key|user|password_file|client|listen|host_names) )(\\w+ = )"),
      "\n$2");
  const FleetConfig usual = parse_fleet_config(kFormat, "usual"),
                    stated = parse_fleet_config(all, "sample");
  EXPECT_NE(all.find("\nburst = "), std::string::npos);
  EXPECT_EQ(usual.collector.broker.host, stated.collector.broker.host);
  EXPECT_EQ(usual.collector.broker.port, stated.collector.broker.port);
  EXPECT_EQ(usual.collector.broker.group, stated.collector.broker.group);
  EXPECT_EQ(usual.collector.store.connection, stated.collector.store.connection);
  EXPECT_EQ(usual.collector.store.telemetry_months, stated.collector.store.telemetry_months);
  EXPECT_EQ(usual.collector.store.calibration_days, stated.collector.store.calibration_days);
  EXPECT_EQ(usual.collector.store.check_days, stated.collector.store.check_days);
  EXPECT_EQ(usual.collector.allowance.messages_per_s, stated.collector.allowance.messages_per_s);
  EXPECT_EQ(usual.collector.allowance.burst, stated.collector.allowance.burst);
  EXPECT_EQ(usual.collector.allowance.bytes_per_day, stated.collector.allowance.bytes_per_day);
  EXPECT_EQ(usual.listen.socket, stated.listen.socket);
}

TEST(FleetConfigFile, WrongOnesAreRefusedByKey) {
  const auto names = [](const std::string& text, const std::string& key) {
    const std::string words = refusal(kFormat + text);
    EXPECT_NE(words.find(key), std::string::npos) << text << "\n" << words;
    EXPECT_NE(words.find("fleet.toml"), std::string::npos) << words;
  };
  names("brocker = 1", "brocker");
  names("[broker]\nhots = \"x\"", "hots");
  names("[broker]\nport = 0", "port");
  names("[broker]\nport = \"1883\"", "port");
  names("[broker]\nclient = \"a b\"", "client");
  names("[broker]\nuser = \"x\"", "user");
  names("[broker]\nuser = \"x\"\npassword_file = \"/nowhere\"", "password_file");
  names("[broker]\nca = \"/etc/ca.pem\"", "ca");
  names("[broker]\ntls = true\nkey = \"/etc/key.pem\"", "key");
  names("[limits]\nburst = 0", "burst");
  names("[limits]\nmessages_per_s = nan", "messages_per_s");
  names("[retention]\ntelemetry_months = 0", "telemetry_months");
  names("[due]\ncheck_days = -1", "check_days");
  names("[http]\nlisten = \"0.0.0.0:8090\"", "listen");
  names("[http]\nlisten = \"127.0.0.1:0\"", "listen");
  names("[http]\nsocket = \"fleet.sock\"", "socket");
  EXPECT_NE(refusal("[broker]\n").find("format"), std::string::npos);
  EXPECT_NE(refusal("format = \"cellcal.fleet/2\"").find("format"), std::string::npos);
}

TEST(FleetConfigFile, TlsHasItsPort) {
  EXPECT_EQ(parse_fleet_config(kFormat + "[broker]\ntls = true", "x").collector.broker.port, 8883);
}

}  // namespace
}  // namespace cellcal::daemon::fleet
