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
  const auto [command, given] = add_command(app, status, "identify", identify);
  command->add_option("--cell", given->cell)->required();
  command->add_option("--touches", given->touches)->required();
  add_output(*command, given->output);
  command->add_option("--last", given->last);
  command->add_flag("--accept-change", given->accept_change)->needs("--last");
  command->add_option("--method", given->method)
      ->check(one_of({"map", "plain", "paper"}))
      ->capture_default_str();
  add_json(*command, given->json);
  command->add_flag("--verbose", given->verbose);
  add_language(*command);
}

void add_predict(CLI::App& app, int& status) {
  const auto [command, given] = add_command(app, status, "predict", predict);
  command->add_option("--calibration", given->calibration)->required();
  command->add_option("--joints", given->joints)->required();
  command->add_flag("--nominal", given->nominal);
  command->add_option("--on", given->on);
  command->add_option("--load", given->load)->delimiter(',')->expected(1, 4);
  command->add_option("--tool", given->tool);
  add_withheld(*command, given->withheld);
  add_output(*command, given->output);
  add_json(*command, given->json);
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
  CLI::App* command = app.add_subcommand("plan");
  command->add_option("--cell", given->cell)->required();
  auto* touches = command->add_option("--touches", given->touches)->check(between(1, 2000));
  auto* goal = command->add_option("--goal", given->goal_mm)->check(between(0.01, 10.0));
  command->add_option("--last", given->last);
  command->add_option("--check", given->check)->check(between(0, 2000))->capture_default_str();
  command->add_option("--region", given->region)->capture_default_str();
  command->add_option("--program", given->programs)->excludes("--region");
  command->add_option("--config", given->controller);
  for (CLI::Option* one : add_leave_and_still(*command, *given)) one->needs("--program");
  command->add_option("--from", given->from_deg)->delimiter(',');
  command->add_option("--picture", given->picture);
  command->add_option("--seed", given->seed)->capture_default_str();
  add_output(*command, given->output);
  add_json(*command, given->json);
  add_language(*command);
  CLI::Option* const suggested = command->add_option("--suggest-spheres", given->suggest_spheres);
  suggested->expected(0, 1)->default_str("4")->check(between(1, 12))->excludes(goal);
  command->callback([=, &status] {
    if (touches->count() == 0 && goal->count() == 0)
      throw CLI::RequiredError(suggested->count() > 0 ? "--touches" : "--touches (or --goal)");
    status = plan(*given);
  });
}

void add_kuka_files(CLI::App& app, int& status) {
  const auto [command, given] =
      add_command<KukaFilesCommand>(app, status, "kuka-files", [](const KukaFilesCommand& wanted) {
        if (wanted.output.empty() && wanted.verify.empty()) {
          throw CLI::RequiredError("--output (or --verify)");
        }
        return kuka_files(wanted);
      });
  command->add_option("--config", given->config)->capture_default_str();
  CLI::Option* output = add_output(*command, given->output);
  command->add_option("--verify", given->verify)->excludes(output);
  command->add_option("--cell", given->cell);
  command->add_option("--wire", given->wire)->check(one_of({"rsi", "eki"}));
  add_json(*command, given->json);
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
      app, status, "export-robot", [](const ExportRobotCommand& wanted) {
        if (!wanted.urdf.empty() && wanted.as != "urdf" && wanted.as != "yaml")
          throw CLI::ValidationError("--urdf", "goes with --as urdf or --as yaml");
        return export_robot(wanted);
      });
  command->add_option("--calibration", given->calibration)->required();
  command->add_option("--as", given->as)
      ->check(one_of({"urdf", "yaml", "dh", "json", "kuka"}))
      ->capture_default_str();
  CLI::Option* urdf = command->add_option("--urdf", given->urdf);
  add_ends(*command, *urdf, given->ends);
  add_withheld(*command, given->withheld);
  add_output(*command, given->output);
}

void add_import_robot(CLI::App& app, int& status) {
  const auto [command, given] = add_command<ImportRobotCommand>(
      app, status, "import-robot", [](const ImportRobotCommand& wanted) {
        if (wanted.urdf.empty() && wanted.robot.empty() && wanted.machine_data.empty())
          throw CLI::RequiredError("--machine-data (or --urdf, or --robot)");
        return import_robot(wanted);
      });
  CLI::Option* urdf = command->add_option("--urdf", given->urdf);
  command->add_option("--robot", given->robot)->excludes(urdf);
  add_ends(*command, *urdf, given->ends);
  command->add_option("--xacro-arg", given->xacro_arguments)
      ->check([](const std::string& text) {
        const bool named = text.find(":=") != std::string::npos && text[0] != '-' && text[0] != ':';
        return named ? std::string() : "'" + text + "' is not NAME:=VALUE";
      })
      ->needs(urdf);
  command->add_option("--machine-data", given->machine_data);
  add_output(*command, given->output);
  CLI::Option* tool = command->add_option("--tool", given->tool)->check(between(1, 1000));
  command->add_option("--cell", given->cell)->needs(tool);
  tool->needs(command->get_option("--cell"))->needs(command->get_option("--machine-data"));
}

void add_doctor(CLI::App& app, int& status) {
  const auto [command, given] = add_command(app, status, "doctor", doctor);
  command->add_option("--config", given->config)->capture_default_str();
  command->add_option("--cell", given->cell);
  command->add_option("--files", given->files);
  command->add_option("--wait", given->wait_s)->check(between(0.5, 600.0))->capture_default_str();
  command->add_option("--for", given->observe_s)
      ->check(between(1.0, 3600.0))
      ->capture_default_str();
  add_language(*command, given->language);
  add_json(*command, given->json);
}

void add_robots(CLI::App& app, int& status) {
  const auto [command, given] = add_command(app, status, "robots", robots);
  add_json(*command, given->json);
}

void add_learn(CLI::App& priors, int& status) {
  const auto [command, given] = add_command(priors, status, "learn", learn_priors);
  command->add_option("FROM", given->from)->required()->check(CLI::ExistingPath);
  command->add_option("--robot", given->robot);
  command->add_option("--after", given->after);
  add_output(*command, given->output);
  add_json(*command, given->json);
}

void add_show_priors(CLI::App& priors, int& status) {
  const auto [command, given] = add_command(priors, status, "show", show_priors);
  command->add_option("FILE", given->file)->required();
  add_json(*command, given->json);
}

void add_accept(CLI::App& priors, int& status) {
  const auto [command, given] = add_command(priors, status, "accept", accept_priors);
  command->add_option("FILE", given->file)->required();
  command->add_option("--robot", given->robot)->required();
  add_output(*command, given->output)->required();
  add_json(*command, given->json);
}

/// Options for sending frames to the controller and restoring old values.
void add_sending(CLI::App* command, CLI::Option* calibration, SendFrames& sending) {
  auto* send = command->add_flag("--send", sending.send);
  auto* confirm = command->add_flag("--confirm", sending.confirm);
  auto* sent = command->add_flag("--sent", sending.list);
  auto* restore = command->add_option("--restore", sending.restore)->check(between(1, 1000000000));
  command->add_flag("--other-calibration", sending.other_calibration)->needs(send);
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
  CLI::App* priors = app.add_subcommand("priors");
  priors->require_subcommand(1);
  add_learn(*priors, status);
  add_show_priors(*priors, status);
  add_accept(*priors, status);
}

void add_correct(CLI::App& app, int& status) {
  const auto [command, given] =
      add_command<CorrectCommand>(app, status, "correct", [](const CorrectCommand& wanted) {
        if (wanted.restore.empty() && wanted.calibration.empty())
          throw CLI::RequiredError("--calibration");
        if (wanted.restore.empty() && wanted.poses.empty() && wanted.program.empty() &&
            wanted.backup.empty())
          throw CLI::RequiredError("--poses (or --program, or --backup)");
        return correct(wanted);
      });
  CLI::Option* calibration = command->add_option("--calibration", given->calibration);
  CLI::Option* poses = command->add_option("--poses", given->poses);
  command->add_option("--on", given->on)->needs(poses);
  CLI::Option* program = command->add_option("--program", given->program)->excludes(poses);
  command->add_option("--backup", given->backup)->excludes(poses)->excludes(program);
  command->add_option("--dat", given->dat)->needs(program);
  command->add_option("--config", given->controller)->excludes(poses);
  for (CLI::Option* one : add_leave_and_still(*command, *given)) one->excludes(poses);
  command->add_flag("--anywhere", given->anywhere)->excludes(poses);
  CLI::Option* from = command->add_option("--from", given->from)->excludes(poses);
  command->add_flag("--upload", given->upload)->excludes(poses)->excludes(from);
  CLI::Option* at_run_time = command->add_flag("--at-run-time", given->at_run_time)
                                 ->excludes(poses)
                                 ->excludes(from)
                                 ->excludes(command->get_option("--upload"));
  command->add_option("--serial", given->serial)->check(between(1, 2147483647))->needs(at_run_time);
  command->add_option("--restore", given->restore)
      ->excludes(calibration)
      ->excludes(poses)
      ->excludes(program)
      ->excludes(command->get_option("--config"));
  command->add_flag("--force", given->force)->excludes(poses);
  command->add_flag("--nominal-controller", given->nominal_controller)->excludes(poses);
  add_withheld(*command, given->withheld);
  add_output(*command, given->output);
  add_json(*command, given->json);
  add_language(*command);
}

void add_frames(CLI::App& app, int& status) {
  auto given = std::make_shared<FramesCommand>();
  auto sending = std::make_shared<SendFrames>();
  CLI::App* command = app.add_subcommand("frames");
  auto daemon = add_connection(command);
  auto* calibration = command->add_option("--calibration", given->calibration);
  command->add_option("--config", given->controller);
  command->add_option("--tool", given->tool)->check(between(1, 128));
  command->add_option("--base", given->bases)
      ->check(CLI::Validator(
          [](std::string& text) {
            return is_base(text) ? std::string() : "\"" + text + "\" is not like 3=S1,S2,S3";
          },
          "N=ID,ID,ID"));
  add_withheld(*command, given->withheld);
  add_output(*command, given->output);
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
