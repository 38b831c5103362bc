#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/cli/commands.h"
#include "daemon/cli/offline.h"

namespace cellcal::daemon {

namespace {

void add_identify(CLI::App& app, int& status) {
  auto given = std::make_shared<IdentifyCommand>();
  CLI::App* command =
      app.add_subcommand("identify", "Identify a calibration from touches, offline");
  command->footer(
      "Exit status 3: the result is written, but must not be used; the reasons are printed.\n"
      "Example: cellcal identify --cell cell.toml --touches touches.csv -o calibration.json");
  command->add_option("--cell", given->cell, "Cell file (TOML)")->required();
  command->add_option("--touches", given->touches, "Touches (CSV)")->required();
  command->add_option("-o,--output", given->output, "Where the calibration goes (JSON)");
  command->add_option(
      "--last", given->last,
      "Calibration of this arm to compare with (JSON): withheld where it changed by "
      "more than three times what both state");
  command
      ->add_flag("--accept-change", given->accept_change,
                 "The arm was repaired, hit or mastered anew since then")
      ->needs("--last");
  command
      ->add_option("--method", given->method,
                   "map: this project's estimator; paper: the seed paper's, for comparison")
      ->check(CLI::IsMember({"map", "paper"}))
      ->capture_default_str();
  command->add_flag("--json", given->json, "Print the calibration as JSON");
  command->add_flag("--verbose", given->verbose,
                    "Print everything that was found, not the summary alone");
  command->callback([given, &status] { status = identify(*given); });
}

void add_predict(CLI::App& app, int& status) {
  auto given = std::make_shared<PredictCommand>();
  CLI::App* command =
      app.add_subcommand("predict", "Where the TCP really is at given joint angles");
  command->footer(
      "Exit status 3: the calibration was withheld; nothing is predicted without --withheld.\n"
      "u95_mm is the radius that holds the position error, at 98 % confidence and at 95 % of the\n"
      "workspace; where the base frame lies is left aside. The nominal model has none, and its\n"
      "output no such column.\n"
      "Example: cellcal predict --calibration calibration.json --joints joints.csv -o tcp.csv");
  command->add_option("--calibration", given->calibration, "Calibration (JSON)")->required();
  command->add_option("--joints", given->joints, "Joint angles (CSV, deg)")->required();
  command->add_flag("--nominal", given->nominal, "With the nominal robot and a stiff tool");
  command->add_flag("--withheld", given->withheld,
                    "Also of a calibration that was withheld: to look at, not to use");
  command->add_option("-o,--output", given->output, "Where the poses go (CSV); default: print");
  command->add_flag("--json", given->json, "Poses as JSON");
  command->callback([given, &status] { status = predict(*given); });
}

void add_plan(CLI::App& app, int& status) {
  auto given = std::make_shared<PlanCommand>();
  CLI::App* command = app.add_subcommand("plan", "The touches to make, in order");
  command->footer(
      "Written in the touches' format, at nominal contact. Says how far the axes go: over RSI,\n"
      "[rsi] correction_limit_deg must be more. Refuses a cell file that contradicts itself.\n"
      "Example: cellcal plan --cell cell.toml --touches 40 --check 10 -o plan.csv --picture "
      "plan.svg");
  command->add_option("--cell", given->cell, "Cell file (TOML)")->required();
  command->add_option("--touches", given->touches, "Touches for the fit")
      ->required()
      ->check(CLI::Range(1, 2000));
  command->add_option("--check", given->check, "Touches held out of the fit")
      ->check(CLI::Range(0, 2000))
      ->capture_default_str();
  command
      ->add_option("--region", given->region,
                   "Where accuracy matters: workspace, targets (150 mm around them), tcp, or "
                   "box:X,Y,Z,X,Y,Z (mm, two corners)")
      ->capture_default_str();
  command
      ->add_option("--from", given->from_deg,
                   "Where the arm stands when the session begins, A1,A2,... in degrees; default: "
                   "where the plan would have it")
      ->delimiter(',');
  command->add_option("--picture", given->picture,
                      "Where a picture goes (SVG): arm, cell and touches, from above and the side");
  command->add_option("--seed", given->seed, "Same seed, same plan")->capture_default_str();
  command->add_option("-o,--output", given->output, "Where the plan goes (CSV); default: print");
  command->add_flag("--json", given->json, "Plan as JSON");
  command->callback([given, &status] { status = plan(*given); });
}

void add_kuka_files(CLI::App& app, int& status) {
  auto given = std::make_shared<KukaFilesCommand>();
  CLI::App* command =
      app.add_subcommand("kuka-files", "The files that a KUKA controller needs for RSI or EKI");
  command->footer(
      "Made from [rsi] or [eki], and [controller], of the daemon's configuration.\n"
      "drivers/kuka/krl/README.md says how they are installed and what to check before the first\n"
      "motion.\n"
      "Example: cellcal kuka-files --config cellcald.toml -o krc\n"
      "         cellcal kuka-files --config cellcald.toml --verify backup/SensorInterface");
  command->add_option("--config", given->config, "The daemon's configuration")
      ->capture_default_str();
  CLI::Option* output = command->add_option("-o,--output", given->output, "Folder that they go to");
  command
      ->add_option("--verify", given->verify,
                   "Write nothing; compare the files in this folder, as installed or edited, with "
                   "the configuration, and say what is wrong with them")
      ->excludes(output);
  command->add_option("--wire", given->wire, "rsi or eki; default: the configuration's backend")
      ->check(CLI::IsMember({"rsi", "eki"}));
  command->add_flag("--json", given->json, "What was written, and where it goes, as JSON");
  command->callback([given, &status] {
    if (given->output.empty() && given->verify.empty()) {
      throw CLI::RequiredError("--output (or --verify)");
    }
    status = kuka_files(*given);
  });
}

void add_doctor(CLI::App& app, int& status) {
  auto given = std::make_shared<DoctorCommand>();
  CLI::App* command = app.add_subcommand(
      "doctor", "Look at everything between this computer and the cell, without moving the arm");
  command->footer(
      "Configuration, files, daemon, real-time rights, contact sensor, and the controller's link,\n"
      "in this order; each line says ok, warning, FAILED or skipped, and what to do. Over RSI it\n"
      "answers with zero corrections and ends the session with Stop; over EKI it commands "
      "nothing.\n"
      "While a session runs, the daemon's own figures are shown instead.\n"
      "Exit status 0: nothing FAILED; there may be warnings. 1: something FAILED.\n"
      "Example: cellcal doctor --config /etc/cellcal/cellcald.toml --cell cell.toml");
  command->add_option("--config", given->config, "The daemon's configuration")
      ->capture_default_str();
  command->add_option("--cell", given->cell, "Cell file (TOML): robot, axis limits");
  command->add_option("--files", given->files,
                      "Folder with the controller's files, as in 'kuka-files --verify'");
  command->add_option("--wait", given->wait_s, "Seconds to wait for the controller's first packet")
      ->check(CLI::Range(0.5, 600.0))
      ->capture_default_str();
  command->add_option("--for", given->observe_s, "Seconds to observe the links for")
      ->check(CLI::Range(1.0, 3600.0))
      ->capture_default_str();
  command->add_flag("--json", given->json, "Findings as JSON");
  command->callback([given, &status] { status = doctor(*given); });
}

}  // namespace

void add_offline_commands(CLI::App& app, int& status) {
  add_identify(app, status);
  add_predict(app, status);
  add_plan(app, status);
  add_kuka_files(app, status);
  add_doctor(app, status);
}

}  // namespace cellcal::daemon
