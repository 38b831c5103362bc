#include <CLI/CLI.hpp>
#include <array>
#include <memory>

#include "daemon/cli/actions.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/correct.h"
#include "daemon/cli/frames.h"
#include "daemon/cli/offline.h"

namespace cellcal::daemon {

namespace {

void add_identify(CLI::App& app, int& status) {
  const auto [command, given] =
      add_command(app, status, "identify", "Estimate a calibration from a file of touches, offline",
                  "Exit status 3: the result is written but must not be used; the reasons are "
                  "printed.\nExample: cellcal identify --cell cell.toml --touches touches.csv -o "
                  "calibration.json",
                  identify);
  command->add_option("--cell", given->cell, "Cell file (TOML)")->required();
  command->add_option("--touches", given->touches, "Touches (CSV)")->required();
  add_output(*command, given->output, "Write the calibration to this file (JSON)");
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
                   "map: maximum a posteriori (usual). For comparison: plain, the same without "
                   "functions of the joints' angles; paper, method of Wang et al. 2024")
      ->check(one_of({"map", "plain", "paper"}))
      ->capture_default_str();
  add_json(*command, given->json, "Print the calibration as JSON");
  command->add_flag("--verbose", given->verbose, "Print all findings, not only the summary");
  add_language(*command);
}

void add_predict(CLI::App& app, int& status) {
  const auto [command, given] = add_command(
      app, status, "predict", "Predict where the TCP is at given joint angles",
      "u95_mm: radius that contains the position error at 95 % of the workspace, with 98 "
      "%\nconfidence. The position of the base frame is not part of it. The nominal model has "
      "none.\n--on E2: poses in the frame that this axis of the positioner carries, at the angles of the file's columns\n"
      "E1,E2; u95 excludes the position of that frame, and dx_mm,dy_mm,dz_mm is the predicted error: the calibrated\n"
      "tip minus the nominal one there.\nExit status 3: the calibration was withheld; nothing is predicted without "
      "--withheld.\nExample: cellcal predict --calibration calibration.json --joints "
      "joints.csv -o tcp.csv",
      predict);
  command->add_option("--calibration", given->calibration, "Calibration (JSON)")->required();
  command
      ->add_option("--joints", given->joints,
                   "Joint angles in deg: a file (CSV), or one row by its values, A1,A2,...")
      ->required();
  command->add_flag("--nominal", given->nominal, "Use the nominal robot with a stiff tool");
  command->add_option(
      "--on", given->on,
      "Axis of the positioner that carries the frame of the poses [the base frame]");
  command
      ->add_option(
          "--load", given->load,
          "A [[load]] of the cell file by its id; or MASS,X,Y,Z: all on the flange, in kg and mm "
          "from the flange, as LOAD_DATA [the cell file's tool alone]")
      ->delimiter(',')
      ->expected(1, 4);
  command->add_option(
      "--tool", given->tool,
      "A [[tool]] of the cell file by its id; or X,Y,Z,A,B,C from flange to TCP, as TOOL_DATA (mm, "
      "deg), taken as exact [the cell file's first]");
  add_withheld(*command, given->withheld);
  add_output(*command, given->output, "Write the poses to this file (CSV) [standard output]");
  add_json(*command, given->json, "Write JSON");
}

std::array<CLI::Option*, 2> add_leave_and_still(CLI::App& command, auto& given) {
  return {
      command
          .add_option(
              "--leave", given.leave,
              "Points that stay as they are: NAME,NAME, or \"line 12\" for one written out there")
          ->delimiter(','),
      command
          .add_option("--does-not-move", given.still,
                      "Routines that neither move the arm nor set frames: NAME,NAME")
          ->delimiter(',')};
}

void add_plan(CLI::App& app, int& status) {
  auto given = std::make_shared<PlanCommand>();
  CLI::App* command = app.add_subcommand("plan", "Plan the touches and their order");
  command->footer(
      "The file has the joint angles at the nominal contacts, in the format of touches. The "
      "largest\naxis travel is printed: over RSI, [rsi] correction_limit_deg must be more. A "
      "cell file that\ncontradicts itself is refused.\nExample: cellcal plan --cell cell.toml "
      "--touches 100 --check 10 -o plan.csv --picture plan.svg\n"
      "         cellcal plan --cell cell.toml --touches 100 --program weld.src --config '$config.dat'\n"
      "         cellcal plan --cell cell.toml --goal 0.15\n"
      "         cellcal plan --cell cell.toml --touches 100 --suggest-spheres");
  command->add_option("--cell", given->cell, "Cell file (TOML)")->required();
  auto* touches = command
                      ->add_option("--touches", given->touches,
                                   "Touches for the fit; with --goal the most [with --goal 200]")
                      ->check(between(1, 2000));
  auto* goal = command
                   ->add_option("--goal", given->goal_mm,
                                "Accuracy to reach: predicted u95 in mm, mean over the region. As "
                                "many touches as it takes; where the most allowed do not reach it, "
                                "what remains is named, with the joint and its angles")
                   ->check(between(0.01, 10.0));
  command->add_option(
      "--last", given->last,
      "Previous calibration of this arm: the transmission errors that it learnt are "
      "known to the choice of touches");
  command->add_option("--check", given->check, "Held-out touches, to check the result")
      ->check(between(0, 2000))
      ->capture_default_str();
  command
      ->add_option("--region", given->region,
                   "Where accuracy matters: workspace, targets (150 mm around them), tcp, or "
                   "box:X,Y,Z,X,Y,Z (mm, two corners)")
      ->capture_default_str();
  command
      ->add_option("--program", given->programs,
                   "KRL program (.src) whose points are the region; may be repeated")
      ->excludes("--region");
  command->add_option("--config", given->controller,
                      "The controller's $config.dat with the program's tools and bases; also "
                      "$machine.dat; may be repeated");
  for (CLI::Option* one : add_leave_and_still(*command, *given)) one->needs("--program");
  command
      ->add_option(
          "--from", given->from_deg,
          "Joint angles where the session begins, A1,A2,... in deg; of a linear unit, which comes "
          "first, mm [chosen by the plan]")
      ->delimiter(',');
  command->add_option("--picture", given->picture,
                      "Draw arm, cell and touches from above and from the side (SVG)");
  command->add_option("--seed", given->seed, "Seed of the plan: same seed, same plan")
      ->capture_default_str();
  add_output(*command, given->output, "Write the plan to this file (CSV) [standard output]");
  add_json(*command, given->json, "Write JSON");
  add_language(*command);
  CLI::Option* const suggested = command->add_option(
      "--suggest-spheres", given->suggest_spheres,
      "In place of a plan: places for so many spheres that serve the region, and the predicted "
      "accuracy beside today's [4]");
  suggested->expected(0, 1)->default_str("4")->check(between(1, 12))->excludes(goal);
  command->callback([=, &status] {
    if (touches->count() == 0 && goal->count() == 0)
      throw CLI::RequiredError(suggested->count() > 0 ? "--touches" : "--touches (or --goal)");
    status = plan(*given);
  });
}

void add_kuka_files(CLI::App& app, int& status) {
  const auto [command, given] = add_command<KukaFilesCommand>(
      app, status, "kuka-files",
      "Write or check the files that a KUKA controller needs for RSI or EKI",
      "They are made from [rsi] or [eki], and [controller], of the daemon's configuration. How "
      "to\ninstall them, and what to check before the first motion: "
      "drivers/kuka/krl/README.md.\nExample: cellcal kuka-files --config cellcald.toml -o "
      "krc --cell cell.toml\n         cellcal kuka-files --config cellcald.toml --verify "
      "backup.zip",
      [](const KukaFilesCommand& wanted) {
        if (wanted.output.empty() && wanted.verify.empty()) {
          throw CLI::RequiredError("--output (or --verify)");
        }
        return kuka_files(wanted);
      });
  command->add_option("--config", given->config, "The daemon's configuration")
      ->capture_default_str();
  CLI::Option* output = add_output(*command, given->output, "Write the files to this folder");
  command
      ->add_option(
          "--verify", given->verify,
          "Write nothing; compare the installed or edited files in this folder or backup (folder, ZIP) "
          "with the configuration and list what is wrong")
      ->excludes(output);
  command->add_option(
      "--cell", given->cell,
      "Cell file: RSI's program keeps the axes within the ranges of its robot, too");
  command->add_option("--wire", given->wire, "rsi or eki [the configuration's backend]")
      ->check(one_of({"rsi", "eki"}));
  add_json(*command, given->json, "Print the written files and their places as JSON");
}

void add_ends(CLI::App& command, CLI::Option& urdf, calib::UrdfEnds& ends) {
  command.add_option("--tip", ends.tip, "Its link at the flange [tool0, flange, or the last]")
      ->needs(&urdf);
  command
      .add_option("--root", ends.root,
                  "Its link that is the arm's base [its first, or that fixed to \"world\"]")
      ->needs(&urdf);
}

void add_export_robot(CLI::App& app, int& status) {
  const auto [command, given] = add_command<ExportRobotCommand>(
      app, status, "export-robot",
      "Write the calibrated arm for other programs: URDF, ROS, DH table, JSON, KUKA machine data",
      "URDF, YAML and DH table hold the nearest rigid links; what these leave out of compliance, gears and bending is "
      "printed in mm. A positioner\nis a second chain from the base, a linear unit a prismatic joint in the direction found; the DH table has the "
      "arm alone.\n"
      "Exit status 3: the calibration was withheld; nothing is written without "
      "--withheld.\nExample: cellcal export-robot --calibration calibration.json --urdf "
      "kr5.urdf -o kr5_calibrated.urdf\n         cellcal export-robot --calibration "
      "calibration.json --as dh -o dh.csv",
      [](const ExportRobotCommand& wanted) {
        if (!wanted.urdf.empty() && wanted.as != "urdf" && wanted.as != "yaml")
          throw CLI::ValidationError("--urdf", "goes with --as urdf or --as yaml");
        return export_robot(wanted);
      });
  command->add_option("--calibration", given->calibration, "Calibration (JSON)")->required();
  command
      ->add_option(
          "--as", given->as,
          "urdf; yaml: frames of the joints for ROS 2 drivers; dh: Denavit-Hartenberg "
          "parameters (CSV); json: all parameters; kuka: a positioner's frames for the machine data, "
          "$ETn_TA1KR or the root point, and the turn of the foot on a linear unit")
      ->check(one_of({"urdf", "yaml", "dh", "json", "kuka"}))
      ->capture_default_str();
  CLI::Option* urdf = command->add_option(
      "--urdf", given->urdf,
      "Put the calibrated joints into this URDF: links, meshes and names stay [a new one]");
  add_ends(*command, *urdf, given->ends);
  add_withheld(*command, given->withheld);
  add_output(*command, given->output, "Write to this file [standard output]");
}

void add_import_robot(CLI::App& app, int& status) {
  const auto [command, given] = add_command<ImportRobotCommand>(
      app, status, "import-robot",
      "Make a robot file from a KUKA controller's machine data, or a URDF",
      "Machine data: $machine.dat and $robcor.dat of KRC:\\R1\\Mada, $config.dat of KRC:\\R1\\System, $option.dat "
      "and\n$custom.dat of KRC:\\STEU\\Mada (absolute accuracy alone), or the backup that has them, as a folder or ZIP "
      "archive.\nGeometry, limits, speeds, gear ratios and mounting ($ROBROOT) come from them. Where the geometry is another\n"
      "file's, lengths, limits and mounting that differ are named; joints that count their angles otherwise than the\n"
      "controller are refused. Tools, loads and bases of $config.dat are printed; 'cellcal new-cell --machine-data'\n"
      "makes robot and cell file in one, and --cell FILE --tool N puts TOOL_DATA[N] with its LOAD_DATA into the [tool]\n"
      "of a cell file, which is kept as FILE.before. A linear unit that carries the arm ($EX_KIN with #ERSYS) becomes the\n"
      "first joint; its max_speed_mm_s has to be added. A .xacro is expanded by xacro where that is installed.\n"
      "Example: cellcal import-robot --machine-data backup.zip -o my_arm.toml\n"
      "         cellcal import-robot --robot kr5_r1400 --machine-data '$machine.dat' -o my_kr5.toml\n"
      "         cellcal import-robot --urdf robot.urdf -o robot.toml\n"
      "         cellcal import-robot --machine-data backup.zip --cell cell.toml --tool 3",
      [](const ImportRobotCommand& wanted) {
        if (wanted.urdf.empty() && wanted.robot.empty() && wanted.machine_data.empty())
          throw CLI::RequiredError("--machine-data (or --urdf, or --robot)");
        return import_robot(wanted);
      });
  CLI::Option* urdf = command->add_option("--urdf", given->urdf, "Geometry from this URDF");
  command
      ->add_option("--robot", given->robot,
                   "Geometry from this robot file, or a shipped robot by its name")
      ->excludes(urdf);
  add_ends(*command, *urdf, given->ends);
  command
      ->add_option("--xacro-arg", given->xacro_arguments,
                   "Argument of a .xacro, NAME:=VALUE; may be repeated")
      ->check([](const std::string& text) {
        const bool named = text.find(":=") != std::string::npos && text[0] != '-' && text[0] != ':';
        return named ? std::string() : "'" + text + "' is not NAME:=VALUE";
      })
      ->needs(urdf);
  command->add_option("--machine-data", given->machine_data,
                      "File of the controller, or its backup (folder, ZIP); may be repeated");
  add_output(*command, given->output, "Write the robot to this file [standard output]");
  CLI::Option* tool = command->add_option("--tool", given->tool, "Number of TOOL_DATA for --cell")
                          ->check(between(1, 1000));
  command
      ->add_option("--cell", given->cell, "Cell file to set; then no robot is written without -o")
      ->needs(tool);
  tool->needs(command->get_option("--cell"))->needs(command->get_option("--machine-data"));
}

void add_doctor(CLI::App& app, int& status) {
  const auto [command, given] = add_command(
      app, status, "doctor",
      "Check everything between this computer and the cell, without moving the arm",
      "Checks configuration, files, daemon, real-time rights, contact sensor and the "
      "controller's\nlink, in this order. Each line is ok, warning, FAILED or skipped, with "
      "what to do. Over RSI\nall corrections are zero and Stop ends the RSI session; over EKI "
      "nothing is commanded. While\na session runs, the daemon's own figures are shown.\nExit "
      "status 0: nothing FAILED; there may be warnings. 1: something FAILED.\nExample: cellcal "
      "doctor --config /etc/cellcal/cellcald.toml --cell cell.toml",
      doctor);
  command->add_option("--config", given->config, "The daemon's configuration")
      ->capture_default_str();
  command->add_option("--cell", given->cell, "Cell file (TOML): robot, axis limits");
  command->add_option(
      "--files", given->files,
      "Check the controller's files in this folder or backup, as 'kuka-files --verify'");
  command->add_option("--wait", given->wait_s, "Seconds to wait for the controller's first packet")
      ->check(between(0.5, 600.0))
      ->capture_default_str();
  command->add_option("--for", given->observe_s, "Seconds to observe the links")
      ->check(between(1.0, 3600.0))
      ->capture_default_str();
  add_language(*command, given->language);
  add_json(*command, given->json);
}

void add_robots(CLI::App& app, int& status) {
  const auto [command, given] = add_command(
      app, status, "robots", "List the robots that a cell file may name",
      "Reach: from the axis of A1 to the wrist centre, the arm stretched. Own robot files are in the folder of the\n"
      "cell file, which names them by path, or in the folder that CELLCAL_ROBOTS names, which is searched before "
      "the\nshipped ones. The places are printed behind the list.\nExample: cellcal robots",
      robots);
  add_json(*command, given->json);
}

void add_learn(CLI::App& priors, int& status) {
  const auto [command, given] = add_command(
      priors, status, "learn",
      "Learn from published calibrations how far the arms of a model lie from their nominal geometry",
      "Calibrations (JSON), or directories of them and of what 'cellcal export' wrote, which name the arm by its "
      "serial\nnumber. Each arm counts once. Withheld calibrations, other models and arms that do not fit with the "
      "others are set\naside, and each is named. Exit status 1: too few arms, or not one population.\nExample: cellcal "
      "priors learn calibrations -o priors.toml",
      learn_priors);
  command->add_option("FROM", given->from, "Calibrations, or directories of them")
      ->required()
      ->check(CLI::ExistingPath);
  command->add_option(
      "--robot", given->robot,
      "The nominal geometry, with tolerances that few arms do not overrule: robot file or shipped robot [that of "
      "most calibrations]");
  command->add_option("--after", given->after,
                      "Earlier priors of the model: the version counts on");
  add_output(*command, given->output, "Write the priors to this file (TOML) [standard output]");
  add_json(*command, given->json, "Print priors and what was set aside as JSON");
}

void add_show_priors(CLI::App& priors, int& status) {
  const auto [command, given] =
      add_command(priors, status, "show", "Print a file of priors",
                  "Example: cellcal priors show priors.toml", show_priors);
  command->add_option("FILE", given->file, "Priors (TOML)")->required();
  add_json(*command, given->json);
}

void add_accept(CLI::App& priors, int& status) {
  const auto [command, given] = add_command(
      priors, status, "accept",
      "Write a robot file with the tolerances of its fleet; print each old and new value",
      "Nothing else of the robot changes; the input file is left unchanged. Priors of another nominal geometry are\n"
      "refused. The new file is used where a cell file names it.\nExample: cellcal priors accept priors.toml --robot "
      "kr5_r1400 -o my_kr5.toml",
      accept_priors);
  command->add_option("FILE", given->file, "Priors (TOML)")->required();
  command->add_option("--robot", given->robot, "Robot file, or a shipped robot by its name")
      ->required();
  add_output(*command, given->output, "Write the robot to this file")->required();
  add_json(*command, given->json, "Print the changes as JSON");
}

/// Options for sending frames to the controller and restoring old values.
void add_sending(CLI::App* command, CLI::Option* calibration, SendFrames& sending) {
  auto* send = command->add_flag("--send", sending.send, "Set the frames on the controller");
  auto* confirm = command->add_flag(
      "--confirm", sending.confirm,
      "With --send or --restore: do not ask. Every point taught in a frame moves with it");
  auto* sent = command->add_flag("--sent", sending.list,
                                 "List the frames sent to the controller, with the result");
  auto* restore = command
                      ->add_option("--restore", sending.restore,
                                   "Set the old values that this number of --sent replaced")
                      ->check(between(1, 1000000000));
  command
      ->add_flag("--other-calibration", sending.other_calibration,
                 "With --send: also a calibration that is not the one in use on the daemon")
      ->needs(send);
  send->needs(calibration)->excludes(sent)->excludes(restore);
  sent->excludes(calibration)->excludes(confirm);
  restore->excludes(calibration)->excludes(sent);
}

}  // namespace

void add_offline_commands(CLI::App& app, int& status) {
  add_identify(app, status);
  add_predict(app, status);
  add_correct(app, status);
  add_frames(app, status);
  add_mastering(app, status);
  add_relate(app, status);
  add_plan(app, status);
  add_kuka_files(app, status);
  add_robots(app, status);
  add_export_robot(app, status);
  add_import_robot(app, status);
  add_doctor(app, status);
}

void add_priors_commands(CLI::App& app, int& status) {
  CLI::App* priors = app.add_subcommand(
      "priors", "Learn tolerances of a robot model from its arms' calibrations, and use them");
  priors->footer(
      "Example: cellcal priors learn calibrations -o priors.toml\n         cellcal priors show priors.toml\n         "
      "cellcal priors accept priors.toml --robot kr5_r1400 -o my_kr5.toml");
  priors->require_subcommand(1);
  add_learn(*priors, status);
  add_show_priors(*priors, status);
  add_accept(*priors, status);
}

void add_correct(CLI::App& app, int& status) {
  const auto [command, given] = add_command<CorrectCommand>(
      app, status, "correct", "Correct poses or KRL programs for the real arm",
      "--poses: joint angles that bring the real TCP to each pose, in the configuration and turns "
      "of the\nfile's joint columns; without joint columns: nearest to the previous row. If one "
      "pose is not reached,\nno CSV is written.\n--program: the taught points of a KRL program, "
      "changed so that the controller brings the real TCP\nto them; nothing else of the files "
      "changes. For points from a drawing: what was touched up\nwith this arm is right already "
      "(--leave). Lines that cannot be corrected are listed; then nothing\nis written. Run the "
      "corrected program in T1 first.\nKeep the originals: after the next calibration correct them again, or the corrected "
      "programs with --from and\nthe calibration that they were corrected with. A second correction is refused where the "
      "record\nNAME.corrected.json (of a backup cellcal.corrected.json) is in the program's folder; a copy from the\n"
      "controller has none, and would be corrected twice.\n--backup: all programs of a controller together, with points that "
      "several of them or $config.dat have. A module with\na line that cannot be corrected stays as it "
      "is, and with it those that share a point with it; the changed files are\nwritten, and the refusals printed.\n--at-run-time: instead of the points, the motions of --program or "
      "--backup are rewritten (LIN XP1\nbecomes LIN CC_FIX(XP1)), and the module cellcal_fix.src/.dat is "
      "written, which corrects every point while the\nprogram runs: computed and shifted ones, too. It holds "
      "the arm where robot, tool or calibration are others;\nCC_FIX_ON=FALSE turns it off. --restore takes "
      "the motions of a .src back.\nExit status 3: the calibration was withheld, the program moves and has no point to "
      "correct, or a module that\nmoves was refused and the others are written; 1: a refused --program, or at run time nothing but refused "
      "modules.\nA program or backup without a motion is 0, offline and at run time: nothing is to be corrected.\nExample: "
      "cellcal correct --calibration calibration.json --poses poses.csv -o joints.csv\n         "
      "cellcal correct --calibration calibration.json --program weld.src --config '$config.dat' -o "
      "corrected\n         cellcal correct --calibration calibration.json --backup backup.zip -o "
      "corrected\n         cellcal correct --calibration calibration.json --program weld.src --at-run-time "
      "--serial 123456 --config '$config.dat' -o corrected",
      [](const CorrectCommand& wanted) {
        if (wanted.restore.empty() && wanted.calibration.empty())
          throw CLI::RequiredError("--calibration");
        if (wanted.restore.empty() && wanted.poses.empty() && wanted.program.empty() &&
            wanted.backup.empty())
          throw CLI::RequiredError("--poses (or --program, or --backup)");
        return correct(wanted);
      });
  CLI::Option* calibration =
      command->add_option("--calibration", given->calibration, "Calibration (JSON)");
  CLI::Option* poses =
      command->add_option("--poses", given->poses, "Poses of the TCP in the base frame (CSV)");
  command
      ->add_option(
          "--on", given->on,
          "Axis of the positioner that carries the frame of the poses, with its angles in columns "
          "E1,E2 [the base frame]")
      ->needs(poses);
  CLI::Option* program =
      command->add_option("--program", given->program, "KRL program (.src)")->excludes(poses);
  command
      ->add_option("--backup", given->backup,
                   "All KRL programs of a controller: its backup (folder, ZIP)")
      ->excludes(poses)
      ->excludes(program);
  command->add_option("--dat", given->dat, "Its points (.dat) [same folder]")->needs(program);
  command
      ->add_option(
          "--config", given->controller,
          "The controller's $config.dat with its tools and bases, where a backup lacks it, too; also $machine.dat, and "
          "of a program .src files with routines that it calls (those of its folder are read unasked); may be "
          "repeated")
      ->excludes(poses);
  for (CLI::Option* one : add_leave_and_still(*command, *given)) one->excludes(poses);
  command
      ->add_flag("--anywhere", given->anywhere,
                 "Also points far from the targets, where the calibration does not hold")
      ->excludes(poses);
  CLI::Option* from =
      command
          ->add_option("--from", given->from,
                       "Calibration of the arm that the points were taught on: before "
                       "its repair, or another of the type; or that programs were corrected with")
          ->excludes(poses);
  command
      ->add_flag("--upload", given->upload,
                 "Points that were touched up with this arm become those of the offline system")
      ->excludes(poses)
      ->excludes(from);
  CLI::Option* at_run_time =
      command
          ->add_flag("--at-run-time", given->at_run_time,
                     "Correct while the program runs, by CELLCAL_FIX on the controller")
          ->excludes(poses)
          ->excludes(from)
          ->excludes(command->get_option("--upload"));
  command->add_option("--serial", given->serial, "Serial number of the robot ($KR_SERIALNO)")
      ->check(between(1, 2147483647))
      ->needs(at_run_time);
  command
      ->add_option(
          "--restore", given->restore,
          "A .src of --at-run-time, whose motions become what they were, in the folder of -o")
      ->excludes(calibration)
      ->excludes(poses)
      ->excludes(program)
      ->excludes(command->get_option("--config"));
  command->add_flag("--force", given->force, "Replace files of the same names in the folder of -o")
      ->excludes(poses);
  command
      ->add_flag(
          "--nominal-controller", given->nominal_controller,
          "The controller computes with the robot file's model of the arm when the programs "
          "run, although its files state absolute accuracy or other lengths, or another model was found")
      ->excludes(poses);
  add_withheld(*command, given->withheld);
  add_output(*command, given->output,
             "Poses: write to this file [standard output]; programs: to this folder");
  add_json(*command, given->json, "Write JSON");
  add_language(*command);
}

void add_frames(CLI::App& app, int& status) {
  auto given = std::make_shared<FramesCommand>();
  auto sending = std::make_shared<SendFrames>();
  CLI::App* command =
      app.add_subcommand("frames", "Compute tool and base frames for a KUKA controller");
  command->footer(
      "Prints the lines of $config.dat, and with -o writes a KRL program that sets them; the old "
      "values\nare in its comments. Tool: the cell file's, as identified. Base: from "
      "three\ntargets: origin, one on +x, one on the side of +y.\n--send sets the frames on the controller, over EKI and "
      "through the daemon, where [eki] write_frames = true\nallows it: old and new values are "
      "shown, and each is confirmed; nothing moves. --restore sets old values\nagain.\nExit status "
      "3: the calibration was withheld.\nExample: cellcal frames --calibration calibration.json "
      "--config '$config.dat' --tool 1 --base 3=S1,S2,S3 -o cellcal_frames.src");
  auto daemon = add_connection(command);
  auto* calibration =
      command->add_option("--calibration", given->calibration, "Calibration (JSON)");
  command->add_option("--config", given->controller,
                      "The controller's $config.dat, for the old values; also $machine.dat; may be "
                      "repeated");
  command->add_option("--tool", given->tool, "Number of TOOL_DATA that is the cell file's tool")
      ->check(between(1, 128));
  command
      ->add_option("--base", given->bases,
                   "Number of BASE_DATA and its targets, as 3=S1,S2,S3; may be repeated")
      ->check(CLI::Validator(
          [](std::string& text) {
            return is_base(text) ? std::string() : "\"" + text + "\" is not like 3=S1,S2,S3";
          },
          "N=ID,ID,ID"));
  add_withheld(*command, given->withheld);
  add_output(*command, given->output,
             "Write the KRL program to this file (.src), whose name it bears");
  add_sending(command, calibration, *sending);
  command->callback([given, sending, daemon, calibration, &status] {
    given->json = daemon->json;
    if (sending->list) {
      status = list_sent_frames(*daemon);
    } else if (sending->restore > 0) {
      status = restore_frame(*daemon, *sending);
    } else if (calibration->empty()) {
      throw CLI::RequiredError("--calibration, --sent or --restore");
    } else {
      status = sending->send ? send_frames(*daemon, *given, *sending) : frames(*given);
    }
  });
}

}  // namespace cellcal::daemon
