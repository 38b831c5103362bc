// The touch circuit's supply, and the capacitor from the gun to earth.

#include <gtest/gtest.h>

#include <cmath>

#include "sim/mcu/microcontroller.h"

namespace cellcal::sim {
namespace {

constexpr double kUnoMostV = 6.0, kRp2040MostV = 3.63;  // absolute maximum ratings
/// 24 V on wire S by mistake, until its fuse has blown: at the clamp, at a few amperes.
constexpr double kUnoClampV = 17.0, kEthernetClampV = 11.0, kFuseS = 0.02;

/// The board's supply rail while external current flows into it: a supply cannot sink current, so that any
/// excess over the board's load charges the rail's capacitors, up to the clamp.
struct Rail {
  double supply_v = 5.0, supply_ohm = 0.3;
  double load_a = 0.045;  ///< of the board; 0: hung
  double farad = 120e-6;  ///< of the board's capacitors
  /// Threshold and slope resistance of Z1; very high: none.
  double clamp_v = 1e3, clamp_ohm = 1.0;
  double diode_v = 0.4;  ///< D3

  /// Highest voltage within `seconds` of `from_v` at the sense wire's clamp, through R6 and D3.
  double highest_v(double from_v, double surge_ohm, double seconds) const {
    constexpr double kStepS = 1e-6;
    double rail_v = supply_v, highest = supply_v;
    for (double t = 0.0; t < seconds; t += kStepS) {
      const double in_a = std::max(0.0, from_v - diode_v - rail_v) / surge_ohm +
                          std::max(0.0, supply_v - rail_v) / supply_ohm;
      const double out_a = load_a + std::max(0.0, rail_v - clamp_v) / clamp_ohm;
      rail_v += (in_a - out_a) * kStepS / farad;
      highest = std::max(highest, rail_v);
    }
    return highest;
  }
};

TEST(TouchSupply, IsLiftedByASlipOf24VoltsWithinAMillisecondWhereNothingClampsIt) {
  const Rail bare;
  EXPECT_LT(bare.highest_v(kUnoClampV, kUno.surge_ohm, 0.3e-3), kUnoMostV);
  EXPECT_GT(bare.highest_v(kUnoClampV, kUno.surge_ohm, 0.7e-3), kUnoMostV);
}

TEST(TouchSupply, IsHeldByAZenerOf5V1AtTheUpperEndOfItsTolerance) {
  Rail rail;
  rail.clamp_v = 5.1 * 1.05;
  rail.clamp_ohm = 1.5;
  for (const double load_a : {0.0, rail.load_a}) {
    rail.load_a = load_a;
    EXPECT_LT(rail.highest_v(kUnoClampV, kUno.surge_ohm, kFuseS), kUnoMostV) << load_a;
  }
}

TEST(TouchSupply, IsNotHeldByASuppressorOf5VoltsWhichBeginsAt6V4) {
  Rail rail;
  rail.clamp_v = 6.4;
  rail.clamp_ohm = 0.3;
  EXPECT_GT(rail.highest_v(kUnoClampV, kUno.surge_ohm, kFuseS), kUnoMostV);
}

TEST(TouchSupply, OfTheEthernetBoardUsesMoreThanASlipFeeds) {
  Rail rail{.supply_v = 3.3, .load_a = 0.1, .farad = 100e-6};
  EXPECT_LT(rail.highest_v(kEthernetClampV, kEthernetBoard.surge_ohm, kFuseS), kRp2040MostV);
  rail.load_a = 0.0;  // raised while the board is without supply
  EXPECT_GT(rail.highest_v(kEthernetClampV, kEthernetBoard.surge_ohm, kFuseS), kRp2040MostV);
}

TEST(CapacitorOfGun, IsChargedThroughR1AlongAnExponential) {
  TouchCircuit c;
  c.gun_farad = 1e-6;
  const double rest_v = c.gun_at_rest_v();
  EXPECT_NEAR(rest_v, c.voltages().feed_v, 0.05);
  // 1 k of R1 and 5 ohms of wire, in parallel with the pull-down.
  const double tau_s = 1e-6 / (1.0 / 1005.1 + 1.0 / (47e3 + 522.0));
  for (const double t : {0.0, 0.2e-3, 1e-3, 5e-3}) {
    EXPECT_NEAR(c.gun_after_v(0.0, t), rest_v * (1.0 - std::exp(-t / tau_s)), 0.01) << t;
  }
  EXPECT_NEAR(c.voltages(rest_v).sense_v, c.voltages().sense_v, 1e-3);
  EXPECT_LT(c.voltages(0.0).sense_v, 0.1);
}

}  // namespace
}  // namespace cellcal::sim
