#pragma once
// What touches from one of a session on say of a change in front of it: of a target's place, a
// joint's zero or the tool's tip. The score test: from a linearisation, without solving anew.

#include <Eigen/Core>

#include "calib/linear/cholesky.h"

namespace cellcal::calib {

/// Sums over whitened rows, added from a session's last touch back, so that what the later ones say
/// is summed up once: with J_d the columns of the change, J those of all unknowns, r the residuals.
template <int Columns = Eigen::Dynamic>
struct ChangeScore {
  using Square = Eigen::Matrix<double, Columns, Columns>;
  using Vector = Eigen::Matrix<double, Columns, 1>;
  using ByAll = Eigen::Matrix<double, Eigen::Dynamic, Columns>;

  explicit ChangeScore(Eigen::Index unknowns, Eigen::Index columns = Columns)
      : square(Square::Zero(columns, columns)),
        by_all(ByAll::Zero(unknowns, columns)),
        gradient(Vector::Zero(columns)) {}

  /// Some rows of J_d, J and r; one row's r may be a number. Several at once are summed among
  /// themselves first, which rounds otherwise than one after the other.
  void add(const auto& by_change, const auto& by_unknowns, const auto& residual,
           double weight = 1.0) {
    square.noalias() += (weight * by_change).transpose() * by_change;
    by_all.noalias() += (weight * by_unknowns).transpose() * by_change;
    gradient.noalias() += by_change.transpose() * (weight * residual);
  }

  Square square;    ///< J_d'J_d
  ByAll by_all;     ///< J'J_d
  Vector gradient;  ///< J_d'r
};

/// By how many squared sigmas a change improves the fit: with its information, all other unknowns
/// left free, its gradient, and what is looked for, 1 sigma. 0 where the information is none.
template <int Columns>
double squared_sigmas(Eigen::Matrix<double, Columns, Columns> information,
                      const Eigen::Matrix<double, Columns, 1>& gradient, double usual) {
  information.diagonal().array() += 1.0 / (usual * usual);
  return inverse_square(information, gradient);  // (50)
}

}  // namespace cellcal::calib
