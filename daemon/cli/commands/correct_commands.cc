#include <CLI/CLI.hpp>
#include <memory>

#include "daemon/cli/commands/commands.h"
#include "daemon/cli/commands/connection_options.h"
#include "daemon/cli/frames_sent.h"
#include "daemon/cli/offline/correct.h"
#include "daemon/cli/offline/frames.h"

namespace cellcal::daemon {

void add_correct(CLI::App& app, int& status) {
  auto given = std::make_shared<CorrectCommand>();
  CLI::App* command =
      app.add_subcommand("correct", "Correct poses or a KRL program for the real arm");
  command->footer(
      "--poses: joint angles that bring the real TCP to each pose, in the configuration and turns "
      "of the\nfile's joint columns; without joint columns: nearest to the previous row. If one "
      "pose is not reached,\nno CSV is written.\n--program: the taught points of a KRL program, "
      "changed so that the controller brings the real TCP\nto them; nothing else of the files "
      "changes. For points from a drawing: what was touched up\nwith this arm is right already "
      "(--leave). Lines that cannot be corrected are listed; then nothing\nis written. Run the "
      "corrected program in T1 first.\nExit status 3: the calibration was withheld.\nExample: "
      "cellcal correct --calibration calibration.json --poses poses.csv -o joints.csv\n         "
      "cellcal correct --calibration calibration.json --program weld.src --config '$config.dat' -o "
      "corrected");
  command->add_option("--calibration", given->calibration, "Calibration (JSON)")->required();
  CLI::Option* poses =
      command->add_option("--poses", given->poses, "Poses of the TCP in the base frame (CSV)");
  CLI::Option* program =
      command->add_option("--program", given->program, "KRL program (.src)")->excludes(poses);
  command->add_option("--dat", given->dat, "Its points (.dat) [same folder]")->needs(program);
  command
      ->add_option(
          "--config", given->controller,
          "The controller's $config.dat with its tools and bases; also $machine.dat; may be "
          "repeated")
      ->needs(program);
  command->add_option("--leave", given->leave, "Points that stay as they are: NAME,NAME")
      ->delimiter(',')
      ->needs(program);
  command
      ->add_flag("--anywhere", given->anywhere,
                 "Also points far from the targets, where the calibration does not hold")
      ->needs(program);
  command->add_flag("--force", given->force, "Replace files of the same names in the folder of -o")
      ->needs(program);
  command->add_flag("--withheld", given->withheld,
                    "Accept a withheld calibration, for inspection only");
  command->add_option("-o,--output,--out", given->output,
                      "Poses: write to this file [standard output]; program: to this folder");
  command->add_flag("--json", given->json, "Write JSON");
  command->callback([given, &status] {
    if (given->poses.empty() && given->program.empty())
      throw CLI::RequiredError("--poses (or --program)");
    status = correct(*given);
  });
}

namespace {

/// What frames are sent to the controller, and which old values are set again.
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
                      ->check(CLI::Range(1, 1000000000));
  command
      ->add_flag("--other-calibration", sending.other_calibration,
                 "With --send: also a calibration that is not the one in use on the daemon")
      ->needs(send);
  send->needs(calibration)->excludes(sent)->excludes(restore);
  sent->excludes(calibration)->excludes(confirm);
  restore->excludes(calibration)->excludes(sent);
}

}  // namespace

void add_frames(CLI::App& app, int& status) {
  auto given = std::make_shared<FramesCommand>();
  auto sending = std::make_shared<SendFrames>();
  CLI::App* command = app.add_subcommand(
      "frames", "Compute tool and base frames for a KUKA controller; propose mastering offsets");
  command->footer(
      "Prints the lines of $config.dat, and with -o writes a KRL program that sets them; the old "
      "values\nare in its comments. Tool: the cell file's, as identified. Base: from "
      "three\ntargets: origin, one on +x, one on the side of +y. Mastering offsets are printed "
      "with a warning\nand never written.\n--send sets the frames on the controller, over EKI and "
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
      ->check(CLI::Range(1, 128));
  command
      ->add_option("--base", given->bases,
                   "Number of BASE_DATA and its targets, as 3=S1,S2,S3; may be repeated")
      ->check(CLI::Validator(
          [](std::string& text) {
            return is_base(text) ? std::string() : "\"" + text + "\" is not like 3=S1,S2,S3";
          },
          "N=ID,ID,ID"));
  command->add_flag("--withheld", given->withheld,
                    "Accept a withheld calibration, for inspection only");
  command->add_option("-o,--output,--out", given->output,
                      "Write the KRL program to this file (.src)");
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
