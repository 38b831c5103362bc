// Verification of RSI's set: channel against configuration, context against channel, program
// against both.

#include <algorithm>
#include <cstdlib>

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_findings.h"
#include "drivers/kuka/krl/krl_rsi.h"
#include "drivers/kuka/krl/krl_rsi_parts.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers {
namespace {

using krl::RsiSet;

constexpr int kVerifiedAxes = 6;
constexpr const char* kProgram = "cellcal_rsi.src";

const char* name_of(CorrectionMode mode) {
  return mode == CorrectionMode::kAbsolute ? "ABSOLUTE" : "RELATIVE";
}

// ---- ethernet XML ------------------------------------------------------------------------------

void check_config(const RsiSet& set) {
  const RsiChannelFile& file = set.channel;
  const RsiFilesConfig& c = set.config;
  const bool known = !c.pc_address.empty() && c.pc_address != "0.0.0.0";
  if (known && file.ip_number.value != c.pc_address) {
    set.findings.refuse(file.name, file.ip_number.line,
                        "IP_NUMBER is {}, this computer's address is {} ([controller] pc_address)",
                        file.ip_number.value, c.pc_address);
  } else if (!known) {
    set.findings.warn(file.name, file.ip_number.line,
                      "IP_NUMBER {} not compared: the configuration has no address of this "
                      "computer ([controller] pc_address, or bind of [rsi])",
                      file.ip_number.value);
  }
  if (file.port.value != c.port) {
    set.findings.refuse(file.name, file.port.line, "PORT is {}, [rsi] port is {}", file.port.value,
                        c.port);
  }
  if (file.sentype.value != c.sentype) {
    set.findings.refuse(file.name, file.sentype.line,
                        "SENTYPE is \"{}\", [rsi] sentype is \"{}\": the controller would "
                        "silently discard every reply",
                        file.sentype.value, c.sentype);
  }
  if (file.only_send.value) {
    set.findings.refuse(file.name, file.only_send.line,
                        "ONLYSEND is TRUE: the controller would ignore all corrections. Set FALSE");
  }
}

void check_sent(const RsiSet& set) {
  if (set.config.space.on && set.sent("DEF_RIst") == nullptr) {
    set.findings.warn(set.channel.name, 0,
                      "SEND: DEF_RIst is missing: a wrong $TOOL or $BASE would not be detected "
                      "before the arm moves");
  }
  for (const char* tag : {"DEF_AIPos", "DEF_ASPos", "DEF_Delay"}) set.check_internal(tag);
}

void check_received(const RsiSet& set) {
  for (int i = 1; i <= kVerifiedAxes; ++i) {
    const std::string tag = set.tag(i);
    const RsiElement* one = set.received(tag);
    if (one == nullptr) {
      set.findings.refuse(set.channel.name, 0, "RECEIVE: {} is missing ([rsi] {} = \"{}\")", tag,
                          set.config.space.on ? "cart_tag" : "axis_tag",
                          set.config.space.on ? set.config.space.tag : set.config.axis_tag);
      continue;
    }
    if (one->index == 0 || !wire::same_name(one->type, "DOUBLE")) {
      set.findings.refuse(set.channel.name, one->line,
                          "{} must have TYPE=\"DOUBLE\" and a channel number as its INDX", tag);
    }
    krl::check_hold(set, *one);
  }
  const RsiElement* stop = set.received(set.config.stop_tag);
  if (stop == nullptr) {
    set.findings.refuse(set.channel.name, 0,
                        "RECEIVE: {} is missing ([rsi] stop_tag): every session would end with "
                        "a fault. Add it",
                        set.config.stop_tag);
  } else if (stop->index == 0 || !wire::same_name(stop->type, "BOOL") ||
             stop->hold_on.value_or(true)) {
    set.findings.refuse(set.channel.name, stop->line,
                        "{} must have TYPE=\"BOOL\", a channel number as its INDX and HOLDON=\"0\"",
                        stop->tag);
  }
}

// ---- RSI 3's model of the context --------------------------------------------------------------

void compare_model(const RsiContextFile& context, const RsiContextFile& model,
                   krl::Findings& findings) {
  for (const RsiObject& one : context.objects) {
    const auto drawn = std::find_if(model.objects.begin(), model.objects.end(),
                                    [&](const RsiObject& other) { return other.id == one.id; });
    if (drawn == model.objects.end()) {
      findings.warn(model.name, 0,
                    "does not have {}, which {} has: it would be lost when RSI-Visual saves",
                    one.id, context.name);
      continue;
    }
    for (const RsiInput& input : one.inputs) {
      const RsiInput* other = drawn->input(input.index);
      if (other != nullptr && other->from == input.from && other->from_index == input.from_index)
        continue;
      if (other != nullptr && other->from == input.from && other->from_index == 0) {
        findings.warn(model.name, other->line,
                      "{}: input {} comes from an output with another name; not checked "
                      "whether it is Out{}",
                      one.id, input.index, input.from_index);
        continue;
      }
      findings.warn(model.name, drawn->line, "{}: input {} is connected differently in {}", one.id,
                    input.index, context.name);
    }
    for (const RsiParameter& parameter : one.parameters) {
      const RsiParameter* other = drawn->parameter(parameter.name);
      double have = 0.0, want = 0.0;
      if (other == nullptr || !wire::parse_number(other->value, have) ||
          !wire::parse_number(parameter.value, want) || have == want) {
        continue;
      }
      findings.warn(model.name, other->line, "{} of {} is {}, in {} it is {}", parameter.name,
                    one.id, have, context.name, want);
    }
  }
}

void check_unit(const krl::Candidates& files, const RsiContextFile& context,
                krl::Findings& findings) {
  const std::string stem = context.name.substr(0, context.name.size() - std::string(".xml").size());
  const krl::Candidate* model = choose(files, ControllerFileKind::kRsiModel, stem);
  if (model == nullptr ||
      choose(files, ControllerFileKind::kRsiDiagram, stem + ".diagram") == nullptr)
    findings.refuse(context.name, 0,
                    "{0} and {0}.diagram are missing: RSI 3 needs the three together", stem);
  if (model == nullptr) return;
  compare_model(context, read_rsi_model(*model->text, model->name), findings);
}

// ---- program -----------------------------------------------------------------------------------

/// HALT stops until the next start, which continues with the following line.
void check_ends(const std::string& name, const std::string& text, krl::Findings& findings) {
  std::string before;
  for (const auto& [line, number] : krl::statements(text)) {
    if (line == "HALT" && before.starts_with("IF") && before.find("RSIOK") != std::string::npos) {
      findings.refuse(
          name, number,
          "HALT after a failed call of RSI: the next start continues without a context. "
          "Write LOOP, HALT, ENDLOOP");
    }
    before = line;
  }
}

/// A call unknown to the release prevents the selection of the program.
void check_calls(const std::string& name, const std::string& text, const RsiFilesConfig& config,
                 krl::Findings& findings) {
  const bool six = config.rsi_version == 6;
  const krl::RsiCalls& others = six ? krl::kCallsToRsi5 : krl::kCallsOfRsi6;
  for (const auto& [line, number] : krl::statements(text)) {
    for (const char* call : {others.load, others.on, others.set}) {
      if (krl::find_call(line, call) == std::string::npos) continue;
      findings.refuse(name, number,
                      "{} is a call of RSI {}, [controller] rsi_version is {}. Make the files "
                      "again",
                      call, six ? "3 to 5" : "6", config.rsi_version);
    }
  }
}

void check_program(const ControllerFiles& files, const RsiFilesConfig& config, CorrectionMode mode,
                   krl::Findings& findings) {
  bool on = false;
  const char* const turns_on = krl::calls_of(config).on;
  for (const auto& [name, text] : files) {
    if (!name.ends_with(".src") && !name.ends_with(".SRC")) continue;
    if (config.space.on) krl::check_frames(name, text, config, findings);
    if (!config.space.on) krl::check_fence(name, text, config, findings);
    check_ends(name, text, findings);
    check_calls(name, text, config, findings);
    for (const auto& [line, number] : krl::statements(text)) {
      const std::size_t at = krl::find_call(line, turns_on);
      if (at != std::string::npos) {
        on = true;
        const std::string wanted = fmt::format("#{}", name_of(mode));
        if (line.find(wanted, at) == std::string::npos) {
          findings.refuse(name, number,
                          "{} does not contain {}, the mode of this computer, which HOLDON "
                          "has to match",
                          turns_on, wanted);
        }
      }
      if (krl::find_call(line, krl::calls_of(config).load) == std::string::npos) continue;
      const bool extended = wire::lower(line).find(".rsi\"") != std::string::npos;
      if (extended == (config.rsi_version == 3)) continue;
      findings.refuse(name, number,
                      "{} {} the extension .rsi: RSI {} {} it, otherwise the "
                      "file is not found",
                      krl::calls_of(config).load, extended ? "names" : "lacks", config.rsi_version,
                      extended ? "adds" : "needs");
    }
  }
  if (!on) {
    findings.warn(kProgram, 0,
                  "no program with {} in the folder: its mode and HOLDON were not compared",
                  turns_on);
  }
  RsiFilesConfig wanted = config;
  wanted.mode = mode;
  wanted.pc_address = "10.0.0.1";  // not in the program
  krl::compare_program(files, kProgram, rsi_files(wanted).at(kProgram), findings,
                       krl::leave_out_limits);
}

std::optional<RsiContextFile> find_context(const krl::Candidates& files,
                                           const RsiFilesConfig& config, krl::Findings& findings) {
  const std::string usual = config.rsi_version == 3 ? "cellcal_rsi.rsi.xml" : "cellcal_rsi.rsix";
  const krl::Candidate* chosen = choose(files, ControllerFileKind::kRsiContext, usual);
  if (chosen == nullptr) {
    findings.refuse(usual, 0, "{}",
                    files.contains(ControllerFileKind::kRsiContext)
                        ? "there are several contexts, none with this name"
                        : "RSI's context is not in the folder");
    return std::nullopt;
  }
  RsiContextFile file = read_rsi_context(*chosen->text, chosen->name);
  if (file.rsi_version != rsi_format(config.rsi_version)) {
    findings.refuse(file.name, 0, "is a context of RSI {}, [controller] rsi_version is {}",
                    file.rsi_version, config.rsi_version);
  }
  return file;
}

/// The ethernet XML named by the context.
const krl::Candidate* find_channel(const krl::Candidates& files,
                                   const std::optional<RsiContextFile>& context,
                                   krl::Findings& findings) {
  const RsiObject* ethernet = context ? context->only("ETHERNET") : nullptr;
  const RsiParameter* named = ethernet == nullptr ? nullptr : ethernet->parameter("ConfigFile");
  const std::string name = named == nullptr ? "cellcal_rsi_ethernet.xml" : named->value;
  const krl::Candidate* channel = choose(files, ControllerFileKind::kRsiChannel, name);
  if (channel == nullptr) {
    findings.refuse(name, 0, "RSI's ethernet XML is not in the folder");
  } else if (named != nullptr && !wire::same_name(channel->name, name)) {
    findings.refuse(context->name, named->line, "ConfigFile is \"{}\", the folder contains {}",
                    name, channel->name);
  }
  return channel;
}

}  // namespace

const RsiElement* krl::RsiSet::received(const std::string& tag) const {
  const auto found = std::ranges::find(channel.receive, tag, &RsiElement::tag);
  return found == channel.receive.end() ? nullptr : &*found;
}

const RsiElement* krl::RsiSet::sent(const std::string& tag) const {
  const auto found = std::ranges::find_if(
      channel.send, [&](const RsiElement& one) { return wire::same_name(one.tag, tag); });
  return found == channel.send.end() ? nullptr : &*found;
}

void krl::RsiSet::check_internal(const char* tag) const {
  const RsiElement* found = sent(tag);
  if (found == nullptr)
    findings.refuse(channel.name, 0, "SEND: {} is missing. Add it with INDX=\"INTERNAL\"", tag);
  else if (found->index != 0)
    findings.refuse(channel.name, found->line, "SEND: INDX of {} is {}. Set \"INTERNAL\"", tag,
                    found->index);
}

void krl::check_hold(const RsiSet& set, const RsiElement& one) {
  const bool wanted = set.mode == CorrectionMode::kAbsolute;
  if (one.hold_on.value_or(!wanted) == wanted) return;
  set.findings.refuse(set.channel.name, one.line,
                      "{} has HOLDON=\"{}\" with RSI_ON(#{}): {}. Set HOLDON=\"{}\"", one.tag,
                      wanted ? 0 : 1, name_of(set.mode),
                      wanted ? "one late reply moves the arm back to where the session began"
                             : "every late reply repeats the last step",
                      wanted ? 1 : 0);
}

std::vector<FileFinding> verify_rsi_files(const ControllerFiles& files,
                                          const RsiFilesConfig& config, CorrectionMode mode) {
  krl::Findings findings;
  const krl::Candidates all = krl::by_kind(files, findings);
  try {
    const std::optional<RsiContextFile> context = find_context(all, config, findings);
    if (const krl::Candidate* found = find_channel(all, context, findings)) {
      const RsiChannelFile channel = read_rsi_channel(*found->text, found->name);
      const RsiSet set{config, mode, findings, channel};
      check_config(set);
      check_sent(set);
      check_received(set);
      if (context) krl::check_context(set, *context);
      if (context) krl::check_public(files, *context, config, findings);
      krl::check_travel(set, context ? &*context : nullptr);
      krl::check_state(set, context ? &*context : nullptr);
    }
    if (context && context->rsi_version == 3) check_unit(all, *context, findings);
  } catch (const ConfigError& error) {
    findings.unreadable(error);
  }
  check_program(files, config, mode, findings);
  return findings.take();
}

}  // namespace cellcal::drivers
