#include "calib/check/foresight.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/estimate/problem.h"
#include "calib/linear/cholesky.h"
#include "calib/model/error.h"
#include "calib/result/level.h"

namespace cellcal::calib {

namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Ripple counts twice where no touch of the calibration was, as in its bounds (calib/uncertainty, (37)).
constexpr double kRippleElsewhere = 2.0;
/// A cell's temperature is another by a kelvin from shift to shift, and nobody calls that a change.
constexpr double kUsualGrowth = 12e-6;

/// The arm with every error that a calibration may have found.
Cell levelled(const Calibration& c) { return at_level(c.cell, {1.0, 1.0, 0.0, c.level.play}); }

std::vector<Touch> all_fit(std::vector<Touch> touches) {
  for (Touch& touch : touches) touch.set = TouchSet::kFit;
  return touches;
}

std::vector<TargetPlace> places_of(const Calibration& c, const std::vector<Touch>& touches) {
  std::vector<TargetPlace> places(c.cell.targets.size());
  for (const Touch& touch : touches) {
    const std::size_t t = c.cell.target_index(touch.target);
    const auto known = std::find_if(c.targets.begin(), c.targets.end(),
                                    [&](const TargetResult& r) { return r.id == touch.target; });
    if (c.cell.targets[t].kind != TargetKind::kSphere)
      throw IdentifyError(fmt::format("target {}: a check touches spheres only", touch.target));
    if (known == c.targets.end())
      throw IdentifyError(
          fmt::format("target {}: the calibration has no place of it. Check against one whose "
                      "session touched it",
                      touch.target));
    places[t] = TargetPlace(known->centre_m);
  }
  return places;
}

/// The estimator's own equations of these touches, at the calibration's values.
class At {
 public:
  At(const Calibration& c, const std::vector<Touch>& touches)
      : touches_(all_fit(touches)),
        cell_(levelled(c)),
        arm_(cell_),
        problem_(cell_, arm_, touches_, places_of(c, touches_)),
        x_(problem_.size()) {
    if (c.repeats.used_m > 0.0)
      problem_.set_repeats(std::vector<int>(touches_.size(), 1), c.repeats.used_m);
    problem_.set_ripple(std::sqrt(kRippleElsewhere) * c.level.ripple_rad);
    for (int i = 0; i < problem_.size(); ++i) {
      const Unknown& unknown = unknowns()[static_cast<std::size_t>(i)];
      const ParameterResult* found = find(c, unknown.key);
      x_[i] = found != nullptr ? found->nominal + found->correction : unknown.nominal;
    }
  }

  const std::vector<Unknown>& unknowns() const { return problem_.unknowns(); }
  const Problem& problem() const { return problem_; }
  const std::vector<Touch>& touches() const { return touches_; }
  Problem::At at() const { return problem_.at(x_.data()); }

  /// Derivatives of all residuals by all unknowns, SI.
  RowMajor rows() const {
    const Problem::At here = at();
    RowMajor j = RowMajor::Zero(static_cast<Eigen::Index>(touches_.size()), problem_.size());
    Eigen::RowVectorXd by_shared(problem_.shared_size());
    Eigen::Matrix<double, 1, TargetBlock::kMost> by_target;
    for (std::size_t t = 0; t < touches_.size(); ++t) {
      const TargetBlock& block = problem_.blocks()[static_cast<std::size_t>(problem_.block_of(t))];
      double residual = 0.0;
      problem_.residual_m(t, here, &residual, by_shared.data(), by_target.data());
      const auto row = static_cast<Eigen::Index>(t);
      j.row(row).head(problem_.shared_size()) = by_shared;
      j.row(row).segment(block.first, block.size()) = by_target.head(block.size());
    }
    return j;
  }

  ForeseenContact contact(std::size_t t) const {
    const Problem::At here = at();
    ForeseenContact contact;
    Eigen::Vector3d direction;
    double residual = 0.0;
    problem_.residual_m(t, here, &residual, nullptr, nullptr, &direction);
    ArmChain chain;
    arm_.walk(problem_.pose(t), here.arm, chain);
    contact.target = touches_[t].target;
    contact.tip_m = chain.tip;
    contact.flange = chain.flange;
    contact.by_growth_m = chain.flange_origin - cell_.robot.base_fixed.translation();
    for (std::size_t i = 0; i < cell_.robot.joints.size(); ++i)
      contact.axes.push_back(
          {cell_.robot.joints[i].sign * chain.link[i].z, chain.link[i].z_origin});
    const TargetBlock& block = problem_.blocks()[static_cast<std::size_t>(problem_.block_of(t))];
    contact.centre_m = Eigen::Map<const Eigen::Vector3d>(here.x + block.first);
    contact.radius_m = (contact.tip_m - contact.centre_m).norm() - residual;
    return contact;
  }

 private:
  std::vector<Touch> touches_;
  Cell cell_;
  ArmModel arm_;
  Problem problem_;
  Eigen::VectorXd x_;
};

/// Of the unknowns; what the calibration does not have but the touches ask for (the latch's delay) keeps
/// its prior.
Eigen::MatrixXd covariance_of(const Calibration& c, const std::vector<Unknown>& unknowns) {
  const auto n = static_cast<Eigen::Index>(unknowns.size());
  std::vector<Eigen::Index> place(unknowns.size(), -1);
  for (std::size_t i = 0; i < unknowns.size(); ++i)
    for (std::size_t k = 0; k < c.parameters.size(); ++k)
      if (c.parameters[k].key == unknowns[i].key) place[i] = static_cast<Eigen::Index>(k);
  Eigen::MatrixXd s = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index from = place[static_cast<std::size_t>(i)];
    const Unknown& unknown = unknowns[static_cast<std::size_t>(i)];
    if (from < 0 && unknown.key.kind == ParameterKind::kLatchDelay)
      s(i, i) = unknown.scale * unknown.scale;
    for (Eigen::Index k = 0; from >= 0 && k < n; ++k)
      if (const Eigen::Index to = place[static_cast<std::size_t>(k)]; to >= 0)
        s(i, k) = c.covariance(from, to);
  }
  return s;
}

/// As calib/estimate has it: where the calibration found an error that no model level has; how it is shared by touches.
double alike(const ForeseenContact& a, const ForeseenContact& b, const Touch& at_a,
             const Touch& at_b, double reach_rad) {
  const Eigen::Vector3d n_a = (a.tip_m - a.centre_m).normalized();
  const Eigen::Vector3d n_b = (b.tip_m - b.centre_m).normalized();
  if (!(reach_rad > 0.0)) return 0.0;
  double largest = 0.0, square = 0.0;
  std::vector<double> lever;
  for (const ForeseenContact::Axis& axis : a.axes) {
    lever.push_back(axis.direction.cross(a.tip_m - axis.origin).norm());
    largest = std::max(largest, lever.back());
  }
  for (std::size_t i = 0; i < lever.size(); ++i)
    square += std::pow(lever[i] / largest * (at_a.joint_rad[i] - at_b.joint_rad[i]), 2);
  return n_a.dot(n_b) * std::exp(-std::sqrt(square) / reach_rad);
}

}  // namespace

std::vector<ForeseenContact> foreseen_contacts(const Calibration& c,
                                               const std::vector<Touch>& touches) {
  const At at(c, touches);
  std::vector<ForeseenContact> contacts;
  for (std::size_t t = 0; t < touches.size(); ++t) contacts.push_back(at.contact(t));
  return contacts;
}

Foresight foresee(const Calibration& c, const std::vector<Touch>& touches) {
  if (c.covariance.size() == 0)
    throw IdentifyError("the calibration states no covariance: nothing can be checked against it");
  const At at(c, touches);
  Foresight foresight;
  const auto n = static_cast<Eigen::Index>(touches.size());
  Eigen::VectorXd by_growth(n);
  for (std::size_t t = 0; t < touches.size(); ++t) {
    const ForeseenContact contact = at.contact(t);
    by_growth[static_cast<Eigen::Index>(t)] =
        (contact.tip_m - contact.centre_m).normalized().dot(contact.by_growth_m);
    foresight.contacts.push_back(contact);
  }
  const RowMajor j = at.rows();
  Eigen::MatrixXd& v = foresight.lasting_m2;
  v = j * covariance_of(c, at.unknowns()) * j.transpose();
  foresight.passing_m2 = kUsualGrowth * kUsualGrowth * by_growth * by_growth.transpose();
  const double field = c.discrepancy.sigma_m * c.discrepancy.sigma_m;
  for (Eigen::Index a = 0; a < n; ++a) {
    const auto t = static_cast<std::size_t>(a);
    const double noise = std::pow(at.problem().own_sigma_m(t), 2);
    foresight.passing_m2(a, a) += noise;
    v(a, a) += std::pow(at.problem().sigma_m(t), 2) - noise + field;
    for (Eigen::Index b = 0; field > 0.0 && b < n; ++b)
      if (const auto o = static_cast<std::size_t>(b); a != b)
        v(a, b) += field * alike(foresight.contacts[t], foresight.contacts[o], touches[t],
                                 touches[o], c.discrepancy.reach_rad);
  }
  v = (0.5 * (v + v.transpose())).eval();
  return foresight;
}

void refer_to(Foresight& foresight, const Eigen::MatrixXd& off_m) {
  if (off_m.cols() == 0) return;
  // Of the mean of the earlier ones, and what it says of what lasts.
  const Eigen::MatrixXd lasting = foresight.lasting_m2;
  const Cholesky mean(lasting + foresight.passing_m2 / static_cast<double>(off_m.cols()));
  const Eigen::VectorXd foreseen = lasting * mean.solve(Eigen::VectorXd(off_m.rowwise().mean()));
  for (std::size_t t = 0; t < foresight.contacts.size(); ++t)
    foresight.contacts[t].offset_m = foreseen[static_cast<Eigen::Index>(t)];
  const Eigen::MatrixXd known = mean.whitened(lasting);
  foresight.lasting_m2 = lasting - known.transpose() * known;
}

Eigen::VectorXd residuals_m(const std::vector<ForeseenContact>& contacts) {
  Eigen::VectorXd off(static_cast<Eigen::Index>(contacts.size()));
  for (std::size_t t = 0; t < contacts.size(); ++t)
    off[static_cast<Eigen::Index>(t)] = (contacts[t].tip_m - contacts[t].centre_m).norm() -
                                        contacts[t].radius_m - contacts[t].offset_m;
  return off;
}

}  // namespace cellcal::calib
