// Verification of EKI's set: the channel file against the one generated from the configuration.

#include <algorithm>

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_findings.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers {
namespace {

constexpr const char* kChannel = "CellcalEki.xml";

const EkiElement* find(const std::vector<EkiElement>& list, const std::string& tag) {
  for (const EkiElement& one : list) {
    if (one.tag == tag) return &one;
  }
  return nullptr;
}

void compare(const EkiChannelFile& file, const EkiChannelFile& wanted, krl::Findings& findings) {
  const auto same_text = [&](const char* what, const Placed<std::string>& have,
                             const Placed<std::string>& want, const char* why) {
    if (wire::same_name(have.value, want.value)) return;
    findings.refuse(file.name, have.line, "{} is \"{}\". Set \"{}\"{}", what, have.value,
                    want.value, why);
  };
  same_text("EXTERNAL/TYPE", file.external_type, wanted.external_type,
            ": the controller is the server");
  same_text("ENVIRONMENT", file.environment, wanted.environment,
            ": with Program the channel closes when the program is reset");
  same_text("BUFFERING Mode", file.buffering_mode, wanted.buffering_mode,
            ": telegrams have to be read in order");
  same_text("PROTOCOL", file.protocol, wanted.protocol, "");
  same_text("IP", file.ip, wanted.ip, " as in [eki] address");
  if (file.port.value != wanted.port.value) {
    findings.refuse(file.name, file.port.line, "PORT is {}, [eki] port is {}", file.port.value,
                    wanted.port.value);
  }
  if (file.buffer_limit.value < wanted.buffer_limit.value) {
    findings.refuse(file.name, file.buffer_limit.line,
                    "BUFFERING Limit is {}. Set at least {}: when a buffer is full, EKI closes "
                    "the connection",
                    file.buffer_limit.value, wanted.buffer_limit.value);
  }
  if (file.buffer_bytes.value < wanted.buffer_bytes.value) {
    findings.refuse(file.name, file.buffer_bytes.line,
                    "BUFFSIZE Limit is {}. Set at least {}: a telegram that does not fit is lost",
                    file.buffer_bytes.value, wanted.buffer_bytes.value);
  }
  if (file.alive_flag.value != wanted.alive_flag.value) {
    findings.refuse(file.name, file.alive_flag.line,
                    "ALIVE Set_Flag is {}, [controller] alive_flag is {}: the programs would "
                    "monitor the wrong flag",
                    file.alive_flag.value, wanted.alive_flag.value);
  }
}

void compare(const std::string& file, const char* direction, const std::vector<EkiElement>& have,
             const std::vector<EkiElement>& want, krl::Findings& findings) {
  for (const EkiElement& one : want) {
    const EkiElement* found = find(have, one.tag);
    if (found == nullptr) {
      findings.refuse(file, 0, "{}: the element {} is missing", direction, one.tag);
    } else if (found->type != one.type) {
      findings.refuse(file, found->line, "{}: Type of {} is \"{}\". Set \"{}\"", direction, one.tag,
                      found->type, one.type);
    }
  }
  for (const EkiElement& one : have) {
    if (find(want, one.tag) == nullptr) {
      findings.warn(file, one.line, "{}: element {} is not used", direction, one.tag);
    }
  }
}

}  // namespace

std::vector<FileFinding> verify_eki_files(const ControllerFiles& files,
                                          const EkiFilesConfig& config) {
  const ControllerFiles expected = eki_files(config);
  krl::Findings findings;
  const krl::Candidates all = krl::by_kind(files, findings);
  const krl::Candidate* channel = krl::choose(all, ControllerFileKind::kEkiChannel, kChannel);
  if (channel == nullptr) {
    findings.refuse(kChannel, 0, "EthernetKRL's channel file is not in the folder");
    return findings.take();
  }
  if (!wire::same_name(channel->name, kChannel)) {
    findings.refuse(channel->name, 0,
                    "must be called {}: the file name is the channel's name, and the programs "
                    "open \"CellcalEki\"",
                    kChannel);
  }
  try {
    const EkiChannelFile file = read_eki_channel(*channel->text, channel->name);
    const EkiChannelFile wanted = read_eki_channel(expected.at(kChannel), kChannel);
    compare(file, wanted, findings);
    compare(file.name, "RECEIVE", file.receive, wanted.receive, findings);
    compare(file.name, "SEND", file.send, wanted.send, findings);
  } catch (const ConfigError& error) {
    findings.unreadable(error);
  }
  for (const auto& [name, text] : expected) {
    if (name != kChannel) krl::compare_program(files, name, text, findings);
  }
  return findings.take();
}

}  // namespace cellcal::drivers
