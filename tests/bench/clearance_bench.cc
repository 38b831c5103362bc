// Time of the collision check of a posture and a move, compared with the check of the first planner
// (spheres and their posts only). Prints microseconds per call; no threshold.

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <chrono>

#include "calib/files/files.h"
#include "calib/model/linear.h"
#include "calib/plan/candidates.h"
#include "calib/plan/clearance.h"
#include "calib/plan/plan.h"
#include "tests/bench/capsule_check.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal::calib;  // NOLINT: a benchmark's own file

constexpr int kBatches = 21;  // their median is reported

template <typename Work>
double microseconds(int calls, const Work& work) {
  std::vector<double> us;
  volatile int sink = 0;  // unused results would be optimised away
  for (int batch = 0; batch < kBatches; ++batch) {
    const auto start = std::chrono::steady_clock::now();
    int sum = 0;
    for (int i = 0; i < calls; ++i) sum += work(static_cast<std::size_t>(i));
    sink = sink + sum;
    us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start)
                     .count() /
                 calls);
  }
  std::nth_element(us.begin(), us.begin() + kBatches / 2, us.end());
  return us[kBatches / 2];
}

using Move = std::pair<JointVector, JointVector>;

template <typename Check>
void measure(const char* name, const Check& check, const std::vector<JointVector>& postures,
             const std::vector<Move>& planned, const std::vector<Move>& random, int calls) {
  const auto share = [](const auto& list, const auto& is_clear) {
    return 100.0 * static_cast<double>(std::count_if(list.begin(), list.end(), is_clear)) /
           static_cast<double>(list.size());
  };
  const auto posture = [&](const JointVector& q) { return check.clear(q); };
  const auto move = [&](const Move& m) { return check.clear(m.first, m.second); };
  const auto timed = [&](const auto& list, const auto& is_clear, int count) {
    return microseconds(count, [&](std::size_t i) { return is_clear(list[i % list.size()]); });
  };
  fmt::print("{:30s} {:9.2f} {:6.0f} {:12.1f} {:6.0f} {:12.1f} {:6.0f}\n", name,
             timed(postures, posture, calls), share(postures, posture),
             timed(planned, move, calls / 20), share(planned, move),
             timed(random, move, calls / 20), share(random, move));
}

std::vector<Move> moves_of(const Plan& plan) {
  std::vector<Move> moves;
  JointVector at = plan.start;
  for (const PlannedTouch& touch : plan.touches) {
    for (const JointVector& next : touch.transit) {
      moves.emplace_back(at, next);
      at = next;
    }
    at = touch.clear;
  }
  return moves;
}

Obstacle obstacle(ObstacleShape shape, const char* id, const Eigen::Vector3d& at) {
  Obstacle o;
  o.id = id;
  o.shape = shape;
  o.frame.translation() = at;
  return o;
}

/// A table under the spheres, a cabinet next to them, a post, the floor, and a tube as a mesh.
Cell furnished(Cell cell) {
  cell.floor_m = -0.3;
  cell.obstacles.push_back(obstacle(ObstacleShape::kBox, "table", {1.0, 0.0, -0.1}));
  cell.obstacles.back().size_m = {0.8, 1.2, 0.05};
  cell.obstacles.push_back(obstacle(ObstacleShape::kBox, "cabinet", {-0.9, 1.0, 0.7}));
  cell.obstacles.back().size_m = {0.6, 0.6, 2.0};
  cell.obstacles.push_back(obstacle(ObstacleShape::kCylinder, "post", {-0.7, -0.7, 0.7}));
  cell.obstacles.back().diameter_m = 0.1;
  cell.obstacles.back().height_m = 2.0;
  cell.obstacles.push_back(obstacle(ObstacleShape::kMesh, "tube", {1.75, 0.0, 0.4}));
  constexpr int kAround = 100, kRings = 10;
  auto mesh = std::make_shared<Mesh>();
  for (int ring = 0; ring <= kRings; ++ring)
    for (int k = 0; k < kAround; ++k) {
      const double angle = 2.0 * EIGEN_PI * k / kAround;
      mesh->vertices_m.emplace_back(0.15 * std::cos(angle), 0.15 * std::sin(angle),
                                    0.1 * ring - 0.5);
      const int next = (k + 1) % kAround, low = ring * kAround, high = low + kAround;
      if (ring == kRings) continue;
      mesh->triangles.push_back({low + k, low + next, high + k});
      mesh->triangles.push_back({low + next, high + next, high + k});
    }
  cell.obstacles.back().mesh = mesh;
  return cell;
}

/// Cost of a mesh of many triangles for its first Clearance, and for the next one.
void measure_mesh(const Cell& cell, const ArmModel& arm) {
  constexpr int kAcross = 500;  // squares of a wavy sheet, two triangles each
  auto sheet = std::make_shared<Mesh>();
  for (int i = 0; i <= kAcross; ++i)
    for (int k = 0; k <= kAcross; ++k)
      sheet->vertices_m.emplace_back(5.0 + 1e-3 * i, 1e-3 * k, 0.05 * std::sin(0.1 * i + 0.07 * k));
  for (int i = 0; i < kAcross; ++i)
    for (int k = 0; k < kAcross; ++k) {
      const int at = i * (kAcross + 1) + k, next = at + kAcross + 1;
      sheet->triangles.push_back({at, next, at + 1});
      sheet->triangles.push_back({at + 1, next, next + 1});
    }
  Cell with = cell;
  with.obstacles.push_back(obstacle(ObstacleShape::kMesh, "sheet", {0.0, 0.0, 0.0}));
  with.obstacles.back().mesh = sheet;
  std::vector<Clearance> kept;
  for (const char* who : {"first", "next"}) {
    const auto bytes = ::mallinfo2();
    const auto start = std::chrono::steady_clock::now();
    kept.emplace_back(with, arm);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    const auto now = ::mallinfo2();
    fmt::print("mesh of {} triangles, {} look: {:.3f} s, {:.2f} kB per triangle\n",
               sheet->triangles.size(), who, took.count(),
               1e-3 *
                   static_cast<double>(now.uordblks + now.hblkhd - bytes.uordblks - bytes.hblkhd) /
                   static_cast<double>(sheet->triangles.size()));
  }
}

}  // namespace

int main(int argc, char** argv) {
  cellcal::CommandLine app{
      "Times the check that postures and moves hit nothing, microseconds per call."};
  int calls = 2000;
  app.option("--calls", calls, "Calls per batch").between(100, 100000000);
  if (const auto code = app.parse(argc, argv)) return *code;
  const Cell cell = load_cell(CELLCAL_DEMO_CELL), full = furnished(cell);
  const ArmModel arm(cell.robot, cell.tool);
  PlanOptions options;
  options.fit_touches = 40;
  const std::vector<Move> planned = moves_of(make_plan(cell, options));
  Random random(1);
  std::vector<JointVector> postures;
  std::vector<Move> drawn;
  for (int k = 0; k < 500; ++k) {
    JointVector q;
    for (const Joint& joint : cell.robot.joints)
      q.push_back(random.uniform(joint.min_rad, joint.max_rad));
    if (k > 0) drawn.emplace_back(postures.back(), q);
    postures.push_back(std::move(q));
  }
  std::vector<JointVector> stops;
  for (const Move& move : planned) stops.push_back(move.second);
  fmt::print("{} moves of a plan, {} drawn at random\n", planned.size(), drawn.size());
  fmt::print("{:30s} {:>9s} {:>6s} {:>12s} {:>6s} {:>12s} {:>6s}\n", "us per call", "posture",
             "free", "plan's move", "free", "random move", "free");
  const auto row = [&](const char* name, const auto& check) {
    measure(name, check, stops, planned, drawn, calls);
  };
  row("spheres and stands, before", CapsuleCheck(cell, arm));
  row("demo cell", Clearance(cell, arm));
  row("with obstacles and a mesh", Clearance(full, arm));
  measure_mesh(cell, arm);
  return 0;
}
