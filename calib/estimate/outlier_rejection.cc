#include "calib/estimate/outlier_rejection.h"

#include <algorithm>
#include <cmath>

#include "calib/model/median.h"

namespace cellcal::calib {

namespace {

std::vector<Studentised> studentised(const Problem& problem, const Eigen::VectorXd& u,
                                     const std::vector<bool>& fit, const std::vector<bool>& use,
                                     const Posterior& posterior) {
  const std::size_t count = problem.touches().size();
  std::vector<Studentised> off(count);
  for (const auto& [touch, row] : posterior.linear.touch_row) {
    for (int k = row; k < row + problem.rows(touch); ++k) {
      constexpr double kLeast =
          1e-6;  // a touch that alone decides something says nothing of itself
      const double free = 1.0 - posterior.leverage[k];  // (20), used
      if (free > kLeast)
        off[touch].sigmas =
            std::max(off[touch].sigmas, std::abs(posterior.linear.residual[k]) / std::sqrt(free));
    }
  }
  std::vector<bool> others(count, false);
  for (std::size_t i = 0; i < count; ++i) others[i] = fit[i] && !use[i];
  const Linearisation outside = linearise(problem, u, others);
  // (20), left out
  const Eigen::VectorXd predicted = leverage_of(outside.jacobian, posterior.covariance_u);
  for (const auto& [touch, row] : outside.touch_row) {
    for (int k = row; k < row + problem.rows(touch); ++k) {
      off[touch].sigmas = std::max(off[touch].sigmas,
                                   std::abs(outside.residual[k]) / std::sqrt(1.0 + predicted[k]));
      off[touch].own = std::max(off[touch].own, predicted[k] / (1.0 + predicted[k]));  // (22)
    }
  }
  return off;
}

/// Sets e.gate.
std::vector<Studentised> judge(const Problem& problem, const IdentifyOptions& options,
                               const std::vector<bool>& fit, Estimate& e) {
  std::vector<Studentised> off = studentised(problem, e.u, fit, e.use, e.posterior);
  // Of a point or a tracker the worst of three counts, half of which are nearer than 1.26 only: their
  // gate is wider. Seated and held by hand, they have heavier tails (a gate of the touches' own width
  // made panda_1 of the real data worse).
  std::vector<double> scatter;
  for (std::size_t i = 0; i < off.size(); ++i)
    if (fit[i]) scatter.push_back(off[i].sigmas / kNormalMedian);
  // More scatter than stated widens the gate instead of throwing good touches away.
  e.gate = options.outlier_sigma * std::max(1.0, median(scatter));  // (21)
  return off;
}

}  // namespace

std::vector<bool> fit_touches(const Problem& problem) {
  std::vector<bool> fit(problem.touches().size());
  for (std::size_t i = 0; i < fit.size(); ++i) fit[i] = problem.touches()[i].set == TouchSet::kFit;
  return fit;
}

std::vector<bool> honest_touches(const Problem& problem, const IdentifyOptions& options,
                                 Estimate& e) {
  std::vector<bool> honest = fit_touches(problem);
  const std::vector<Studentised> off = judge(problem, options, honest, e);
  for (std::size_t i = 0; i < off.size(); ++i)
    if (off[i].sigmas > e.gate) honest[i] = false;
  return honest;
}

OutlierRejection::OutlierRejection(const Problem& problem, const IdentifyOptions& options)
    : options_(options),
      fit_(fit_touches(problem)),
      came_back_(fit_.size(), false),
      settled_(fit_.size(), false) {}

bool OutlierRejection::changed(const Problem& problem, Estimate& e, bool near) {
  if (!options_.reject_outliers) return false;
  constexpr double kInDoubt = 0.5;       // of the gate
  constexpr double kUndetermined = 0.9;  // of its place is its own
  const std::vector<Studentised> off = judge(problem, options_, fit_, e);
  const std::vector<std::size_t> first = first_undetermined(problem, e, off, kUndetermined);
  bool any = false;
  for (std::size_t i = 0; i < off.size(); ++i) {
    if (!fit_[i] || settled_[i]) continue;
    bool honest = off[i].sigmas <= e.gate;
    if (honest && !e.use[i]) {
      if (off[i].own > kUndetermined && first[static_cast<std::size_t>(problem.block_of(i))] != i)
        continue;
      if (near && came_back_[i]) {
        settled_[i] = true;
        honest = off[i].sigmas <= kInDoubt * e.gate;
      }
      came_back_[i] = came_back_[i] || near;
    }
    any |= honest != e.use[i];
    e.use[i] = honest;
  }
  return any;
}

std::vector<std::size_t> OutlierRejection::first_undetermined(const Problem& problem,
                                                              const Estimate& e,
                                                              const std::vector<Studentised>& off,
                                                              double own) const {
  std::vector<std::size_t> first(problem.blocks().size(), off.size());
  for (std::size_t i = 0; i < off.size(); ++i) {
    if (!fit_[i] || settled_[i] || e.use[i] || off[i].own <= own) continue;
    std::size_t& least = first[static_cast<std::size_t>(problem.block_of(i))];
    if (least == off.size() || off[i].sigmas < off[least].sigmas) least = i;
  }
  return first;
}

}  // namespace cellcal::calib
