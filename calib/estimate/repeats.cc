#include "calib/estimate/repeats.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/model/linear.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

/// Touches whose axis angles agree to within this are of one place: half a millimetre to a
/// millimetre at the tip. Repeated searches along one line stop this close together with noise of
/// up to 0.1 mm (0.01 deg, and five sigma between two); a smaller value would truncate the measured
/// distribution. Over this distance, arm errors of a milliradian change by a micrometre. A larger
/// value would include touches placed by hand, and a lateral step across a sphere whose centre is
/// still unknown would count as noise.
constexpr double kSamePostureRad = 0.05 * kRadPerDeg;
/// Degrees of freedom of the noise stated in the cell file: a figure from experience, accurate to
/// about a third.
constexpr double kStatedDegrees = 5.0;
constexpr double kEnoughDegrees = 3.0;
/// A touch further from its group's median than this many usual distances is a gross error. Its
/// group is left out, since in a pair the erroneous one is not identifiable.
constexpr double kGross = 6.0;

bool same_posture(const Touch& a, const Touch& b) {
  for (std::size_t k = 0; k < a.joint_rad.size(); ++k)
    if (std::abs(a.joint_rad[k] - b.joint_rad[k]) > kSamePostureRad) return false;
  for (std::size_t k = 0; k < a.positioner_rad.size(); ++k)
    if (std::abs(a.positioner_rad[k] - b.positioner_rad[k]) > kSamePostureRad) return false;
  return true;
}

bool same_place(const Touch& a, const Touch& b) {
  return a.target == b.target && a.tool == b.tool && a.load == b.load && same_posture(a, b);
}

/// True for touches of one mean (24a): they differ by noise of one size, not by what a latch delay may do at another speed.
bool same_but_for_noise(const Touch& a, const Touch& b, const Cell& cell) {
  constexpr double kOfNoise = 0.2;
  const double noise_m = a.sigma_m > 0.0 ? a.sigma_m : cell.touch_sigma_m;
  return a.sigma_m == b.sigma_m && same_place(a, b) &&
         std::abs(a.speed_m_s - b.speed_m_s) * cell.latch_delay_sigma_s <= kOfNoise * noise_m;
}

/// Groups of two or more touches, each around its first touch in order of the first axis.
template <class Alike>
std::vector<std::vector<std::size_t>> groups_of(std::span<const Touch> touches,
                                                const Alike& alike) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < touches.size(); ++i)
    if (touches[i].set == TouchSet::kFit && !touches[i].joint_rad.empty()) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return touches[a].joint_rad[0] < touches[b].joint_rad[0];
  });
  std::vector<std::vector<std::size_t>> groups;
  std::vector<bool> taken(touches.size(), false);
  for (std::size_t a = 0; a < order.size(); ++a) {
    if (taken[order[a]]) continue;
    const Touch& first = touches[order[a]];
    std::vector<std::size_t> group{order[a]};
    for (std::size_t b = a + 1; b < order.size(); ++b) {
      if (touches[order[b]].joint_rad[0] - first.joint_rad[0] > kSamePostureRad) break;
      if (taken[order[b]] || !alike(first, touches[order[b]])) continue;
      taken[order[b]] = true;
      group.push_back(order[b]);
    }
    if (group.size() > 1) groups.push_back(std::move(group));
  }
  return groups;
}

/// One row of the touches of a place.
struct Column {
  std::vector<double> residuals_m;
  bool states_sigma = false;
};

struct Scatter {
  double sum_m2 = 0.0, degrees_of_freedom = 0.0;
};

/// About the places' means, without those of a gross error.
Scatter scatter_of(const std::vector<Column>& columns) {
  std::vector<double> distances;
  for (const auto& [column, states_sigma] : columns) {
    const double middle =
        std::accumulate(column.begin(), column.end(), 0.0) / static_cast<double>(column.size());
    const double shrunk =
        std::sqrt(1.0 - 1.0 / static_cast<double>(column.size()));  // about their own mean
    for (const double r : column) distances.push_back(std::abs(r - middle) / shrunk);
  }
  Scatter scatter;
  if (distances.empty()) return scatter;
  const double usual = kMadToSigma * median(distances);
  for (const auto& [column, states_sigma] : columns) {
    const double middle = median(column);
    if (std::any_of(column.begin(), column.end(),
                    [&](double r) { return std::abs(r - middle) > kGross * usual; }))
      continue;
    const auto count = static_cast<double>(column.size());
    const double mean = std::accumulate(column.begin(), column.end(), 0.0) / count;
    for (const double r : column) scatter.sum_m2 += (r - mean) * (r - mean);
    scatter.degrees_of_freedom += count - 1.0;
  }
  return scatter;
}

}  // namespace

Repeats find_repeats(const Problem& problem) {
  const auto touches = problem.touches();
  Repeats result;
  result.times.assign(touches.size(), 1);
  result.first.resize(touches.size());
  std::iota(result.first.begin(), result.first.end(), std::size_t{0});
  for (const std::vector<std::size_t>& group : groups_of(touches, same_posture))
    for (const std::size_t i : group) result.times[i] = static_cast<int>(group.size());
  result.used_m = problem.cell().touch_sigma_m;
  const auto repeated = [&](const Touch& a, const Touch& b) {
    return same_but_for_noise(a, b, problem.cell());
  };
  // Residuals of a group by the nominal arm, one column per row of a touch.
  std::vector<Column> columns;
  const Eigen::VectorXd nominal = problem.to_si(Eigen::VectorXd::Zero(problem.size()));
  const Problem::At at = problem.at(nominal.data());
  for (const std::vector<std::size_t>& group : groups_of(touches, repeated)) {
    result.touches += static_cast<int>(group.size());
    for (const std::size_t i : group) result.first[i] = group.front();
    std::vector<std::size_t> measured;
    for (const std::size_t i : group)
      if (std::none_of(measured.begin(), measured.end(),
                       [&](std::size_t other) { return same_reading(touches[i], touches[other]); }))
        measured.push_back(i);
    if (measured.size() < 2) continue;
    const int rows = problem.place_rows(group.front());
    for (int k = 0; k < rows; ++k) columns.push_back({{}, touches[group.front()].sigma_m > 0.0});
    for (const std::size_t i : measured) {
      double r[Problem::kMostRows];
      problem.residual_m(i, at, r, nullptr, nullptr);
      for (int k = 0; k < rows; ++k)
        columns[columns.size() - static_cast<std::size_t>(rows - k)].residuals_m.push_back(r[k]);
    }
  }
  const Scatter all = scatter_of(columns);
  result.degrees_of_freedom = all.degrees_of_freedom;
  if (all.degrees_of_freedom == 0.0) return result;
  result.scatter_m = std::sqrt(all.sum_m2 / all.degrees_of_freedom);  // (23)
  std::erase_if(columns, &Column::states_sigma);
  const Scatter own = scatter_of(columns);
  if (own.degrees_of_freedom == 0.0) return result;
  result.used_degrees = own.degrees_of_freedom;
  const double scatter_m = std::sqrt(own.sum_m2 / own.degrees_of_freedom);
  const double stated = problem.cell().touch_sigma_m;
  result.used_m = own.degrees_of_freedom >= kEnoughDegrees && scatter_m < kNoFigureShare * stated
                      ? scatter_m
                      : std::sqrt((kStatedDegrees * stated * stated + own.sum_m2) /  // (23)
                                  (kStatedDegrees + own.degrees_of_freedom));
  return result;
}

Repeats weigh_repeats(Problem& problem) {
  Repeats repeats = find_repeats(problem);
  problem.set_repeats(repeats.times, repeats.first, repeats.used_m);
  return repeats;
}

MeanRows mean_rows(const Problem& problem, const Linearisation& at) {
  MeanRows of{at, std::vector<int>(problem.touches().size(), 1)};
  if (problem.field_m() > 0.0) return of;                  // rows of correlated touches
  std::vector<std::vector<int>> rows_at(of.times.size());  // per first touch of a place
  for (const auto& [touch, row] : at.touch_row)
    rows_at[problem.first_of_place(touch)].push_back(row);
  of.linear.touch_row.clear();
  int next = 0;
  for (const auto& [touch, row] : at.touch_row) {
    const std::vector<int>& rows = rows_at[problem.first_of_place(touch)];
    of.times[touch] = static_cast<int>(rows.size());
    if (row != rows.front()) continue;
    const int count = problem.rows(touch);
    auto r = of.linear.residual.segment(next, count);
    auto j = of.linear.jacobian.middleRows(next, count);
    r = at.residual.segment(row, count);
    j = at.jacobian.middleRows(row, count);
    if (rows.size() > 1) {  // (24a)
      for (auto other = rows.begin() + 1; other != rows.end(); ++other) {
        r += at.residual.segment(*other, count);
        j += at.jacobian.middleRows(*other, count);
      }
      const double to_noise = problem.sigma_m(touch) / problem.own_sigma_m(touch);
      for (const int each : rows)
        of.differences += std::pow(to_noise, 2) *
                          (at.residual.segment(each, count) - r / of.times[touch]).squaredNorm();
      r /= std::sqrt(of.times[touch]);
      j /= std::sqrt(of.times[touch]);
    }
    of.linear.touch_row.emplace_back(touch, next);
    next += count;
  }
  const Eigen::Index lengths = at.residual.size() - at.length_row;
  of.linear.length_row = next;
  of.linear.residual.conservativeResize(next + lengths);
  of.linear.residual.tail(lengths) = at.residual.tail(lengths);
  of.linear.jacobian.conservativeResize(next + lengths, Eigen::NoChange);
  of.linear.jacobian.bottomRows(lengths) = at.jacobian.bottomRows(lengths);
  return of;
}

std::vector<Touch> of_one_tool_per_posture(const std::vector<Touch>& touches) {
  std::vector<bool> leave(touches.size(), false);
  for (const std::vector<std::size_t>& group : groups_of(touches, same_posture))
    for (const std::size_t i : group) leave[i] = !same_place(touches[group.front()], touches[i]);
  std::vector<Touch> some;
  for (std::size_t i = 0; i < touches.size(); ++i)
    if (!leave[i]) some.push_back(touches[i]);
  return some;
}

bool repeats_another(std::span<const Touch> touches) {
  return touches.back().set == TouchSet::kFit &&
         std::any_of(touches.begin(), touches.end() - 1, [&](const Touch& other) {
           return other.set == TouchSet::kFit && same_posture(other, touches.back());
         });
}

}  // namespace cellcal::calib
