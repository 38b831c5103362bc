#include "sim/cell/early_contact.h"

#include <algorithm>

namespace cellcal::sim {

namespace {

/// No back-off goes so far from the surface, and every way to another touch does.
constexpr double kAwayM = 0.005;
/// Out of contact so far a new closing is drawn; more than the noise can reach.
constexpr double kOpenM = 0.0003;
constexpr double kLargestSigma = 2.5;
constexpr double kLeastChipM = 0.0003, kMostChipM = 0.001;
/// None of the draws of the arm.
constexpr std::uint64_t kOwnDraws = 104729;

}  // namespace

EarlyContact::EarlyContact(const ContactScatter& scatter, std::uint64_t seed)
    : scatter_(scatter), random_(seed + kOwnDraws) {
  noise_m_ = noise();
}

double EarlyContact::noise() {
  if (!(scatter_.noise_m > 0.0)) return 0.0;
  return scatter_.noise_m * std::clamp(random_.normal(), -kLargestSigma, kLargestSigma);
}

void EarlyContact::begin_visit() {
  chip_m_ = 0.0;
  if (!(scatter_.bad_share > 0.0) || random_.uniform() >= scatter_.bad_share) return;
  chip_m_ = random_.uniform(kLeastChipM, kMostChipM);
  falls_off_ = random_.uniform() < 0.5;
}

void EarlyContact::look(double gap_m, bool closed) {
  touched_ = touched_ || closed;
  if (touched_ && !closed && gap_m - chip_m_ > kOpenM) {
    touched_ = false;
    noise_m_ = noise();
    if (falls_off_) chip_m_ = 0.0;
  }
  const bool near = gap_m < kAwayM;
  if (near_ && !near) begin_visit();  // the next one's
  near_ = near;
}

}  // namespace cellcal::sim
