#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/cli/commands/commands.h"
#include "daemon/cli/offline/offline.h"

namespace cellcal::daemon {

namespace {

void add_identify(CLI::App& app, int& status) {
  auto given = std::make_shared<IdentifyCommand>();
  CLI::App* command =
      app.add_subcommand("identify", "Estimate a calibration from a file of touches, offline");
  command->footer(
      "Exit status 3: the result is written but must not be used; the reasons are "
      "printed.\nExample: cellcal identify --cell cell.toml --touches touches.csv -o "
      "calibration.json");
  command->add_option("--cell", given->cell, "Cell file (TOML)")->required();
  command->add_option("--touches", given->touches, "Touches (CSV)")->required();
  command->add_option("-o,--output,--out", given->output,
                      "Write the calibration to this file (JSON)");
  command->add_option(
      "--last", given->last,
      "Earlier calibration of this arm to compare with (JSON): the new one is withheld if the "
      "arm changed by more than 3 times what both predict");
  command
      ->add_flag("--accept-change", given->accept_change,
                 "Publish although the arm changed since then: it was repaired, hit or mastered")
      ->needs("--last");
  command
      ->add_option("--method", given->method,
                   "map: maximum a posteriori (usual); paper: method of Wang et al. 2024, for "
                   "comparison")
      ->check(CLI::IsMember({"map", "paper"}))
      ->capture_default_str();
  command->add_flag("--json", given->json, "Print the calibration as JSON");
  command->add_flag("--verbose", given->verbose, "Print all findings, not only the summary");
  command->callback([given, &status] { status = identify(*given); });
}

void add_predict(CLI::App& app, int& status) {
  auto given = std::make_shared<PredictCommand>();
  CLI::App* command =
      app.add_subcommand("predict", "Predict where the TCP is at given joint angles");
  command->footer(
      "u95_mm: radius that contains the position error at 95 % of the workspace, with 98 "
      "%\nconfidence. The position of the base frame is not part of it. The nominal model has "
      "none.\nExit status 3: the calibration was withheld; nothing is predicted without "
      "--withheld.\nExample: cellcal predict --calibration calibration.json --joints "
      "joints.csv -o tcp.csv");
  command->add_option("--calibration", given->calibration, "Calibration (JSON)")->required();
  command->add_option("--joints", given->joints, "Joint angles (CSV, deg)")->required();
  command->add_flag("--nominal", given->nominal, "Use the nominal robot with a stiff tool");
  command->add_flag("--withheld", given->withheld,
                    "Accept a withheld calibration, for inspection only");
  command->add_option("-o,--output,--out", given->output,
                      "Write the poses to this file (CSV) [standard output]");
  command->add_flag("--json", given->json, "Write JSON");
  command->callback([given, &status] { status = predict(*given); });
}

void add_plan(CLI::App& app, int& status) {
  auto given = std::make_shared<PlanCommand>();
  CLI::App* command = app.add_subcommand("plan", "Plan the touches and their order");
  command->footer(
      "The file has the joint angles at the nominal contacts, in the format of touches. The "
      "largest\naxis travel is printed: over RSI, [rsi] correction_limit_deg must be more. A "
      "cell file that\ncontradicts itself is refused.\nExample: cellcal plan --cell cell.toml "
      "--touches 50 --check 10 -o plan.csv --picture plan.svg\n"
      "         cellcal plan --cell cell.toml --touches 50 --suggest-spheres");
  command->add_option("--cell", given->cell, "Cell file (TOML)")->required();
  command->add_option("--touches", given->touches, "Touches for the fit")
      ->required()
      ->check(CLI::Range(1, 2000));
  command->add_option("--check", given->check, "Held-out touches, to check the result")
      ->check(CLI::Range(0, 2000))
      ->capture_default_str();
  command
      ->add_option("--region", given->region,
                   "Where accuracy matters: workspace, targets (150 mm around them), tcp, or "
                   "box:X,Y,Z,X,Y,Z (mm, two corners)")
      ->capture_default_str();
  command
      ->add_option("--from", given->from_deg,
                   "Joint angles where the session begins, A1,A2,... in deg [chosen by the plan]")
      ->delimiter(',');
  command->add_option("--picture", given->picture,
                      "Draw arm, cell and touches from above and from the side (SVG)");
  command->add_option("--seed", given->seed, "Seed of the plan: same seed, same plan")
      ->capture_default_str();
  command->add_option("-o,--output,--out", given->output,
                      "Write the plan to this file (CSV) [standard output]");
  command->add_flag("--json", given->json, "Write JSON");
  command
      ->add_option("--suggest-spheres", given->suggest_spheres,
                   "In place of a plan: places for so many spheres that serve the region, and the predicted "
                   "accuracy beside today's [4]")
      ->expected(0, 1)
      ->default_str("4")
      ->check(CLI::Range(1, 12));
  command->callback([given, &status] { status = plan(*given); });
}

void add_kuka_files(CLI::App& app, int& status) {
  auto given = std::make_shared<KukaFilesCommand>();
  CLI::App* command = app.add_subcommand(
      "kuka-files", "Write or check the files that a KUKA controller needs for RSI or EKI");
  command->footer(
      "They are made from [rsi] or [eki], and [controller], of the daemon's configuration. How "
      "to\ninstall them, and what to check before the first motion: "
      "drivers/kuka/krl/README.md.\nExample: cellcal kuka-files --config cellcald.toml -o "
      "krc --cell cell.toml\n         cellcal kuka-files --config cellcald.toml --verify "
      "backup/SensorInterface");
  command->add_option("--config", given->config, "The daemon's configuration")
      ->capture_default_str();
  CLI::Option* output =
      command->add_option("-o,--output,--out", given->output, "Write the files to this folder");
  command
      ->add_option("--verify", given->verify,
                   "Write nothing; compare the installed or edited files in this folder with "
                   "the configuration and list what is wrong")
      ->excludes(output);
  command->add_option(
      "--cell", given->cell,
      "Cell file: RSI's program keeps the axes within the ranges of its robot, too");
  command->add_option("--wire", given->wire, "rsi or eki [the configuration's backend]")
      ->check(CLI::IsMember({"rsi", "eki"}));
  command->add_flag("--json", given->json, "Print the written files and their places as JSON");
  command->callback([given, &status] {
    if (given->output.empty() && given->verify.empty()) {
      throw CLI::RequiredError("--output (or --verify)");
    }
    status = kuka_files(*given);
  });
}

void add_export_robot(CLI::App& app, int& status) {
  auto given = std::make_shared<ExportRobotCommand>();
  CLI::App* command = app.add_subcommand(
      "export-robot", "Write the calibrated arm for other programs: URDF, ROS, DH table, JSON");
  command->footer(
      "URDF, YAML and DH table hold rigid links; what compliance, gears and bending add is printed "
      "in mm.\nExit status 3: the calibration was withheld; nothing is written without "
      "--withheld.\nExample: cellcal export-robot --calibration calibration.json --urdf "
      "kr5.urdf -o kr5_calibrated.urdf\n         cellcal export-robot --calibration "
      "calibration.json --as dh -o dh.csv");
  command->add_option("--calibration", given->calibration, "Calibration (JSON)")->required();
  command
      ->add_option("--as", given->as,
                   "urdf; yaml: frames of the joints for ROS 2 drivers; dh: Denavit-Hartenberg "
                   "parameters (CSV); json: all parameters")
      ->check(CLI::IsMember({"urdf", "yaml", "dh", "json"}))
      ->capture_default_str();
  CLI::Option* urdf = command->add_option(
      "--urdf", given->urdf,
      "Put the calibrated joints into this URDF: links, meshes and names stay [a new one]");
  command->add_option("--tip", given->tip, "Its link at the flange [tool0, flange, or the last]")
      ->needs(urdf);
  command->add_flag("--withheld", given->withheld,
                    "Accept a withheld calibration, for inspection only");
  command->add_option("-o,--output,--out", given->output, "Write to this file [standard output]");
  command->callback([given, &status] {
    if (!given->urdf.empty() && given->as != "urdf" && given->as != "yaml")
      throw CLI::ValidationError("--urdf", "goes with --as urdf or --as yaml");
    status = export_robot(*given);
  });
}

void add_import_robot(CLI::App& app, int& status) {
  auto given = std::make_shared<ImportRobotCommand>();
  CLI::App* command = app.add_subcommand(
      "import-robot", "Make a robot file from a URDF and a KUKA controller's machine data");
  command->footer(
      "Machine data: $machine.dat and $robcor.dat of KRC:\\R1\\Mada, $config.dat of "
      "KRC:\\R1\\System. Limits, speeds\nand type come from them; lengths are compared. Tools of "
      "$config.dat are printed for the cell file.\nExample: cellcal import-robot --robot kr5_r1400 "
      "--machine-data '$machine.dat' -o my_kr5.toml\n         cellcal import-robot --urdf "
      "robot.urdf -o robot.toml");
  CLI::Option* urdf = command->add_option("--urdf", given->urdf, "Geometry from this URDF");
  command
      ->add_option("--robot", given->robot,
                   "Geometry from this robot file, or a shipped robot by its name")
      ->excludes(urdf);
  command->add_option("--tip", given->tip, "Link at the flange [tool0, flange, or the last]")
      ->needs(urdf);
  command->add_option("--machine-data", given->machine_data,
                      "File of the controller; may be given several times");
  command->add_option("-o,--output,--out", given->output,
                      "Write the robot to this file [standard output]");
  command->callback([given, &status] {
    if (given->urdf.empty() && given->robot.empty())
      throw CLI::RequiredError("--urdf (or --robot)");
    status = import_robot(*given);
  });
}

void add_doctor(CLI::App& app, int& status) {
  auto given = std::make_shared<DoctorCommand>();
  CLI::App* command = app.add_subcommand(
      "doctor", "Check everything between this computer and the cell, without moving the arm");
  command->footer(
      "Checks configuration, files, daemon, real-time rights, contact sensor and the "
      "controller's\nlink, in this order. Each line is ok, warning, FAILED or skipped, with "
      "what to do. Over RSI\nall corrections are zero and Stop ends the RSI session; over EKI "
      "nothing is commanded. While\na session runs, the daemon's own figures are shown.\nExit "
      "status 0: nothing FAILED; there may be warnings. 1: something FAILED.\nExample: cellcal "
      "doctor --config /etc/cellcal/cellcald.toml --cell cell.toml");
  command->add_option("--config", given->config, "The daemon's configuration")
      ->capture_default_str();
  command->add_option("--cell", given->cell, "Cell file (TOML): robot, axis limits");
  command->add_option("--files", given->files,
                      "Check the controller's files in this folder, as 'kuka-files --verify'");
  command->add_option("--wait", given->wait_s, "Seconds to wait for the controller's first packet")
      ->check(CLI::Range(0.5, 600.0))
      ->capture_default_str();
  command->add_option("--for", given->observe_s, "Seconds to observe the links")
      ->check(CLI::Range(1.0, 3600.0))
      ->capture_default_str();
  command->add_flag("--json", given->json, "Print JSON");
  command->callback([given, &status] { status = doctor(*given); });
}

void add_robots(CLI::App& app, int& status) {
  auto given = std::make_shared<RobotsCommand>();
  CLI::App* command = app.add_subcommand("robots", "List the robots that a cell file may name");
  command->footer(
      "Reach: from the axis of A1 to the wrist centre, the arm stretched. Robot files of your own lie beside the\n"
      "cell file, which names them by path, or in the folder that CELLCAL_ROBOTS names, which is searched before "
      "the\nshipped ones. The places are printed behind the list.\nExample: cellcal robots");
  command->add_flag("--json", given->json, "Print JSON");
  command->callback([given, &status] { status = robots(*given); });
}

}  // namespace

void add_offline_commands(CLI::App& app, int& status) {
  add_identify(app, status);
  add_predict(app, status);
  add_correct(app, status);
  add_frames(app, status);
  add_plan(app, status);
  add_kuka_files(app, status);
  add_robots(app, status);
  add_export_robot(app, status);
  add_import_robot(app, status);
  add_doctor(app, status);
}

}  // namespace cellcal::daemon
