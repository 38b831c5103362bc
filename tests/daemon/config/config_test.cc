#include "daemon/config/config.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "calib/model/error.h"
#include "daemon/config/config_values.h"
#include "drivers/error.h"
#include "drivers/kuka/rsi/rsi_space.h"
#include "drivers/units.h"
#include "tests/daemon/config/reason.h"

namespace cellcal::daemon {
namespace {

using testing::reason;

const std::string kRsi =
    "format = \"cellcal.daemon/1\"\nbackend = \"rsi\"\n[contact]\ndevice = \"/dev/ttyUSB0\"\n";
const std::string kMock = "format = \"cellcal.daemon/1\"\nbackend = \"mock\"\n";

TEST(AConfiguration, HasSoundDefaults) {
  const DaemonConfig config = parse_config(kRsi, "d.toml");
  EXPECT_EQ(config.backend, BackendKind::kRsi);
  EXPECT_EQ(config.state_dir, "/var/lib/cellcal");
  EXPECT_EQ(config.socket, "/run/cellcal/cellcald.sock");
  EXPECT_EQ(config.rsi.port, 49152);
  EXPECT_EQ(config.contact.device, "/dev/ttyUSB0");
  EXPECT_EQ(config.contact.baud, 1'000'000);
  EXPECT_DOUBLE_EQ(config.touch.fast_m_s, 0.010);
  EXPECT_DOUBLE_EQ(config.touch.slow_m_s, 0.004);
  EXPECT_EQ(config.touch.confirm_every, 8);
  EXPECT_TRUE(config.realtime);
}

TEST(AConfiguration, IsReadInItsUnits) {
  const DaemonConfig config = parse_config(
      kMock +
          "[motion]\nspeed_percent = 50\nacceleration_deg_s2 = 180\nfast_search_mm_s = 8\n"
          "slow_search_mm_s = 1.5\n[mock]\nseed = 9\nlag_ms = 15\nstart_deg = [180]\n",
      "d.toml");
  EXPECT_DOUBLE_EQ(config.motion.speed_fraction, 0.5);
  EXPECT_NEAR(config.motion.acceleration_rad_s2, 3.14159265358979, 1e-12);
  EXPECT_DOUBLE_EQ(config.touch.slow_m_s, 0.0015);
  EXPECT_EQ(config.mock.seed, 9u);
  EXPECT_DOUBLE_EQ(config.mock.lag_s, 0.015);
  ASSERT_EQ(config.mock.start_rad.size(), 1u);
}

TEST(AConfiguration, AsksTheEmulatedCellForWhatRealArmsHaveOnlyWhereItSaysSo) {
  const MockConfig plain = parse_config(kMock, "d.toml").mock;
  for (const double off : {plain.compliance_rad_per_nm, plain.play_arcsec, plain.tip_offset_m,
                           plain.growth, plain.contact_noise_m, plain.bad_contact_share})
    EXPECT_EQ(off, 0.0);
  const MockConfig real =
      parse_config(kMock +
                       "[mock]\ncompliance_sigma_rad_per_nm = 5e-6\nplay_arcsec = 10\n"
                       "tip_offset_mm = 0.5\ngrowth_ppm = 25\nwarm_up_s = 90\n"
                       "contact_noise_mm = 0.03\nbad_contact_percent = 1\n",
                   "d.toml")
          .mock;
  EXPECT_DOUBLE_EQ(real.compliance_rad_per_nm, 5e-6);
  EXPECT_DOUBLE_EQ(real.play_arcsec, 10.0);
  EXPECT_DOUBLE_EQ(real.tip_offset_m, 0.5e-3);
  EXPECT_DOUBLE_EQ(real.growth, 25e-6);
  EXPECT_DOUBLE_EQ(real.warm_up_s, 90.0);
  EXPECT_DOUBLE_EQ(real.contact_noise_m, 0.03e-3);
  EXPECT_DOUBLE_EQ(real.bad_contact_share, 0.01);
}

TEST(AConfiguration, SaysHowOftenAContactIsConfirmedAndAlwaysWhereAFlagStops) {
  EXPECT_EQ(parse_config(kMock + "[motion]\nconfirm_every = 3\n", "d").touch.confirm_every, 3);
  // A slow first search implies slow searches throughout.
  EXPECT_DOUBLE_EQ(parse_config(kMock + "[motion]\nfast_search_mm_s = 3\n", "d").touch.slow_m_s,
                   0.003);
  const std::string flag = kMock + "[mock]\nwire = \"eki\"\n[eki]\nstop = \"flag\"\n";
  EXPECT_EQ(parse_config(flag, "d").touch.confirm_every, 1);
  EXPECT_EQ(parse_config(flag + "[motion]\nconfirm_every = 1\n", "d").touch.confirm_every, 1);
}

TEST(AConfiguration, HasAFlagForAnInterruptedRsiConnectionAndOneForAStandingEkiConnection) {
  const std::string rsi = kRsi + "[controller]\nalive_flag = 7\n";
  EXPECT_EQ(parse_config(rsi, "d.toml").rsi_files.flag, 7);
  const DaemonConfig both = parse_config(rsi + "interrupted_flag = 8\n", "d.toml");
  EXPECT_EQ(both.rsi_files.flag, 8);
  EXPECT_EQ(both.controller.alive_flag, 7);
}

TEST(AConfiguration, OfModeRelativeReachesAdapterAndControllersFiles) {
  const DaemonConfig usual = parse_config(kRsi, "d.toml");
  EXPECT_EQ(usual.rsi.mode, drivers::CorrectionMode::kAbsolute);
  EXPECT_TRUE(usual.rsi.hold_on);
  const DaemonConfig config =
      parse_config(kRsi + "[rsi]\nmode = \"relative\"\nlongest_lag_ms = 40\n", "d.toml");
  EXPECT_EQ(config.rsi.mode, drivers::CorrectionMode::kRelative);
  EXPECT_FALSE(config.rsi.hold_on);
  EXPECT_EQ(config.rsi_files.mode, drivers::CorrectionMode::kRelative);
  EXPECT_DOUBLE_EQ(config.rsi.longest_lag_s, 0.04);
}

TEST(AConfiguration, OfWhatTheControllerTellsReachesAdapterAndControllersFiles) {
  const DaemonConfig usual = parse_config(kRsi, "d.toml");
  EXPECT_EQ(usual.rsi.mode_tag, usual.rsi_files.mode_tag);
  EXPECT_EQ(usual.rsi.override_tag, usual.rsi_files.override_tag);
  const DaemonConfig config =
      parse_config(kRsi + "[rsi]\nmode_tag = \"Krc.Op\"\noverride_tag = \"\"\n", "d.toml");
  EXPECT_EQ(config.rsi.mode_tag, "Krc.Op");
  EXPECT_EQ(config.rsi_files.mode_tag, "Krc.Op");
  EXPECT_EQ(config.rsi.override_tag + config.rsi_files.override_tag, "");
}

TEST(AConfiguration, OfTheContactInputReachesAdapterAndControllersFiles) {
  const DaemonConfig usual = parse_config(kRsi, "d.toml");
  EXPECT_EQ(usual.rsi.contact_tag + usual.rsi_files.contact_tag, "");
  const DaemonConfig config =
      parse_config(kRsi +
                       "[rsi]\ncontact_tag = \"Contact.R\"\n[controller]\ninput = 17\n"
                       "contact_level = \"off\"\n",
                   "d.toml");
  EXPECT_EQ(config.rsi.contact_tag, "Contact.R");
  EXPECT_EQ(config.rsi_files.contact_tag, "Contact.R");
  EXPECT_EQ(config.rsi_files.input, 17);
}

TEST(AConfiguration, OfCorrectionsInSpaceReachesAdapterAndControllersFiles) {
  const DaemonConfig usual = parse_config(kRsi, "d.toml");
  EXPECT_FALSE(usual.rsi.space.on);
  EXPECT_FALSE(usual.rsi_files.space.on);
  const DaemonConfig config = parse_config(
      kRsi +
          "[rsi]\ncorrection = \"space\"\ncart_tag = \"Kart\"\ncorrection_frame = \"tool\"\n"
          "correction_limit_mm = 300\ncorrection_turn_limit_deg = 60\n[controller]\nbase = 3\n",
      "d.toml");
  for (const drivers::SpaceCorrection& space : {config.rsi.space, config.rsi_files.space}) {
    EXPECT_TRUE(space.on);
    EXPECT_EQ(space.tag, "Kart");
    EXPECT_EQ(space.frame, drivers::CorrectionFrame::kTool);
    EXPECT_DOUBLE_EQ(space.limit_mm, 300.0);
    EXPECT_DOUBLE_EQ(space.turn_limit_deg, 60.0);
    EXPECT_FALSE(space.compare_tcp) << "RIst is seen from BASE_DATA[3]";
  }
}

TEST(CorrectionsInSpace, AreOfTheFlangeOrOfTheCellsToolAsTheControllerHasIt) {
  calib::Cell cell;
  cell.robot.joints.resize(6);
  for (calib::Joint& joint : cell.robot.joints) {
    joint.min_rad = -3.0;
    joint.max_rad = 3.0;
    joint.max_speed_rad_s = 2.0;
  }
  cell.tool.tcp.translation() = Eigen::Vector3d(0.1, 0.2, 0.3);
  const std::vector<double> zero(6, 0.0);
  const std::string text = kRsi + "[rsi]\ncorrection = \"space\"\n";
  const auto at = [&](const std::string& more) -> Eigen::Vector3d {
    return rsi_config_for(parse_config(text + more, "d.toml"), cell)
        .space.geometry->tcp(zero)
        .translation();
  };
  EXPECT_LT(at("").norm(), 1e-12);
  EXPECT_LT((at("[controller]\ntool = 5\n") - cell.tool.tcp.translation()).norm(), 1e-12);
  cell.robot.joints.pop_back();
  EXPECT_THROW(rsi_config_for(parse_config(text, "d.toml"), cell), drivers::ConfigError);
}

struct Wrong {
  std::string text;
  const char* key;
};

class AWrongConfiguration : public ::testing::TestWithParam<Wrong> {};

TEST_P(AWrongConfiguration, IsRefusedByFileAndKey) {
  const std::string words = reason(GetParam().text);
  EXPECT_EQ(words.find("d.toml"), 0u) << words;
  EXPECT_NE(words.find(GetParam().key), std::string::npos) << words;
}

INSTANTIATE_TEST_SUITE_P(
    Config, AWrongConfiguration,
    ::testing::Values(
        Wrong{"backend = \"rsi\"\n", "format"},
        Wrong{"format = \"cellcal.daemon/2\"\nbackend = \"rsi\"\n", "format"},
        Wrong{"format = \"cellcal.daemon/1\"\n", "backend"},
        Wrong{"format = \"cellcal.daemon/1\"\nbackend = \"s7\"\n", "backend"},
        Wrong{"format = \"cellcal.daemon/1\"\nbackend = \"rsi\"\n", "contact"},
        Wrong{kMock + "colour = 1\n", "colour"},
        Wrong{kMock + "state_dir = \"here\"\n", "state_dir"},
        Wrong{kMock + "socket = \"here\"\n", "socket"},
        Wrong{kMock + "[motion]\nspeed_percent = 0\n", "speed_percent"},
        Wrong{kMock + "[motion]\nspeed_percent = 101\n", "speed_percent"},
        Wrong{kMock + "[motion]\nspeed_percent = nan\n", "speed_percent"},
        Wrong{kMock + "[motion]\nhand_speed_mm_s = 251\n", "hand_speed_mm_s"},
        Wrong{kMock + "[motion]\nslow_search_mm_s = 9\nfast_search_mm_s = 5\n", "slow_search_mm_s"},
        Wrong{kMock + "[motion]\njerk = 9\n", "jerk"},
        Wrong{kMock + "[rsi]\nport = 70000\n", "port"},
        Wrong{kMock + "[rsi]\nport = \"x\"\n", "port"},
        Wrong{kRsi + "[rsi]\nmode = \"both\"\n", "mode"},
        Wrong{kRsi + "[rsi]\nhold_on = false\n", "hold_on"},
        Wrong{kRsi + "[rsi]\nmode = \"relative\"\nhold_on = true\n", "hold_on"},
        Wrong{kRsi + "[rsi]\nlongest_lag_ms = 5\n", "longest_lag_ms"},
        Wrong{kRsi + "[rsi]\ncorrection = \"joint\"\n", "correction"},
        Wrong{kRsi + "[rsi]\ncorrection = \"space\"\nmode = \"relative\"\n", "correction"},
        Wrong{kRsi + "[rsi]\ncorrection_frame = \"world\"\n", "correction_frame"},
        Wrong{kRsi + "[rsi]\ncorrection = \"space\"\n[controller]\nbase = 1\n", "correction_frame"},
        Wrong{kRsi + "[rsi]\ncorrection_turn_limit_deg = 181\n", "correction_turn_limit_deg"},
        Wrong{"format = \"cellcal.daemon/1\"\nbackend = \"eki\"\n", "contact"},
        Wrong{kMock + "[mock]\nwire = \"profinet\"\n", "wire"},
        Wrong{kMock + "[eki]\nstop = \"both\"\n", "stop"},
        Wrong{kMock + "[eki]\nport = 0\n", "port"},
        Wrong{kMock + "[eki]\nsilence_ms = 20\n", "silence_ms"},
        Wrong{kMock + "[eki]\nlatch_delay_ms = nan\n", "latch_delay_ms"},
        Wrong{kMock + "[eki]\ninput = 4\n", "input"},
        Wrong{kMock + "[controller]\ninput = 0\n", "input"},
        Wrong{kMock + "[controller]\nexternal_axes = 7\n", "external_axes"},
        Wrong{kMock + "[controller]\nstop_flag = 901\n", "stop_flag"},
        Wrong{kMock + "[controller]\nport = 1\n", "port"},
        Wrong{kMock + "[mock]\nwire = \"eki\"\n[eki]\nstop = \"flag\"\n"
                      "[motion]\nfast_search_mm_s = 5\n",
              "fast_search_mm_s"},
        Wrong{kMock + "[mock]\nwire = \"eki\"\n[eki]\nstop = \"flag\"\n"
                      "[motion]\nconfirm_every = 8\n",
              "confirm_every"},
        Wrong{kMock + "[motion]\nconfirm_every = 0\n", "confirm_every"},
        Wrong{kMock + "[contact]\nbaud = 9601\n", "baud"},
        Wrong{kMock + "[mock]\ncycle_ms = 8\n", "cycle_ms"},
        Wrong{kMock + "[mock]\ncompliance_sigma_rad_per_nm = 0.1\n", "compliance_sigma_rad_per_nm"},
        Wrong{kMock + "[mock]\nplay_arcsec = -1\n", "play_arcsec"},
        Wrong{kMock + "[mock]\ntip_offset_mm = 11\n", "tip_offset_mm"},
        Wrong{kMock + "[mock]\ntool_shift_mm = [1, 2]\n", "tool_shift_mm"},
        Wrong{kMock + "[mock]\ngrowth_ppm = nan\n", "growth_ppm"},
        Wrong{kMock + "[mock]\nwarm_up_s = 0\n", "warm_up_s"},
        Wrong{kMock + "[mock]\ncontact_noise_mm = 0.2\n", "contact_noise_mm"},
        Wrong{kMock + "[mock]\nbad_contact_percent = 101\n", "bad_contact_percent"},
        Wrong{kMock + "[mock]\nstart_deg = [1, inf]\n", "start_deg"},
        Wrong{kMock + "[rsi]\nsilence_cycles = 500\n",
              "d.toml:4: rsi.silence_cycles: 500 is out of range, allowed are 2 to 50"},
        Wrong{kMock + "[rsi]\naxis_tag = \"<A>\"\n",
              "d.toml:4: rsi.axis_tag: \"<A>\" is not a name: allowed are 1 to 32 letters"},
        Wrong{kMock + "[rsi]\nsentype = \"\"\n", "d.toml:4: rsi.sentype: \"\" is not a name"},
        Wrong{kMock + "[rsi]\nexternal_axis_tag = \"1E\"\n", "d.toml:4: rsi.external_axis_tag"},
        Wrong{kMock + "[rsi]\nstop_tag = \"a b\"\n", "d.toml:4: rsi.stop_tag"},
        Wrong{kMock + "[rsi]\ncart_tag = \"\"\n", "d.toml:4: rsi.cart_tag"},
        Wrong{kMock + "[rsi]\nmode_tag = \"a b\"\n", "d.toml:4: rsi.mode_tag"},
        Wrong{kMock + "[rsi]\noverride_tag = \"Delay.R\"\n", "fills itself"},
        Wrong{kMock + "[rsi]\ncontact_tag = \"Contact.R\"\n", "a cut wire reads as contact"},
        Wrong{kMock + "[controller]\ncontact_level = \"off\"\n[rsi]\ncontact_tag = \"mode.r\"\n",
              "contact_tag = \"mode.r\" is mode_tag, too"},
        Wrong{kMock + "[rsi]\noverride_tag = \"mode.r\"\n", "is mode_tag, too"},
        Wrong{kMock + "[rsi]\naxis_tag = \"RKorr\"\n", "corrections in space (POSCORR)"},
        Wrong{kMock + "[rsi]\nstop_tag = \"ak\"\n",
              "d.toml:4: rsi.stop_tag: \"ak\" is axis_tag, too"},
        Wrong{kMock + "[rsi]\nexternal_axis_tag = \"Stop\"\n",
              "rsi.stop_tag: \"Stop\" is external_axis_tag, too"},
        Wrong{kMock + "[rsi]\naxis_tag = \"IPOC\"\n",
              "d.toml:4: rsi.axis_tag: \"IPOC\" is already an element of every telegram"},
        Wrong{kMock + "[rsi]\nbind = \"not-an-ip\"\n",
              "d.toml:4: rsi.bind: \"not-an-ip\" is not a usable IPv4 address"},
        Wrong{kMock + "[rsi]\nbind = \"10.0.0.256\"\n", "ip -4 address"},
        Wrong{kMock + "[rsi]\nbind = \"224.0.0.1\"\n", "rsi.bind"},
        Wrong{
            kMock + "[rsi]\nlate_replies_limit = 100\n",
            "d.toml:4: rsi.late_replies_limit: must be below timeout_cycles of [controller], 100"},
        Wrong{kMock + "[eki]\naddress = \"\"\n", "d.toml:4: eki.address"},
        Wrong{kMock + "[eki]\naddress = \"0.0.0.0\"\n",
              "the controller's address in its KLI network"},
        Wrong{kMock + "[eki]\naddress = \"robot\"\n", "d.toml:4: eki.address"},
        Wrong{kMock + "[eki]\nsilence_ms = 100\n[controller]\nstate_ms = 50\n",
              "d.toml:6: controller.state_ms: must be at most a quarter of silence_ms"},
        Wrong{kMock + "[controller]\npc_address = \"PC\"\n", "d.toml:4: controller.pc_address"},
        Wrong{kMock + "[controller]\ninput = 1025\n", "$IN[1025] is always TRUE"},
        Wrong{kMock + "[controller]\ninput = 1026\n", "controller.input"},
        Wrong{kMock + "[controller]\ncontact_level = \"low\"\n", "controller.contact_level"},
        Wrong{kMock + "[controller]\nfirst_interrupt = 80\n", "controller.first_interrupt"},
        Wrong{kMock + "[contact]\ndevice = \"ttyUSB0\"\n", "d.toml:4: contact.device"},
        Wrong{kMock + "[contact]\ndevice = \"\"\n", "absolute path"},
        Wrong{kMock + "[contact]\nisolation = \"switch\"\n", "d.toml:4: contact.isolation"},
        Wrong{kMock + "[schedule]\nunattended = true\nresponsible = \"a\"\n"
                      "[contact]\nisolation = \"plug\"\n",
              "plug X1 is put in by hand"},
        Wrong{kMock + "[contact]\ndevice = \"udp:board:4300\"\n",
              "d.toml:4: contact.device: \"udp:board:4300\" is not the address of a board"},
        Wrong{kMock + "[contact]\ndevice = \"/dev/a\\nb\"\n", "control characters"},
        Wrong{kMock + "socket = \"/" + std::string(200, 's') + "\"\n",
              "d.toml:3: socket: must have at most 107 characters, not 201"},
        Wrong{kMock + "state_dir = \"/a\\u001b[2J\"\n", "d.toml:3: state_dir"},
        Wrong{kMock + "[session]\nconnect_wait_s = 0\n",
              "d.toml:4: session.connect_wait_s: 0 is out of range, allowed are 1 to 3600"},
        Wrong{kMock + "[session]\nretries = -1\n", "d.toml:4: session.retries"},
        Wrong{kMock + "[session]\nretries = 101\n", "allowed are 0 to 100"},
        Wrong{kMock + "[session]\nbusy_repeats_touch = 101\n", "allowed are 0 to 100"},
        Wrong{kMock + "[session]\nbusy_repeats = -1\n", "d.toml:4: session.busy_repeats"},
        Wrong{kMock + "[session]\nbusy_wait_s = 1\n", "allowed are 3 to 3600"},
        Wrong{kMock + "[session]\nretry = 1\n", "session.retry"}, Wrong{kMock + "[[", "d.toml"}));

TEST(AConfiguration, OfTheSessionSaysHowLongItWaitsAndHowOftenItGoesOn) {
  const DaemonConfig usual = parse_config(kRsi, "d.toml");
  EXPECT_EQ(usual.timeouts.connecting, std::chrono::minutes(5));
  EXPECT_EQ(usual.retries, 0) << "nothing moves by itself unless the cell's owner says so";
  const DaemonConfig config =
      parse_config(kRsi + "[session]\nconnect_wait_s = 90\nretries = 3\n", "d.toml");
  EXPECT_EQ(config.timeouts.connecting, std::chrono::seconds(90));
  EXPECT_EQ(config.retries, 3);
  EXPECT_EQ(usual.repeats.of_session, 400) << "where this computer was late it goes on by itself";
  EXPECT_EQ(usual.timeouts.busy, std::chrono::seconds(60));
  const DaemonConfig never = parse_config(
      kRsi + "[session]\nbusy_repeats = 0\nbusy_repeats_touch = 4\nbusy_wait_s = 90\n", "d.toml");
  EXPECT_EQ(never.repeats.of_session, 0);
  EXPECT_EQ(never.repeats.of_touch, 4);
  EXPECT_EQ(never.timeouts.busy, std::chrono::seconds(90));
}

TEST(AConfiguration, MayHaveNoStopTagAndAnyAddressOfThisComputer) {
  const DaemonConfig config =
      parse_config(kRsi + "[rsi]\nbind = \"0.0.0.0\"\nstop_tag = \"\"\n", "d.toml");
  EXPECT_EQ(config.rsi.stop_tag, "");
  EXPECT_EQ(config.rsi.bind_address, "0.0.0.0");
}

const std::string kEki =
    "format = \"cellcal.daemon/1\"\nbackend = \"eki\"\n[contact]\ndevice = \"/dev/ttyUSB0\"\n";

TEST(AnEkiConfiguration, IsReadInItsUnitsAndReachesTheControllersFiles) {
  const DaemonConfig config =
      parse_config(kEki +
                       "[eki]\naddress = \"10.0.0.7\"\nport = 54601\nsilence_ms = 300\n"
                       "latch_delay_ms = -4\nlatch_jitter_ms = 3\nrealtime = false\n"
                       "[controller]\ninput = 17\ncontact_level = \"off\"\nload = 2\n",
                   "d.toml");
  EXPECT_EQ(config.backend, BackendKind::kEki);
  EXPECT_EQ(wire_of(config), WireKind::kEki);
  EXPECT_EQ(config.eki.stop, drivers::EkiStop::kInput);
  EXPECT_DOUBLE_EQ(config.eki.silence_s, 0.3);
  EXPECT_DOUBLE_EQ(config.eki.latch_delay_s, -0.004);
  EXPECT_DOUBLE_EQ(config.eki.latch_jitter_s, 0.003);
  EXPECT_FALSE(config.realtime);
  EXPECT_EQ(config.controller.address, "10.0.0.7");
  EXPECT_EQ(config.controller.port, 54601);
  EXPECT_EQ(config.controller.input, 17);
  EXPECT_FALSE(config.controller.contact_is_on);
  EXPECT_TRUE(parse_config(kEki, "d.toml").controller.contact_is_on);
  EXPECT_EQ(config.controller.load, 2);
  EXPECT_DOUBLE_EQ(config.touch.fast_m_s, 0.010);
}

TEST(AnEkiConfiguration, WithoutAContactInputSearchesSlowly) {
  const DaemonConfig config = parse_config(kEki + "[eki]\nstop = \"flag\"\n", "d.toml");
  EXPECT_DOUBLE_EQ(config.touch.fast_m_s, 0.0025);
  EXPECT_DOUBLE_EQ(config.touch.slow_m_s, 0.001);
}

calib::Cell cell_of_six_joints() {
  calib::Cell cell;
  cell.robot.name = "test";
  calib::Joint joint;
  joint.name = "A1";
  joint.min_rad = -1.0;
  joint.max_rad = 2.0;
  joint.max_speed_rad_s = 3.0;
  cell.robot.joints.assign(6, joint);
  return cell;
}

TEST(AxisLimits, AreTheRobotFilesAtTheConfiguredSpeed) {
  const DaemonConfig config = parse_config(kRsi + "[motion]\nspeed_percent = 10\n", "d.toml");
  const drivers::RsiConfig rsi = rsi_config_for(config, cell_of_six_joints());
  ASSERT_EQ(rsi.limits.size(), 6u);
  EXPECT_EQ(rsi.limits[0].min_rad, -1.0);
  EXPECT_EQ(rsi.limits[0].max_rad, 2.0);
  EXPECT_NEAR(rsi.limits[0].max_speed_rad_s, 0.3, 1e-12);
  EXPECT_EQ(rsi.full_speed_rad_s, std::vector<double>(6, 3.0));
  EXPECT_EQ(rsi.correction_limit_deg, std::vector<double>(6, 90.0));
}

TEST(AxisLimits, ThatTheRobotFileLacksAreAnErrorAndNotAGuess) {
  calib::Cell cell = cell_of_six_joints();
  cell.robot.joints[0].max_speed_rad_s = 0.0;
  EXPECT_THROW(rsi_config_for(parse_config(kRsi, "d.toml"), cell), drivers::ConfigError);
}

TEST(AxisLimits, OfAnArmWithoutSixTurningJointsAreRefusedOnEachWireAndForItsFiles) {
  for (const std::size_t joints : {5, 7}) {
    calib::Cell cell = cell_of_six_joints();
    cell.robot.joints.resize(joints, cell.robot.joints.front());
    const DaemonConfig rsi = parse_config(kRsi, "d.toml");
    EXPECT_THROW(rsi_config_for(rsi, cell), drivers::ConfigError) << joints;
    EXPECT_THROW(rsi_files_for(rsi, cell), drivers::ConfigError) << joints;
    const DaemonConfig eki = parse_config(kEki + "[controller]\nexternal_axes = 1\n", "d.toml");
    EXPECT_THROW(eki_config_for(eki, cell), drivers::ConfigError) << joints;
  }
}

calib::Cell cell_on_track() {
  calib::Cell cell = cell_of_six_joints();
  cell.robot.joints.insert(cell.robot.joints.begin(), cell.robot.joints.front());
  cell.robot.joints[0].guide.emplace();
  return cell;
}

TEST(AxisLimits, OfALinearUnitAreMetresOverRsiAndItsCorrectionItsWholeStroke) {
  calib::Cell cell = cell_on_track();
  cell.robot.joints[0].min_rad = -0.5;
  cell.robot.joints[0].max_rad = 2.5;
  const DaemonConfig config = parse_config(kRsi, "d.toml");
  const drivers::RsiConfig rsi = rsi_config_for(config, cell);
  EXPECT_TRUE(rsi.limits[0].linear);
  EXPECT_EQ(rsi.correction_limit_deg[0], 3001.0);
  EXPECT_EQ(rsi.correction_limit_deg[1], config.rsi.correction_limit_deg.at(0));
  const drivers::RsiFilesConfig files = rsi_files_for(config, cell);
  ASSERT_EQ(files.external.size(), 1u);
  EXPECT_TRUE(files.external[0].linear);
  EXPECT_EQ(files.external[0].low_deg, -500.0);
  EXPECT_EQ(drivers::travel_limit(files.external[0]), rsi.correction_limit_deg[0]);
  EXPECT_EQ(files.external_axes, 1) << "in the packets without a key of its own";
  EXPECT_EQ(files.ranges_deg.size(), 6u) << "of the arm";
  const DaemonConfig space = parse_config(kRsi + "[rsi]\ncorrection = \"space\"\n", "d.toml");
  EXPECT_THROW(rsi_config_for(space, cell), drivers::ConfigError);
}

TEST(AxisLimits, OfALinearUnitAreMetresOverEkiAndFurtherExternalAxesHaveNone) {
  const DaemonConfig two = parse_config(
      kEki + "[motion]\nspeed_percent = 10\n[controller]\nexternal_axes = 2\n", "d.toml");
  const drivers::EkiConfig eki = eki_config_for(two, cell_on_track());
  ASSERT_EQ(eki.limits.size(), 7u);
  EXPECT_EQ(eki.wire_axes(), 8u);
  EXPECT_TRUE(eki.limits[0].linear);
  EXPECT_FALSE(eki.limits[1].linear);
  EXPECT_NEAR(eki.limits[0].max_speed_rad_s, 0.3, 1e-12) << "m/s";
  EXPECT_THROW(eki_config_for(parse_config(kEki, "d.toml"), cell_on_track()), drivers::ConfigError)
      << "no E1 in the channel";
  calib::Cell unmoved = cell_on_track();
  unmoved.robot.joints[0].max_speed_rad_s = 0.0;
  try {
    eki_config_for(two, unmoved);
    ADD_FAILURE();
  } catch (const drivers::ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("max_speed_mm_s"), std::string::npos) << error.what();
  }
  calib::Cell six = cell_on_track();
  six.robot.joints.erase(six.robot.joints.begin());
  EXPECT_EQ(eki_config_for(two, six).wire_axes(), 8u) << "both external axes hold still";
}

/// E2 after a linear unit, from -1 to 1.5 rad.
calib::Cell cell_with_positioner() {
  calib::Cell cell = cell_on_track();
  calib::PositionerAxis axis;
  axis.name = "E2";
  axis.min_rad = -1.0;
  axis.max_rad = 1.5;
  cell.robot.positioner = {axis};
  return cell;
}

TEST(AxisLimits, OfAPositionerFollowTheArmsOverEki) {
  calib::Cell cell = cell_with_positioner();
  const DaemonConfig two = parse_config(
      kEki + "[motion]\nspeed_percent = 10\n[controller]\nexternal_axes = 2\n", "d.toml");
  const drivers::EkiConfig eki = eki_config_for(two, cell);
  ASSERT_EQ(eki.limits.size(), 8u);
  EXPECT_EQ(eki.limits[7].min_rad, -1.0);
  EXPECT_EQ(eki.limits[7].max_rad, 1.5);
  EXPECT_EQ(eki.transit_percent(), 10);
  EXPECT_NEAR(eki.limits[7].max_speed_rad_s / eki.full_speed_rad_s[7], 0.1, 1e-12);
  const DaemonConfig one = parse_config(kEki + "[controller]\nexternal_axes = 1\n", "d.toml");
  EXPECT_THROW(eki_config_for(one, cell), drivers::ConfigError) << "no E2 in the channel";
  cell.robot.positioner[0].name = "E1";
  EXPECT_THROW(eki_config_for(two, cell), drivers::ConfigError) << "E1 is the linear unit";
}

TEST(AxisLimits, OfAPositionerOverRsiAreItsOwnAndItsCorrectionItsWholeRange) {
  const calib::Cell cell = cell_with_positioner();
  const DaemonConfig config =
      parse_config(kRsi +
                       "[motion]\nspeed_percent = 50\npositioner_speed_deg_s = 8\n"
                       "positioner_acceleration_deg_s2 = 20\n"
                       "positioner_jerk_deg_s3 = 40\n",
                   "d.toml");
  const drivers::RsiConfig rsi = rsi_config_for(config, cell);
  ASSERT_EQ(rsi.limits.size(), 8u);
  EXPECT_NEAR(rsi.limits[7].max_speed_rad_s, 8 * drivers::kRadPerDeg, 1e-12);
  EXPECT_NEAR(rsi.limits[7].max_acceleration_rad_s2, 20 * drivers::kRadPerDeg, 1e-12);
  EXPECT_NEAR(rsi.limits[7].max_jerk_rad_s3, 40 * drivers::kRadPerDeg, 1e-12);
  EXPECT_NEAR(rsi.correction_limit_deg[7], 2.5 * drivers::kDegPerRad + 1.0, 1e-5);
  const drivers::RsiFilesConfig files = rsi_files_for(config, cell);
  ASSERT_EQ(files.external.size(), 2u);
  EXPECT_TRUE(files.external[0].linear);
  EXPECT_FALSE(files.external[1].linear);
  EXPECT_NEAR(files.external[1].high_deg, 1.5 * drivers::kDegPerRad, 1e-6);
  EXPECT_EQ(rsi.correction_limit_deg[7], drivers::travel_limit(files.external[1]));
  EXPECT_EQ(files.external_axes, 2);
}

TEST(AxisLimits, OfAPositionerOverRsiAreRefusedByNameWhereItCannotBeMoved) {
  const DaemonConfig config = parse_config(kRsi, "d.toml");
  calib::Cell cell = cell_with_positioner();
  cell.robot.positioner[0].name = "E3";
  EXPECT_THROW(rsi_config_for(config, cell), drivers::ConfigError) << "behind the unit it is E2";
  EXPECT_THROW(rsi_files_for(config, cell), drivers::ConfigError);
  cell = cell_with_positioner();
  cell.robot.joints.pop_back();
  EXPECT_THROW(rsi_config_for(config, cell), drivers::ConfigError) << "five axes on a unit";
  cell = cell_with_positioner();
  try {
    rsi_config_for(parse_config(kRsi + "[motion]\npositioner_speed_deg_s = 0.5\n", "d.toml"), cell);
    ADD_FAILURE();
  } catch (const drivers::ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("E2 turns through its range in 286 s"),
              std::string::npos)
        << error.what();
  }
  const DaemonConfig space = parse_config(kRsi + "[rsi]\ncorrection = \"space\"\n", "d.toml");
  EXPECT_THROW(rsi_config_for(space, cell_with_positioner()), drivers::ConfigError);
}

TEST(AxisLimits, OfAPositionerOverEkiArePositionerSpeedWhereItsOwnIsStated) {
  calib::Cell cell = cell_with_positioner();
  cell.robot.positioner[0].max_speed_rad_s = 90.0 * drivers::kRadPerDeg;
  const std::string head = kEki + "[controller]\nexternal_axes = 2\n[motion]\nspeed_percent = 40\n";
  const drivers::EkiConfig bounded =
      eki_config_for(parse_config(head + "positioner_speed_deg_s = 9\n", "d.toml"), cell);
  drivers::AxisAngles from(8, 0.1), moves = from, turns = from;
  moves[2] += 0.5;
  turns[7] += 0.5;
  EXPECT_EQ(bounded.transit_percent(from, moves), 40) << "it stands";
  EXPECT_EQ(bounded.transit_percent(from, turns), 10);
  const DaemonConfig fast = parse_config(head + "positioner_speed_deg_s = 80\n", "d.toml");
  EXPECT_EQ(eki_config_for(fast, cell).transit_percent(from, turns), 40);
  const DaemonConfig slow = parse_config(head + "positioner_speed_deg_s = 0.5\n", "d.toml");
  EXPECT_EQ(eki_config_for(slow, cell).transit_percent(from, turns), 1) << "the slowest PTP";
  const DaemonConfig rsi =
      parse_config(kRsi + "[motion]\npositioner_speed_deg_s = 180\n", "d.toml");
  EXPECT_NEAR(rsi_config_for(rsi, cell).limits[7].max_speed_rad_s, 90.0 * drivers::kRadPerDeg,
              1e-12);
}

TEST(ASlowedMotion, SlowsAPositionerByAsMuchAsTheArm) {
  const calib::Robot robot = cell_with_positioner().robot;  // through 143 deg
  MotionConfig motion;
  motion.speed_fraction = 0.4;
  motion.positioner_speed_rad_s = 20.0 * drivers::kRadPerDeg;
  const MotionConfig dry = slowed(motion, robot, 0.1);
  EXPECT_EQ(dry.speed_fraction, 0.1);
  EXPECT_NEAR(dry.positioner_speed_rad_s, 5.0 * drivers::kRadPerDeg, 1e-12);
  const MotionConfig as_it_is = slowed(motion, robot, 1.0);
  EXPECT_EQ(as_it_is.speed_fraction, 0.4);
  EXPECT_EQ(as_it_is.positioner_speed_rad_s, motion.positioner_speed_rad_s);
  motion.positioner_speed_rad_s = 2.0 * drivers::kRadPerDeg;
  EXPECT_NEAR(slowed(motion, robot, 0.1).positioner_speed_rad_s, 2.5 / 150.0, 1e-12)
      << "a session waits no longer for its whole range";
  motion.positioner_speed_rad_s = 0.5 * drivers::kRadPerDeg;
  EXPECT_EQ(slowed(motion, robot, 0.1).positioner_speed_rad_s, motion.positioner_speed_rad_s);
}

TEST(AxisLimits, OverEkiComeWithTheFullSpeedsAndForTheChannelsAxes) {
  const calib::Cell cell = cell_of_six_joints();
  const DaemonConfig config = parse_config(kEki + "[motion]\nspeed_percent = 10\n", "d.toml");
  const drivers::EkiConfig eki = eki_config_for(config, cell);
  EXPECT_EQ(eki.limits.size(), 6u);
  EXPECT_NEAR(eki.limits[0].max_speed_rad_s, 0.3, 1e-12);
  EXPECT_EQ(eki.full_speed_rad_s, std::vector<double>(6, 3.0));
  EXPECT_EQ(eki.transit_percent(), 10);
  const DaemonConfig one = parse_config(kEki + "[controller]\nexternal_axes = 1\n", "d.toml");
  EXPECT_EQ(eki_config_for(one, cell_on_track()).limits.size(), 7u);
}

TEST(AConfiguration, HasNoNetworkUnlessItSaysWhereToListen) {
  EXPECT_FALSE(parse_config(kMock, "d.toml").http);
  EXPECT_FALSE(parse_config(kMock + "[http]\n", "d.toml").http);
  const DaemonConfig config =
      parse_config(kMock + "[http]\nlisten = \"127.0.0.1:8080\"\n", "d.toml");
  ASSERT_TRUE(config.http);
  EXPECT_EQ(config.http->address, "127.0.0.1");
  EXPECT_EQ(config.http->port, 8080);
  EXPECT_FALSE(config.http->tls());
  EXPECT_EQ(parse_config(kMock + "[http]\nlisten = \"[::1]:1\"\n", "d.toml").http->address, "::1");
}

TEST(AConfiguration, RefusesToBeReachedFromTheNetworkWithoutTlsUnlessToldTo) {
  for (const char* listen : {"10.0.0.5:8080", "0.0.0.0:8080", "[::]:8080"}) {
    const std::string text = kMock + "[http]\nlisten = \"" + listen + "\"\n";
    EXPECT_NE(reason(text).find("allow_plain = true"), std::string::npos) << reason(text);
    EXPECT_EQ(reason(text + "allow_plain = true\n"), "accepted");
    EXPECT_EQ(reason(text + "tls_certificate = \"/c\"\ntls_key = \"/k\"\n"), "accepted");
  }
}

TEST(AConfiguration, NamesWhatIsWrongWithItsNetwork) {
  for (const char* listen :
       {"", "8080", ":8080", "localhost:8080", "127.0.0.1", "127.0.0.1:", "127.0.0.1:0",
        "127.0.0.1:65536", "127.0.0.1:80x", "127.0.0.1:-1", "::1:8080", "[127.0.0.1]:80", "[::1]",
        "224.0.0.1:80", "300.0.0.1:80"}) {
    const std::string words = reason(kMock + "[http]\nlisten = \"" + listen + "\"\n");
    EXPECT_NE(words.find("d.toml"), std::string::npos) << listen << ": " << words;
    EXPECT_NE(words.find("listen"), std::string::npos) << listen << ": " << words;
  }
  const std::string listen = kMock + "[http]\nlisten = \"127.0.0.1:8080\"\n";
  EXPECT_NE(reason(listen + "tls_key = \"/k\"\n").find("tls_certificate"), std::string::npos);
  EXPECT_NE(reason(listen + "tls_certificate = \"/c\"\n").find("tls_key"), std::string::npos);
  EXPECT_NE(reason(listen + "port = 1\n").find("port"), std::string::npos);
  EXPECT_NE(reason(listen + "host_names = [\"a b\"]\n").find("host_names"), std::string::npos);
  EXPECT_NE(reason(listen + "host_names = [\"a:80\"]\n").find("host_names"), std::string::npos);
  EXPECT_NE(reason(listen + "cell_folders = [\"cells\"]\n").find("cell_folders"),
            std::string::npos);
  EXPECT_NE(reason(kMock + "[http]\nallow_plain = true\n").find("listen"), std::string::npos);
}

TEST(ASecret, ThatEveryUserMayReadIsRefusedWithWhatToDo) {
  const std::filesystem::path file = ::testing::TempDir() + "secret-" + std::to_string(::getpid());
  std::ofstream(file) << "x\n";
  const auto words = [&](std::filesystem::perms mode) -> std::string {
    std::filesystem::permissions(file, mode);
    try {
      refuse_secret_of_all(file);
      return "";
    } catch (const std::exception& refused) {
      return refused.what();
    }
  };
  using std::filesystem::perms;
  EXPECT_EQ(words(perms::owner_read), "");
  EXPECT_EQ(words(perms::owner_read | perms::group_read), "");
  EXPECT_NE(words(perms::owner_read | perms::others_read).find("chmod o= " + file.string()),
            std::string::npos);
  EXPECT_NO_THROW(refuse_secret_of_all(""));
  EXPECT_NO_THROW(refuse_secret_of_all("/nonexistent/key"));
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace cellcal::daemon
