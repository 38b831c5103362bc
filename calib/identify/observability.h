#pragma once
// How well the touches see what they are to determine, in the figures of the literature. They
// compare sets of touches; how far the result may be trusted is said in millimetres elsewhere.

#include <Eigen/Core>

namespace cellcal::calib {

/// Of the singular values s_1 >= ... >= s_m of the derivatives of all touches and lengths, each in
/// its own sigma, by the unknowns, each in its prior sigma; frame directions left out. So s = 1: the
/// touches say as much of a direction as the tolerances do.
struct Observability {
  int directions = 0;      ///< m
  double o1 = 0.0;         ///< (s_1 ... s_m)^(1/m) / sqrt(touches); Borm and Menq 1991
  double o2 = 0.0;         ///< s_m / s_1; Driels and Pathre 1990
  double o3 = 0.0;         ///< s_m; Nahvi, Hollerbach and Hayward 1994
  double o4 = 0.0;         ///< s_m^2 / s_1; Nahvi and Hollerbach 1996
  double o5 = 0.0;         ///< 1 / sum 1/s_k; Sun and Hollerbach 2008
  double condition = 0.0;  ///< s_1 / s_m, scaled by the tolerances; 0 where a direction is not seen
};

/// `singular_values` descending, `frame` of them belong to the frame directions (the last ones).
Observability observability(const Eigen::VectorXd& singular_values, int frame, int touches);

}  // namespace cellcal::calib
