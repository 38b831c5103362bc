// Calibration of alarms. The touches of a healthy arm are in random order, so that they contain no
// lasting change: every reported change during the session is a false alarm. In the same orders,
// with a real change: the share that is named.

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <mutex>
#include <numbers>
#include <optional>
#include <thread>
#include <vector>

#include "calib/estimate/region.h"
#include "calib/files/files.h"
#include "calib/identify/identify.h"
#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/result/finding.h"
#include "tests/command_line/command_line.h"
#include "tests/experiments/world.h"

namespace {

using namespace cellcal;

constexpr double kNoiseM = 0.02e-3;
constexpr double kHalfWarm = 0.5;  // the same temperature for all touches: no creep

struct Level {
  const char* name;
  int spheres;
  bool lengths;
  int alone;  ///< touches without repeats
};
constexpr Level kLevels[] = {{"L1", 1, false, 50},
                             {"L2", 4, true, 100},
                             {"L3", 6, true, 100},
                             {"T", 0, false, 60}};  // a tracker instead of spheres

struct Touching {
  const char* name;
  int postures;  ///< 0: number of the level
  int times;
  bool blocks;  ///< touches of one posture are consecutive
};
constexpr Touching kTouchings[] = {
    {"24x10 blocks", 24, 10, true}, {"24x10 mixed", 24, 10, false}, {"no repeats", 0, 1, true}};

struct Arm {
  const char* name;
  experiments::Gears gears;
  double field_m;
};
constexpr Arm kArms[] = {{"as modelled", experiments::Gears::kHarmonics, 0.0},
                         {"0.05 mm", experiments::Gears::kSpectrum, 0.05e-3},
                         {"0.2 mm", experiments::Gears::kSpectrum, 0.2e-3}};

struct Stated {
  const char* name;
  double factor;
};
constexpr Stated kStated[] = {{"right", 1.0}, {"a fifth", 0.2}};

enum Change { kNothing, kSlip, kKnock, kMove, kChanges };
constexpr double kSlipRad = 0.05 * std::numbers::pi / 180.0, kKnockM = 0.5e-3, kMoveM = 0.5e-3;

struct Row {
  const Level& level;
  const Touching& touching;
  const Arm& arm;
  const Stated& stated;
  int made[kChanges] = {}, named[kChanges] = {};
  int slip = 0, knock = 0, move = 0, cause = 0, published = 0;  ///< of the healthy arms
};

/// A cell and its touches: as planned, or, with a tracker, in these postures.
struct Session {
  calib::Cell nominal;
  calib::Plan plan;
  std::vector<calib::JointVector> postures;
  calib::Random random;

  std::size_t size() const { return plan.touches.empty() ? postures.size() : plan.touches.size(); }
};

experiments::Stage stage_of(const Row& row) {
  experiments::Stage stage;
  stage.spheres = row.level.spheres;
  stage.lengths = row.level.lengths;
  stage.noise_m = kNoiseM;
  stage.touch_sigma_m = kNoiseM * row.stated.factor;
  stage.outlier_share = 0.0;
  stage.truth.gears = row.arm.gears;
  stage.truth.field_m = row.arm.field_m;
  stage.truth.growth = 0.0;
  return stage;
}

std::optional<Session> planned(const calib::Robot& robot, const Row& row, std::uint64_t seed) {
  calib::Random random(seed);
  Session session{experiments::make_cell(robot, stage_of(row), random), {}, {}, random};
  session.nominal.touch_sigma_m = kNoiseM;  // the same plan for any stated sigma
  const int postures = row.touching.postures > 0 ? row.touching.postures : row.level.alone;
  if (row.level.spheres == 0) {
    calib::Target tracker;
    tracker.id = "T1";
    tracker.kind = calib::TargetKind::kTracker;
    session.nominal.targets.push_back(tracker);
    session.postures = calib::workspace_poses(calib::ArmModel(session.nominal), postures,
                                              static_cast<unsigned>(seed));
    session.random = random;
    return session;
  }
  calib::PlanOptions options;
  options.fit_touches = postures;
  options.check_touches = 0;
  options.seed = static_cast<unsigned>(seed);
  try {
    session.plan = calib::make_plan(session.nominal, options);
  } catch (const calib::PlanError&) {
    return std::nullopt;  // another cell is drawn
  }
  session.random = random;
  return session;
}

/// Order of the postures, drawn randomly each time.
std::vector<std::size_t> drawn_order(const Row& row, std::size_t postures, calib::Random& random) {
  std::vector<std::size_t> order;
  const auto times = static_cast<std::size_t>(row.touching.times);
  for (std::size_t p = 0; p < postures; ++p)
    order.insert(order.end(), row.touching.blocks ? 1 : times, p);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
  if (!row.touching.blocks) return order;
  std::vector<std::size_t> all;
  for (const std::size_t p : order) all.insert(all.end(), times, p);
  return all;
}

/// The session in that order; from its middle on with a change.
std::pair<calib::Cell, std::vector<calib::Touch>> made(const Row& row, Session session,
                                                       Change change, int order) {
  const auto world_of = [&](const Eigen::Vector3d& tip_m) {
    calib::Cell nominal = session.nominal;
    nominal.touch_sigma_m = stage_of(row).touch_sigma_m;
    nominal.tool.tcp.translation() += tip_m;
    calib::Random random = session.random;  // the same arm
    return experiments::World(nominal, stage_of(row), random);
  };
  const experiments::World before = world_of(Eigen::Vector3d::Zero());
  const Eigen::Vector3d along = Eigen::Vector3d(0.5, -0.6, 0.4).normalized();
  const experiments::World after =
      world_of(change == kKnock ? Eigen::Vector3d(kKnockM * along) : Eigen::Vector3d::Zero());
  calib::Random random = session.random;
  for (int k = 0; k <= order; ++k) random = calib::Random(random.below(1u << 30) + 1);
  const std::vector<std::size_t> postures = drawn_order(row, session.size(), random);
  std::vector<calib::Touch> touches;
  for (std::size_t i = 0; i < postures.size(); ++i) {
    const bool later = change != kNothing && 2 * i >= postures.size();
    if (row.level.spheres == 0) {
      calib::Touch read;
      read.target = "T1";
      read.joint_rad = session.postures[postures[i]];
      Eigen::Vector3d tip = (later ? after : before).arm.tip(read.joint_rad, kHalfWarm);
      if (later && change == kMove) tip += kMoveM * along;
      for (int k = 0; k < 3; ++k) read.tracker_m[k] = tip[k] + kNoiseM * random.normal();
      if (later && change == kSlip) read.joint_rad[2] -= kSlipRad;
      touches.push_back(read);
      continue;
    }
    const calib::PlannedTouch& p = session.plan.touches[postures[i]];
    const bool moved = later && change == kMove && p.target == "S1";
    auto touch = (later ? after : before)
                     .touch(p, kHalfWarm, experiments::kBeyond, random,
                            moved ? Eigen::Vector3d(kMoveM * along) : Eigen::Vector3d::Zero());
    if (!touch) continue;
    if (later && change == kSlip) touch->joint_rad[2] -= kSlipRad;
    touches.push_back(std::move(*touch));
  }
  return {before.cell, touches};
}

void judge(Row& row, const Session& session, Change change, int order, std::mutex& one,
           bool detail) {
  const auto [cell, touches] = made(row, session, change, order);
  const calib::Calibration c = calib::identify(cell, touches);
  const auto jumped = [&](calib::Jump::What what, const std::string& name) {
    return std::any_of(c.jumped.begin(), c.jumped.end(), [&](const calib::Jump& j) {
      return j.what == what && (name.empty() || j.name == name);
    });
  };
  const std::lock_guard lock(one);
  ++row.made[change];
  if (detail)
    fmt::print(
        "  {} {} {} {} change {} order {}: {:.1f}, log odds {} {}\n", row.level.name,
        row.touching.name, row.arm.name, row.stated.name, static_cast<int>(change), order,
        c.chi2_per_dof, c.jumped.empty() ? "-" : fmt::format("{:.1f}", c.jumped.front().log_odds),
        c.verdict.findings.empty() ? "" : calib::words(c.verdict.findings).front().substr(0, 150));
  switch (change) {
    case kNothing:
      row.slip += jumped(calib::Jump::What::kJoint, "");
      row.knock += jumped(calib::Jump::What::kTool, "");
      row.move += !c.moved.empty() || jumped(calib::Jump::What::kTarget, "");
      row.cause += has(c.verdict.findings, calib::FindingKind::kLikelyCause);
      row.published += c.verdict.publish();
      break;
    case kSlip:
      row.named[change] += jumped(calib::Jump::What::kJoint, cell.robot.joints[2].name);
      break;
    case kKnock: row.named[change] += jumped(calib::Jump::What::kTool, ""); break;
    case kMove: {
      const char* target = row.level.spheres == 0 ? "T1" : "S1";
      row.named[change] += (!c.moved.empty() && c.moved.front().target == target) ||
                           jumped(calib::Jump::What::kTarget, target);
      break;
    }
    case kChanges: break;
  }
}

void print(const Row& row) {
  const auto named = [&](Change change) {
    return row.made[change] == 0 ? std::string("-")
                                 : fmt::format("{}/{}", row.named[change], row.made[change]);
  };
  fmt::print("{:2} {:13} {:12} {:8} {:>6} {:>7} {:>7} {:>6} {:>6} {:>6} | {:>6} {:>6} {:>6}\n",
             row.level.name, row.touching.name, row.arm.name, row.stated.name, row.made[kNothing],
             row.published, row.knock, row.slip, row.move, row.cause, named(kSlip), named(kKnock),
             named(kMove));
  std::fflush(stdout);
}

bool chosen(const std::string& only, const char* name) {
  return std::string(name).starts_with(only);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    int arms = 1, orders = 2, planted = 1;
    unsigned threads = 2;
    std::uint64_t seed = 1;
    bool detail = false;
    std::string file = CELLCAL_EXPERIMENT_ROBOT, level, touches, arm, sigma;
    cellcal::CommandLine app(
        "False alarms of healthy sessions in orders drawn at random, and power.\n"
        "Example: alarms --arms 20 --level L2");
    app.option("--arms", arms, "Per row").between(1, 1000);
    app.option("--orders", orders, "Of each healthy arm's touches");
    app.option("--planted", planted, "Orders with each change, of each arm");
    app.option("--seed", seed, "");
    app.option("--threads", threads, "").between(1, 64);
    app.option("--level", level, "Only L1, L2 or L3");
    app.option("--touches", touches, "Only those whose name begins so");
    app.option("--arm", arm, "Only model errors whose name begins so");
    app.option("--sigma", sigma, "Only stated sigmas whose name begins so");
    app.option("--detail", detail, "A line for every session");
    if (const auto code = app.parse(argc, argv)) return *code;
    const calib::Robot robot = calib::load_robot(file);
    std::vector<Row> rows;
    for (const Level& l : kLevels)
      for (const Touching& t : kTouchings)
        for (const Arm& a : kArms)
          for (const Stated& s : kStated)
            if (chosen(level, l.name) && chosen(touches, t.name) && chosen(arm, a.name) &&
                chosen(sigma, s.name))
              rows.push_back({l, t, a, s});
    fmt::print(
        "Touches repeat to {:.3f} mm. Of the healthy sessions: published, accused of a knocked\n"
        "tool, a slipped joint, a moved sphere, another mistake. Named: A3 slipped by 0.05 deg,\n"
        "tip knocked by 0.5 mm, S1 or tracker moved by 0.5 mm, each in the middle of the session.\n\n"
        "   touches       model error  sigma   healthy publ.   knocked slipped moved  other | "
        "slip   knock  move\n",
        kNoiseM * 1e3);
    std::mutex one;
    for (Row& row : rows) {
      std::atomic<std::uint64_t> next{0};
      std::atomic<int> left{arms};
      const auto work = [&] {
        while (left > 0) {
          const std::uint64_t k = next++;
          const auto session = planned(robot, row, seed * 100000 + k);
          if (!session || left-- <= 0) continue;
          for (int order = 0; order < orders; ++order)
            judge(row, *session, kNothing, order, one, detail);
          for (int order = 0; order < planted; ++order)
            for (const Change change : {kSlip, kKnock, kMove})
              judge(row, *session, change, order, one, detail);
        }
      };
      std::vector<std::jthread> workers;
      for (unsigned t = 0; t < threads; ++t) workers.emplace_back(work);
      workers.clear();
      print(row);
    }
    int healthy = 0, accused = 0;
    for (const Row& row : rows) {
      healthy += row.made[kNothing];
      accused += row.knock + row.slip + row.move + row.cause;
    }
    fmt::print("\n{} healthy sessions, {} accusations\n", healthy, accused);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "alarms: %s\n", e.what());
    return 1;
  }
}
