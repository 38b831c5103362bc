#include "calib/estimate/play.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calib/estimate/evidence.h"
#include "calib/model/error.h"
#include "calib/model/probability.h"

namespace cellcal::calib {

namespace {

/// Where the estimate without play stands among the unknowns of one with it.
Eigen::VectorXd without_play(const Problem& played, const Eigen::VectorXd& plain_u) {
  Eigen::VectorXd u = Eigen::VectorXd::Zero(played.size());
  Eigen::Index from = 0;
  for (int i = 0; i < played.size(); ++i) {
    const bool is_play =
        i < played.arm_size() && played.arm().parameters()[i].kind == ParameterKind::kPlay;
    if (!is_play) u[i] = plain_u[from++];
  }
  return u;
}

double log_evidence_of(const std::vector<LevelEvidence>& levels) {
  std::vector<double> logs;
  for (const LevelEvidence& l : levels) logs.push_back(l.log_evidence);
  return log_sum(logs);
}

}  // namespace

bool estimate_with_play(const Problem& plain, Problem& played, const IdentifyOptions& options,
                        Estimate& e) {
  if (played.size() == plain.size()) return false;
  Estimate with;
  with.u = without_play(played, e.u);
  with.use = e.use;
  with.gate = e.gate;
  played.set_ripple(e.levels.ripple_rad);
  linearise(played, with.u, with.use, with.posterior.linear);
  std::vector<ModelLevel> levels = usual_levels(true), only_play = levels;
  std::erase_if(only_play, [](const ModelLevel& level) { return level.play == 0.0; });
  std::vector<LevelEvidence> likewise = e.levels.levels;  // but for the play
  std::erase_if(likewise, [&](const LevelEvidence& l) {
    return l.level.compliance != only_play.front().compliance;
  });
  try {
    const double with_play =
        log_evidence_of(mean_over_levels(played, with.u, with.posterior.linear, only_play).levels);
    const PlayBeforehand beforehand = play_beforehand();
    constexpr double kNotByChance = 1.0;  // joints that no torque turns leave the odds as they were
    const bool speaks_for_it =            // (27a)
        with_play - log_evidence_of(likewise) >
        std::log(beforehand.odds_at_its_compliance) + kNotByChance;
    const bool has_a_say =
        with_play - log_evidence_of(e.levels.levels) > std::log(beforehand.odds);  // (27b)
    if (!speaks_for_it || !has_a_say) return false;
    refine(played, options, std::move(levels), with);
  } catch (const IdentifyError&) {
    return false;  // no such arm: something else is wrong, and it is asked for elsewhere
  }
  e = std::move(with);
  return true;
}

}  // namespace cellcal::calib
