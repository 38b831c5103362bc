#include "calib/check/foresight.h"

#include <algorithm>
#include <cmath>

#include "calib/check/explain.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "calib/model/product.h"

namespace cellcal::calib {

namespace {

/// Temperature varies by a kelvin from shift to shift, which is not a change of the cell.
constexpr double kDailyGrowth = 12e-6;

/// Covariance of the unknowns; one that the touches need but the calibration lacks (the latch delay)
/// keeps its prior.
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

/// As in calib/estimate: correlation between touches of the model error that the calibration found.
/// `turning`: the first joint that turns.
double alike(const ForeseenContact& a, const ForeseenContact& b, const Touch& at_a,
             const Touch& at_b, std::size_t turning, double reach_rad) {
  const Eigen::Vector3d n_a = (a.tip_m - a.centre_m).normalized();
  const Eigen::Vector3d n_b = (b.tip_m - b.centre_m).normalized();
  if (!(reach_rad > 0.0)) return 0.0;
  double largest = 0.0, square = 0.0;
  std::vector<double> lever;
  for (std::size_t i = 0; i < at_a.joint_rad.size(); ++i) {
    const ForeseenContact::Axis& axis = a.axes[i];
    const bool slides = i < turning;  // a metre of travel moves all by a metre
    lever.push_back(slides ? 1.0 : axis.direction.cross(a.tip_m - axis.origin).norm());
    largest = std::max(largest, lever.back());
  }
  for (std::size_t i = 0; i < lever.size(); ++i)
    square += std::pow(lever[i] / largest * (at_a.joint_rad[i] - at_b.joint_rad[i]), 2);
  return n_a.dot(n_b) * std::exp(-std::sqrt(square) / reach_rad);
}

/// (94a): variance of a touch's own errors by the scatter of the earlier checks, over the foreseen one. A scatter that three
/// of four series have by chance is none.
double own_errors_excess(const Eigen::MatrixXd& passing_m2, const Eigen::MatrixXd& off_m) {
  constexpr double kUpperQuartile = 0.674;  // of the normal distribution
  const double dof = static_cast<double>((off_m.cols() - 1) * off_m.rows());
  if (!(dof > 0.0)) return 1.0;
  const Eigen::MatrixXd scatter = off_m.colwise() - off_m.rowwise().mean();
  const double h = 2.0 / (9.0 * dof);
  const double usual = dof * std::pow(1.0 - h + kUpperQuartile * std::sqrt(h), 3);
  return std::max(1.0, Cholesky(passing_m2).whitened(scatter).squaredNorm() / usual);
}

}  // namespace

std::vector<ForeseenContact> foreseen_contacts(const Calibration& c,
                                               const std::vector<Touch>& touches) {
  const KnownTouches at(c, touches);
  std::vector<ForeseenContact> contacts;
  for (std::size_t t = 0; t < touches.size(); ++t) contacts.push_back(at.contact(t));
  return contacts;
}

Foresight foresee(const Calibration& c, const std::vector<Touch>& touches) {
  if (c.covariance.size() == 0)
    throw IdentifyError(IdentifyError::Kind::kCalibration,
                        "the calibration states no covariance: nothing can be checked against it");
  const KnownTouches at(c, touches);
  Foresight foresight;
  const auto n = static_cast<Eigen::Index>(touches.size());
  Eigen::VectorXd by_growth(n);
  for (std::size_t t = 0; t < touches.size(); ++t) {
    const ForeseenContact contact = at.contact(t);
    by_growth[static_cast<Eigen::Index>(t)] =
        (contact.tip_m - contact.centre_m).normalized().dot(contact.by_growth_m);
    foresight.contacts.push_back(contact);
  }
  Eigen::MatrixXd& beside = foresight.model_error_m2;
  beside.setZero(n, n);
  foresight.passing_m2 = kDailyGrowth * kDailyGrowth * by_growth * by_growth.transpose();
  const double field = c.discrepancy.sigma_m * c.discrepancy.sigma_m;
  for (Eigen::Index a = 0; a < n; ++a) {
    const auto t = static_cast<std::size_t>(a);
    const double noise = std::pow(at.problem().own_sigma_m(t), 2);  // (93)
    foresight.passing_m2(a, a) += noise;
    beside(a, a) = std::pow(at.problem().sigma_m(t), 2) - noise + field;
    for (Eigen::Index b = 0; field > 0.0 && b < n; ++b)
      if (const auto o = static_cast<std::size_t>(b); a != b)
        beside(a, b) =
            field * alike(foresight.contacts[t], foresight.contacts[o], touches[t], touches[o],
                          c.cell.robot.first_turning(), c.discrepancy.reach_rad);
  }
  const KnownTouches::RowMajor j = at.rows(at.x());
  const Eigen::MatrixXd v =
      product(product(j, covariance_of(c, at.unknowns())), j.transpose()) + beside;
  foresight.lasting_m2 = 0.5 * (v + v.transpose());
  return foresight;
}

void refer_to(Foresight& foresight, const Eigen::MatrixXd& off_m) {
  if (off_m.cols() == 0) return;
  foresight.passing_m2 *= own_errors_excess(foresight.passing_m2, off_m);
  // (94): mean of the earlier checks, and its information on the lasting part
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
