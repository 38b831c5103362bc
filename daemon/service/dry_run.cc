#include <fmt/format.h>

#include "calib/plan/finder.h"
#include "daemon/files/atomic_file.h"
#include "daemon/service/kind.h"
#include "daemon/tasks/planned_round.h"

namespace cellcal::daemon {

namespace {

class DryRunKind : public Kind {
 public:
  Parameters parameters() const override {
    return {.touches = true,
            .seed = true,
            .refusal =
                "a dry run follows a planned path: leave goal_mm and find out, and give touches"};
  }

  std::string command(const SessionOptions& options, const SessionInputs& inputs) const override {
    return fmt::format("cellcal dry-run --cell {} --touches {} --check {} --seed {}",
                       shell_word(inputs.cell_name), options.plan.fit_touches,
                       options.plan.check_touches, options.plan.seed);
  }

  /// Its path is planned by what the last calibration learnt, as that of a calibration.
  std::optional<Compared> compared(Journal& journal, const Job& job) const override {
    return last_calibration(journal, job.inputs.cell_name, job.session, true);
  }

  bool chooses(const Job&) const override { return false; }

  /// It searches nothing, so it finds nothing.
  void examine(const Job& job) const override {
    if (must_find(job.cell))
      throw RequestError(
          "a dry run needs the centre of each sphere. Find them with 'cellcal find', and state centre_mm in the "
          "cell file");
  }

  double most_speed() const override { return 0.1; }

  void adapt(State& first, const Job&) const override {
    first.dry = true;
    first.retries = 0;
    first.repeats = {0, 0};
  }

  Tasks tasks(const SharedInputs& inputs) const override {
    const auto standoffs = std::make_shared<std::size_t>(0);
    Tasks tasks;
    tasks.plan = [inputs, standoffs] {
      Tasks::Planned planned = plan_beforehand(*inputs);
      *standoffs = planned.plan.touches.size();
      return planned;
    };
    tasks.identify = [standoffs](const std::vector<calib::Touch>&) {
      return SessionResult{DryRun{*standoffs}};
    };
    tasks.report = [inputs](const SessionResult& result, const std::vector<calib::Touch>&) {
      inputs->note("dry run: " + calib::words(phrases(outcome_of(result)).front()));
    };
    return with_route(std::move(tasks), inputs);
  }
};

}  // namespace

const Kind& dry_run_kind() {
  static const DryRunKind kind;
  return kind;
}

}  // namespace cellcal::daemon
